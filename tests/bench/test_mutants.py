"""The mutation run: which mutants it draws, what it tries them against, and the list of judged survivors."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from cosmic_ray import work_item

from bench import mutants
from bench.mutant_kinds import Mutant, compiles, mutants_of
from bench.mutants import Judged, changed, judged, report, tried_against

ROOT = Path(mutants.__file__).parents[1]

SOURCE = """
from __future__ import annotations


@dataclass(frozen=True)
class Some:
    value: int | None = None

    def add(self, more: int | None, *, twice: bool) -> int | None:
        self.value = min(more, 7)
        note(self)
        return {**more, "a": 1} if more < 3 else sum(zip(more, strict=True))

note.called_with(lambda: (1 + 2,))
"""


def told(source: str) -> list[tuple[int, str]]:
    found = [(one.start[0], one.operator) for one in mutants_of("a.py", source, 1) if compiles(one, source)]
    return sorted((line, operator.partition("/")[2].removeprefix("Replace")) for line, operator in found)


def test_behaviour_is_changed_and_nothing_else() -> None:
    assert told(SOURCE) == [
        (10, "LeftOut"),
        (10, "NumberReplacer"),
        (10, "NumberReplacer"),
        (10, "OtherFunction"),
        (11, "LeftOut"),
        (12, "AddNot"),
        (12, "ComparisonOperator_Lt_GtE"),
        (12, "ComparisonOperator_Lt_LtE"),
        *[(12, "NumberReplacer")] * 4,
    ]


def test_what_an_edit_leaves_is_drawn_as_before() -> None:
    before = {one.rank for one in mutants_of("a.py", SOURCE, 1)}
    after = {one.rank for one in mutants_of("a.py", "import os\n\nLIMIT = 5\n" + SOURCE, 1)}
    assert len(before) == len(mutants_of("a.py", SOURCE, 1))
    assert before < after
    assert not before & {one.rank for one in mutants_of("a.py", SOURCE, 2)}


def test_a_file_is_tried_against_the_tests_of_its_name_then_those_nearby_then_those_of_its_room() -> None:
    first, nearby, others = tried_against("coordinator/cut/strips.py", ROOT)
    assert first == ["tests/coordinator/cut/test_strips.py"]
    assert {"tests/coordinator/cut/test_search.py", mutants.GOLDEN} <= set(nearby)
    assert "tests/coordinator/test_coordinator.py" in others
    assert len({*first, *nearby, *others}) == len(first) + len(nearby) + len(others)
    # It has no test of its name.
    theirs = [f"tests/coordinator/allocate/test_{name}.py" for name in ("beam", "routes")]
    assert tried_against("coordinator/allocate/team.py", ROOT)[0] == theirs


DIFF = """--- mutation diff ---
--- a/planner/a.py
+++ b/planner/a.py
@@ -1,3 +1,3 @@
 def half(x):
-    return x / 2
+    return x * 2
"""


def result(outcome: work_item.TestOutcome) -> work_item.WorkResult:
    return work_item.WorkResult(work_item.WorkerOutcome.NORMAL, "", outcome, DIFF)


@pytest.mark.parametrize(
    ("verdict", "left", "share"), [("same", 0, "0.0 %"), ("untested", 0, "50.0 %"), ("", 1, "50.0 %")]
)
def test_survivors_are_told_with_what_is_said_of_them(
    monkeypatch: pytest.MonkeyPatch, verdict: str, left: int, share: str
) -> None:
    entry = Judged("planner/a.py", "return x / 2", "return x * 2", verdict, "nobody asks")
    monkeypatch.setattr(mutants, "judged", lambda: [entry] if verdict else [])
    one = Mutant("planner/a.py", "core/ReplaceBinaryOperator_Div_Mul", 0, (2, 13), (2, 14), "")
    text, not_judged = report(
        [(one, result(work_item.TestOutcome.SURVIVED)), (one, result(work_item.TestOutcome.KILLED))]
    )
    assert not_judged == left
    assert f"Of those that change behaviour survived: {share}." in text
    assert ("nobody asks" in text) is bool(verdict)
    assert "+    return x * 2" in text


def test_each_judged_line_is_still_there_and_judged_once_with_a_reason() -> None:
    entries = judged()
    assert len({(one.file, one.was, one.becomes) for one in entries}) == len(entries)
    for one in entries:
        lines = [line.strip() for line in (ROOT / one.file).read_text(encoding="utf-8").splitlines()]
        assert one.was in lines or one.was in " ".join(lines), one
        assert one.verdict in {"same", "untested"}, one
        assert len(one.because) > 10, one


def test_lines_are_compared_without_what_surrounds_them() -> None:
    assert changed(DIFF) == ("return x / 2", "return x * 2")


def test_a_mutant_that_runs_for_ever_ends_with_the_process_that_tries_it() -> None:
    """However that ends. The mutant has the test's end of the pipe, which is closed when both are gone."""
    tries = """
import os
import signal
from bench.mutants import end_with_parent

if os.fork() == 0:
    end_with_parent()
    signal.alarm(60)  # whatever comes of this test
    os.write(1, b"at work")
    while True:
        pass
os.wait()
"""
    with subprocess.Popen([sys.executable, "-c", tries], cwd=ROOT, stdout=subprocess.PIPE) as trying:
        assert trying.stdout is not None
        assert trying.stdout.read(len("at work")) == b"at work"
        trying.kill()
        assert trying.communicate(timeout=30)[0] == b""
