"""Certificates for tests, made as the documentation says."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

from comms.session import Certificates

PAGE = Path(__file__).parents[2] / "docs" / "several-hosts.md"
ADDRESS = "192.0.2.1"


def make_certificates(folder: Path, names: Sequence[str], address: str) -> dict[str, Certificates]:
    """Certificates of one authority, by name; all hold for a router at `address`."""
    (commands,) = re.findall(r"```bash\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    commands = re.sub(r"for name in [a-z ]+;", f"for name in {' '.join(names)};", commands)
    done = subprocess.run(
        ["bash", "-euc", commands.replace(ADDRESS, address)], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    authority = folder / "ca.pem"
    return {name: Certificates(authority, folder / f"{name}.pem", folder / f"{name}.key") for name in names}


def options(one: Certificates) -> list[str]:
    """The same on the command line."""
    return ["--tls-ca", str(one.authority), "--tls-cert", str(one.certificate), "--tls-key", str(one.key)]
