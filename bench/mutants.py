"""Which changes of the core no test notices: a sample of mutants, each tried against the tests that are about its file.

python -m bench.mutants [--sample N] [--seed S] [--only PATH ...] [--again] [--processes N]

A mutant is the program with one place changed, as cosmic-ray's operators do it and two of ours. It is tried against the
tests named as its file, then, if it survives these, against those nearby and the recorded mission that every node has
to say again. Which there are: `bench.mutant_kinds`.

Mutants are tried in copies of this folder below `runs/mutants/`, where results are kept: an interrupted run goes on.
What is said of a survivor stands in `tests/mutants/judged.yaml`; the exit code is 1 where one is not judged yet.
`--again` tries these anew, after a new test, against all tests of their room.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Container, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from difflib import unified_diff
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
import yaml
from cosmic_ray.mutating import use_mutation
from cosmic_ray.plugins import get_operator
from cosmic_ray.work_db import WorkDB
from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkItem, WorkResult

from bench.mutant_kinds import Mutant, compiles, mutants_of

ROOT = Path(__file__).parents[1]
HOME = ROOT / "runs" / "mutants"
JUDGED = ROOT / "tests" / "mutants" / "judged.yaml"
CORE = (
    *("planner/**/*.py", "coordinator/**/*.py", "vehicle_agent/coverage.py", "vehicle_agent/part_survey.py"),
    *("vehicle_agent/survey.py", "comms/lockstep/clock.py", "comms/lockstep/events.py", "comms/lockstep/faults.py"),
    *("sim_world/estimates.py", "sim_world/looks.py", "sim_world/sonar.py", "sim_world/footprints/*.py"),
    "secondlook/recorded/metrics.py",
)
GOLDEN = "tests/secondlook/recorded/test_golden_replay.py"
WIRED = ("test_zenoh_fleet", "test_host", "wall/")
"""Of the wider tests those that wait for a wire or a clock are left out."""
PYTEST = ("-x", "-q", "-p", "no:cacheprovider", "--hypothesis-profile=mutants")
LIBRARIES = ("hypothesis.strategies", "numpy", "pydantic", "shapely", "yaml")
"""Which tests import: a process has them once for all mutants that it tries."""
LIMITS_S = (120, 300, 900)
"""Longer than any of these tests take on a busy machine: who takes longer does not end."""


def tried_against(file: str, root: Path) -> tuple[list[str], list[str], list[str]]:
    """The tests that are about a file of the core, those nearby to which its survivors are given, of its folder, that
    import it, and the recorded mission, and the others of its room."""
    path = Path(file)
    folder = root / "tests" / path.parent
    room = folder if path.parts[0] in {"comms", "secondlook"} else root / "tests" / path.parts[0]
    module, package = ".".join(path.with_suffix("").parts), ".".join(path.parts[:-1])
    imported = re.compile(rf"{module}\b|from {package} import .*\b{path.stem}\b")
    importing = sorted(one for one in room.rglob("test_*.py") if imported.search(one.read_text(encoding="utf-8")))
    first = (
        sorted(folder.glob(f"test_{path.stem}.py"))
        or [one for one in importing if one.is_relative_to(folder)]
        or sorted(folder.glob("test_*.py"))
    )
    nearby = [*importing, root / GOLDEN]
    if path.parts[0] == "comms":
        nearby += (root / "tests" / "comms").glob("test_*buses.py")
    if folder != room:
        nearby += sorted(folder.glob("test_*.py"))
    others = sorted(room.rglob("test_*.py"))
    told = ([one for one in dict.fromkeys(nearby) if one not in first], [one for one in others if one not in nearby])
    nearby, others = ([one for one in some if not any(word in str(one) for word in WIRED)] for some in told)
    names = [[one.relative_to(root).as_posix() for one in some] for some in (first, nearby, others)]
    return names[0], names[1], [one for one in names[2] if one not in names[0]]


# What follows runs in the processes, each with a copy of the folder of its own.


def files_here() -> list[str]:
    """What is here, committed or not, and is no product."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    told = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout.decode().split("\0")
    return [name for name in told if name and (ROOT / name).is_file()]


