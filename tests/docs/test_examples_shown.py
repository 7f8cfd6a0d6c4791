"""What the documents show works, and is what the examples hold."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
BRIEF = ROOT / "tests" / "support" / "brief.yaml"


def python_blocks(document: str) -> list[str]:
    """The Python that a document shows, block by block."""
    return re.findall(r"```python\n(.*?)```", (ROOT / "docs" / document).read_text(encoding="utf-8"), re.DOTALL)


def test_the_tests_shown_in_testing_md_pass(tmp_path: Path) -> None:
    shown = "\n".join(python_blocks("testing.md"))
    assert shown.count('"tellaro"') > 3
    (tmp_path / "test_shown.py").write_text(shown.replace('"tellaro"', f'"{BRIEF}"'))  # sooner flown, else as good
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-W", "error", "--strict-markers", "-q"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    storms = sum(int(seeds) - 1 for seeds in re.findall(r"seeds=(\d+)", shown))  # of these each is a test
    assert f"{shown.count('def test_') + storms} passed" in done.stdout, done.stdout
    assert done.returncode == 0


def test_the_allocator_shown_is_the_examples() -> None:
    (shown,) = python_blocks("plug-ins.md")
    example = (ROOT / "examples" / "own_allocator" / "longest_first.py").read_text(encoding="utf-8")
    assert shown == example
