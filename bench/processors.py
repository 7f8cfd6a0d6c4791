"""Whether a mission is the same on every processor: whole missions, with all that numpy, its linear algebra and the C
library make of this one and without.

python -m bench.processors [--scenarios a,b] [--seed N]

Flies every bundled mission but the largest, or some, twice on the local bus, and a few with clutter, positions that
err, a goal and a modem. A line for each tells whether both have one digest, and the exit code is 1 if any has not; 2
where this processor has nothing that not every one has, so that nothing can be told.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from bench.clearance_tables import BOTH, CLUTTER, FALSE_ALARMS, NONE_LEFT
from bench.flown import Case, as_options
from secondlook.launch.supervisor import PROGRAM
from secondlook.scenario.bundled import scenario_names

BUNDLED = [name for name in scenario_names() if name != "armada"]
"""All but one that takes a quarter of an hour."""
NOT_EVERYWHERE = " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", ()))
"""What numpy makes use of that not every processor has."""
PLAIN = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-FMA,-FMA4",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
}
"""Has the C library work out `exp`, `sin` and the like, OpenBLAS sums of products, and what is compiled all else, as an
old processor would."""
if platform.machine() in ("x86_64", "AMD64"):
    PLAIN["OPENBLAS_CORETYPE"] = "Nehalem"
ERRING = tuple(f"vehicles.{one}.position_error_m=10" for one in BOTH)
ODD: tuple[Case, ...] = (
    ("tellaro", ("targets.count=20", CLUTTER, *map(FALSE_ALARMS.format, BOTH))),
    ("tellaro", (*ERRING, *map(FALSE_ALARMS.format, BOTH))),
    ("two-helpers", ("targets.count=10", "mission.deadline_factor=2", NONE_LEFT.format(0.8))),
    ("two-helpers", (CLUTTER, "mission.deadline_factor=2", "mission.goal={kind: cleared, clearance: 0.8}")),
    ("patchy", ("link.profile=janus",)),
)
"""Missions that decide by more than bundled ones do."""


def digest(case: Case, seed: int, without: str) -> str:
    """That of a mission, flown in a process that does without some of what the processor has."""
    scenario, overrides = case
    less = {"NPY_DISABLE_CPU_FEATURES": without, **PLAIN} if without else {}
    with tempfile.TemporaryDirectory() as folder:
        words = ["run", scenario, "--bus", "local", "--no-record", "--seed", str(seed), "--out", folder]
        command = [sys.executable, "-P", "-c", PROGRAM, *words, *as_options(overrides)]
        subprocess.run(command, check=True, env=os.environ | less, stdout=subprocess.DEVNULL)
        return str(json.loads((Path(folder) / "summary.json").read_text())["digest"])


def _scenarios(told: str) -> list[str]:
    names = told.split(",")
    for name in names:
        if name not in scenario_names():
            raise argparse.ArgumentTypeError(f"{name!r} is not bundled; must be some of: {', '.join(scenario_names())}")
    return names


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies them; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m bench.processors", description=__doc__)
    parser.add_argument("--scenarios", default=BUNDLED, type=_scenarios, metavar="A,B")
    parser.add_argument("--seed", type=int, default=11)
    options = parser.parse_args(arguments)
    if not NOT_EVERYWHERE:
        print("numpy makes use of nothing here that not every processor has: nothing can be told", file=sys.stderr)
        return 2
    cases = [*((name, ()) for name in options.scenarios), *(case for case in ODD if case[0] in options.scenarios)]
    differ = 0
    with ThreadPoolExecutor(os.cpu_count()) as at_once:
        flights = [
            [at_once.submit(digest, case, options.seed, without) for without in ("", NOT_EVERYWHERE)] for case in cases
        ]
        for (scenario, overrides), both in zip(cases, flights, strict=True):
            one, other = (flight.result() for flight in both)
            differ += one != other
            print(f"{'one digest' if one == other else 'DIFFER'}  {' '.join((scenario, *overrides))}", flush=True)
    print(f"without {NOT_EVERYWHERE}: {differ} of {len(cases)} missions differ")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
