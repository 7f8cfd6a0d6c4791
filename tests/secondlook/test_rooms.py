"""Something of the user's that is called like a room is told, not imported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import secondlook

# As where the project is installed plainly: the finder of an editable installation would put our rooms first.
PLAIN = """
import sys
sys.meta_path[:] = [one for one in sys.meta_path if "editable" not in getattr(one, "__module__", str(one))]
sys.path[:0] = [{shadow!r}, {root!r}]
from secondlook.installed_command import main
main()
"""


@pytest.mark.parametrize("shadow", ["comms.py", "planner/__init__.py", "viz.py"])
def test_a_file_in_the_way_is_named(tmp_path: Path, shadow: str) -> None:
    (tmp_path / shadow).parent.mkdir(exist_ok=True)
    (tmp_path / shadow).touch()
    root = str(Path(secondlook.__file__).parent.parent)
    done = subprocess.run(
        [sys.executable, "-P", "-c", PLAIN.format(shadow=str(tmp_path), root=root), "scenarios"],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    room = Path(shadow).parts[0].removesuffix(".py")
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith(f"the package '{room}' is taken from {tmp_path / shadow} and not from ")
    assert done.stderr.count("\n") == 1


def test_with_nothing_in_the_way_the_command_runs(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-P", "-c", "from secondlook.installed_command import main; main()", "scenarios"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "tellaro" in done.stdout