def end_with_parent() -> None:
    """Ends this process when the one that has started it is gone: a mutant may run for ever."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)  # of the end of a parent nobody tells
        os.kill(os.getpid(), signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


def set_up(numbers: Any) -> None:
    """A copy of what is here, changed or not, and this process within it."""
    end_with_parent()
    copy = HOME / f"copy-{numbers.get()}"
    shutil.rmtree(copy, ignore_errors=True)
    for name in files_here():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, copy / name)
    os.chdir(copy)
    os.environ["PYTHONPATH"] = str(copy)
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    sys.dont_write_bytecode = True
    for library in LIBRARIES:
        importlib.import_module(library)


def of_all_here(tests: Sequence[str]) -> str:
    """Another one where these tests may say something else of the program as it is."""
    code = [(ROOT / name).read_bytes() for name in files_here() if name.endswith((".py", ".yaml", ".toml"))]
    return hashlib.sha256(b"\0".join([*map(str.encode, tests), *code])).hexdigest()[:16]


def unchanged(tests: Sequence[str]) -> str:
    """What the tests say of the program as it is, if they do not pass."""
    command = [sys.executable, "-m", "pytest", *PYTEST, *tests]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout if done.returncode else ""


def tried(mutant: Mutant, *, by_all: bool) -> WorkResult:
    """What came of it: against its own tests, then against those nearby, and `by_all` of its room.

    Where the file is compiled, Python runs it as it stands: to compile it takes longer than its tests do, and compiled
    it would go on with whatever lies beyond an array's end.
    """
    with use_mutation(Path(mutant.file), get_operator(mutant.operator)(), mutant.occurrence) as (was, becomes):
        os.environ["NUMBA_DISABLE_JIT"] = "1" if "@compiled" in was else "0"
        for tests, limit_s in zip(tried_against(mutant.file, Path.cwd())[: 3 if by_all else 2], LIMITS_S, strict=False):
            if (told := said_of(tests, limit_s)) != "passed":
                break
    names = f"a/{mutant.file}", f"b/{mutant.file}"
    diff = ["--- mutation diff ---", *unified_diff(was.split("\n"), becomes.split("\n"), *names, lineterm="")]
    outcome = TestOutcome.SURVIVED if told == "passed" else TestOutcome.KILLED
    return WorkResult(WorkerOutcome.NORMAL, told, outcome, "\n".join(diff))


def said_of(tests: Sequence[str], limit_s: float) -> str:
    """`passed`, `failed` or `timeout`. Tests run in a fork of this process: most take less time than the libraries that
    they import, which are here already."""
    process = get_context("fork").Process(target=run_tests, args=(tests,))
    process.start()
    process.join(limit_s)
    if process.exitcode is not None:
        return "failed" if process.exitcode else "passed"
    os.killpg(process.pid or 0, signal.SIGKILL)
    process.join()
    return "timeout"


def run_tests(tests: Sequence[str]) -> None:
    """Ends this process, with 0 if they pass. They import the copy's modules and none of the folder itself."""
    os.setsid()
    end_with_parent()
    rooms = {path.name for path in ROOT.iterdir()}
    for name in [name for name in sys.modules if name.split(".")[0] in rooms]:
        del sys.modules[name]
    sys.path[:] = [str(Path.cwd()), *(path for path in sys.path if Path(path) != ROOT)]
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    os._exit(int(pytest.main([*PYTEST, "-W", "ignore::pytest.PytestAssertRewriteWarning", *tests])))


# The judged survivors, and the report.


@dataclass(frozen=True)
class Judged:
    """`verdict`: `same`, behaviour does not change, or `untested`; `because` says why."""

    file: str
    was: str
    becomes: str
    verdict: str
    because: str


def judged() -> list[Judged]:
    return [Judged(**entry) for entry in yaml.safe_load(JUDGED.read_text(encoding="utf-8")) or []]


def changed(diff: str) -> tuple[str, str]:
    """The lines as they were and as they are, without what surrounds them."""
    lines = [line for line in diff.splitlines() if not line.startswith(("---", "+++"))]
    was, becomes = (" ".join(line[1:].strip() for line in lines if line.startswith(sign)).strip() for sign in "-+")
    return was, becomes


def is_open(mutant: Mutant, result: WorkResult, known: Container[tuple[str, str, str]]) -> bool:
    """Whether it has survived and is not among those that are judged."""
    return result.test_outcome == TestOutcome.SURVIVED and (mutant.file, *changed(result.diff or "")) not in known


def share(some: int, of: int) -> str:
    return f"{100 * some / of:.1f} %" if of else "-"


