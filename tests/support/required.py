"""What a test needs beside Python: where that is missing it is skipped and says so, or fails if all are required."""

from __future__ import annotations

import os
import shutil
import subprocess

import pytest


def require(missing: str | None) -> None:
    """Ends the test where something is missing, in these words."""
    if missing is None:
        return
    if os.environ.get("SECONDLOOK_REQUIRE_ALL") == "1":
        pytest.fail(missing)
    pytest.skip(missing)


def missing_for_namespaces() -> str | None:
    """What running in network namespaces of one's own lacks here."""
    if shutil.which("ip") is None:
        return "network namespaces cannot be made: there is no ip (iproute2)"
    name = f"secondlook-try-{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        return f"network namespaces cannot be made (it needs root): {made.stderr.strip()}"
    subprocess.run(["ip", "netns", "delete", name], check=True)
    return None


def missing_for_small_disks() -> str | None:
    """What making a disk of some kilobytes lacks here."""
    if shutil.which("unshare") is None:
        return "small disks cannot be made: there is no unshare (util-linux)"
    made = subprocess.run(["unshare", "-rm", "true"], capture_output=True, text=True, check=False)
    return None if made.returncode == 0 else f"small disks cannot be made (it needs namespaces): {made.stderr.strip()}"
