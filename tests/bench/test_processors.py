"""Missions that are not the same on every processor are noticed."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

from bench import processors
from bench.flown import Case

Patch = pytest.MonkeyPatch
Output = pytest.CaptureFixture[str]


def told_by(monkeypatch: Patch, differing: str = "") -> None:
    def digest(case: Case, seed: int, without: str) -> str:
        return f"{case} {seed}" + (without if case[0] == differing else "")

    monkeypatch.setattr(processors, "digest", digest)
    monkeypatch.setattr(processors, "NOT_EVERYWHERE", "X86_V4")


def test_one_that_differs_is_told_and_fails(monkeypatch: Patch, capsys: Output) -> None:
    told_by(monkeypatch, differing="patchy")
    assert processors.main(["--scenarios", "clear,patchy"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "one digest  clear",
        "DIFFER  patchy",
        "DIFFER  patchy link.profile=janus",
        "without X86_V4: 2 of 3 missions differ",
    ]


def test_all_alike_is_well(monkeypatch: Patch, capsys: Output) -> None:
    told_by(monkeypatch)
    assert processors.main([]) == 0
    assert capsys.readouterr().out.endswith(f"0 of {len(processors.BUNDLED) + len(processors.ODD)} missions differ\n")


def test_where_nothing_can_be_told_it_does_not_pass(monkeypatch: Patch, capsys: Output) -> None:
    monkeypatch.setattr(processors, "NOT_EVERYWHERE", "")
    assert processors.main([]) == 2
    assert "nothing can be told" in capsys.readouterr().err


def test_a_mission_flown_with_less_and_with_nothing_compiled_has_its_digest(monkeypatch: Patch) -> None:
    """Compiled for less it is flown by `make processors`: that compiles all anew, and takes a minute."""
    brief = ("tellaro", ("area.polygon_m=[[0, 0], [150, 0], [150, 60], [0, 60]]",))
    with_all, of_another_seed = (processors.digest(brief, seed, "") for seed in (3, 4))
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert len(with_all) == 64
    assert processors.digest(brief, 3, processors.NOT_EVERYWHERE) == with_all != of_another_seed


ROOTS = "numpy.sqrt(numpy.arange(number)) @ numpy.sqrt(numpy.arange(number))[::-1].copy()"


@pytest.mark.parametrize("worked_out", ["math.sin(number / 7)", ROOTS])
def test_the_c_library_and_linear_algebra_do_with_less_as_well(worked_out: str) -> None:
    """They work last bits out otherwise then, as they would on another processor."""
    command = [sys.executable, "-c", f"import math, numpy; print(*[float({worked_out}) for number in range(7000)])"]
    one, other = (
        [float(value) for value in subprocess.run(command, env=env, capture_output=True, check=True).stdout.split()]
        for env in (os.environ, os.environ | processors.PLAIN)
    )
    if platform.libc_ver()[0] == "glibc" and "X86_V3" in processors.NOT_EVERYWHERE:
        assert one != other
    assert one == pytest.approx(other, rel=1e-9)


def test_a_scenario_that_is_not_bundled_is_refused(capsys: Output) -> None:
    with pytest.raises(SystemExit) as refused:
        processors.main(["--scenarios", "clear,nosuch"])
    assert refused.value.code == 2
    assert "'nosuch' is not bundled; must be some of: armada, " in capsys.readouterr().err
