"""Something of the user's that is called like a room is told, not imported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from called import Call

import secondlook
from comms import errors
from secondlook.rooms import ROOMS

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
    assert done.stderr.startswith(f"your {tmp_path / shadow} hides ours, the package '{room}' at ")
    assert done.stderr.count("\n") == 1


def test_a_program_of_the_users_that_loads_a_run_is_told_too(tmp_path: Path) -> None:
    (tmp_path / "planner.py").touch()
    root = str(Path(secondlook.__file__).parent.parent)
    program = PLAIN.replace(
        "from secondlook.installed_command import main\nmain()", "import secondlook; secondlook.load('')"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", program.format(shadow=str(tmp_path), root=root)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    told = f"secondlook.errors.UserError: your {tmp_path / 'planner.py'} hides ours, the package 'planner' at "
    assert done.stderr.splitlines()[-1].startswith(told), done.stderr


@pytest.mark.parametrize("part", ["mine.py", "parts/mine.py", "planner.py"])
@pytest.mark.parametrize("hidden", ["planner.py", "planner/__init__.py"])
def test_a_part_beside_a_file_that_is_called_like_a_room_is_refused(
    users_folder: Path, called: Call, part: str, hidden: str
) -> None:
    for file in (users_folder / part, users_folder / hidden):
        file.parent.mkdir(exist_ok=True)
        file.touch()
    (users_folder / part).write_text("class Mine:\n    def assign(self, situation):\n        return {}\n")
    module = part.removesuffix(".py").replace("/", ".")
    if part.startswith("parts"):
        (users_folder / "parts" / "__init__.py").touch()
    command = ("check", "tellaro", "--set", f"coordinator.allocator={module}:Mine")
    first = "planner.py" if part == "planner.py" else hidden
    told = (
        f"must not lie beside {users_folder / first}, which has the name of a package of ours and hides it or is hidden"
    )
    assert called(*command) == (
        2, "", f'--set {command[-1]}: coordinator.allocator: "{module}:Mine" is not allowed; {told}\n'
    )  # fmt: skip
    for file in (users_folder / "planner.py", users_folder / "planner" / "__init__.py"):
        file.unlink(missing_ok=True)
    if part != "planner.py" and hidden == "planner.py":
        code, _, error = called(*command)
        assert (code, error) == (0, "")


def test_failures_are_told_of_parts_but_never_of_a_room() -> None:
    assert set(ROOMS) | {"secondlook"} <= set(errors._NO_PARTS)


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