def report(tried_ones: Sequence[tuple[Mutant, WorkResult]]) -> tuple[str, int]:
    """As Markdown, and how many survivors are not judged."""
    known = {(one.file, one.was, one.becomes): one for one in judged()}
    rows: dict[str, list[int]] = {}
    told: dict[str, list[str]] = {"not judged yet": [], "untested": [], "same": []}
    for mutant, result in sorted(tried_ones, key=lambda one: (one[0].file, one[0].start)):
        row = rows.setdefault(mutant.file, [0, 0, 0])
        row[0] += 1
        if result.test_outcome == TestOutcome.SURVIVED:
            verdict = known.get((mutant.file, *changed(result.diff or "")))
            row[1] += 1
            row[2] += verdict is not None and verdict.verdict == "same"
            diff = "\n".join((result.diff or "").splitlines()[1:])
            because = f"{verdict.because}\n\n" if verdict else ""
            told[verdict.verdict if verdict else "not judged yet"].append(f"{because}```diff\n{diff}\n```\n")
    tried_count, survived, same = (sum(row[n] for row in rows.values()) for n in range(3))
    timed_out = sum(result.output == "timeout" for _, result in tried_ones)
    lines = [
        f"{tried_count} mutants: {tried_count - survived} killed ({timed_out} of these as they did not end), "
        f"{survived} survived ({share(survived, tried_count)}), of which {same} behave the same, "
        f"{len(told['untested'])} are not tested and {len(told['not judged yet'])} are not judged. "
        f"Of those that change behaviour survived: {share(survived - same, tried_count - same)}.",
        "",
        "| file | mutants | survived | share | behave the same |",
        "|---|---|---|---|---|",
        *(f"| {file} | {n} | {left} | {share(left, n)} | {alike} |" for file, (n, left, alike) in sorted(rows.items())),
    ]
    for heading, diffs in told.items():
        lines += ["", f"## {heading}: {len(diffs)}", "", *diffs]
    return "\n".join(lines) + "\n", len(told["not judged yet"])


def sampled(seed: int, size: int, only: Sequence[str]) -> list[tuple[Mutant, str]]:
    """The mutants of a sample, each with the source of its file."""
    files = sorted({path.relative_to(ROOT).as_posix() for pattern in CORE for path in ROOT.glob(pattern)})
    found = []
    for file in files:
        if not only or any(file.startswith(one) for one in only):
            source = (ROOT / file).read_text(encoding="utf-8")
            found += [(mutant, source) for mutant in mutants_of(file, source, seed)]
    ranked = iter(sorted(found, key=lambda one: one[0].rank))
    return list(islice((one for one in ranked if compiles(*one)), size))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", type=int, default=350, help="how many mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=(), help="how paths of files begin")
    parser.add_argument("--again", action="store_true", help="try those that survived anew")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args()
    HOME.mkdir(parents=True, exist_ok=True)
    results = WorkDB(HOME / "results.sqlite", WorkDB.Mode.create)
    sample = [(mutant, mutant.job(source)) for mutant, source in sampled(asked.seed, asked.sample, asked.only)]
    known = {item.job_id: result for item, result in results.completed_work_items}
    here = {item.job_id for item in results.work_items}
    results.add_work_items([WorkItem.single(job, mutant.spec()) for mutant, job in sample if job not in here])
    told = {(one.file, one.was, one.becomes) for one in judged()}
    missing = [
        (one, job) for one, job in sample if job not in known or (asked.again and is_open(one, known[job], told))
    ]
    if missing:
        run(missing, known, results, asked.processes, by_all=asked.again)
    text, left = report([(mutant, known[job]) for mutant, job in sample])
    (HOME / "report.md").write_text(text, encoding="utf-8")
    print(text)
    return 1 if left else 0


def run(
    missing: Sequence[tuple[Mutant, str]],
    known: dict[str, WorkResult],
    results: WorkDB,
    processes: int,
    *,
    by_all: bool,
) -> None:
    """Tries them, and keeps each result as it comes."""
    spawning = get_context("spawn")
    numbers = spawning.Queue()
    for number in range(processes):
        numbers.put(number)
    with ProcessPoolExecutor(processes, spawning, set_up, (numbers,)) as pool:
        files = {mutant.file for mutant, _ in missing}
        tests = sorted({test for file in files for test in tried_against(file, ROOT)[0]})
        if not (passed := HOME / f"passed-{of_all_here(tests)}").exists():
            if said := pool.submit(unchanged, tests).result():
                sys.exit(f"the tests do not pass of the program as it is:\n{said}")
            passed.touch()
        at_work = {pool.submit(tried, mutant, by_all=by_all): (mutant, job) for mutant, job in missing}
        try:
            for number, done in enumerate(as_completed(at_work), 1):
                (mutant, job), result = at_work[done], done.result()
                if result.worker_outcome != WorkerOutcome.NORMAL or result.test_outcome == TestOutcome.INCOMPETENT:
                    sys.exit(f"{mutant} could not be tried: {result.output}")
                known[job] = result
                results.set_result(job, result)
                outcome, place = result.test_outcome.value, f"{mutant.file}:{mutant.start[0]}"
                print(f"{number}/{len(missing)} {outcome} {place} {mutant.operator}", flush=True)
        finally:
            pool.shutdown(cancel_futures=True)


if __name__ == "__main__":
    sys.exit(main())
