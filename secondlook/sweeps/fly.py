"""Flies what is missing of a sweep."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from secondlook.engine.engine import Engine, do_all, own_processes
from secondlook.engine.work_process import Lost
from secondlook.errors import UserError
from secondlook.sweeps.folder import sweep_folder
from secondlook.sweeps.plan import SweepPlan, SweptMission, checked
from secondlook.sweeps.rows import fly, row_of
from secondlook.sweeps.standings import Sweep, load_sweep

LIMIT_S = 600.0
"""Of the wall clock, for one mission."""
Progress = Callable[[int, int], None]
"""Told how many missions are there, those of an earlier call too, and how many of this one have failed."""


def fly_missing(
    plan: SweepPlan,
    folder: Path,
    engine: Engine,
    progress: Progress = lambda done, failed: None,
    *,
    limit_s: float = LIMIT_S,
    flies: Callable[[SweptMission], Mapping[str, Any]] = fly,
) -> int:
    """Flies what is not there yet of a sweep, and writes a row of each; tells how many of these have failed.

    `limit_s`: wall time after which a mission is ended, which is then one that failed. `flies`: gives the figures of
    one by column. What has come is written whatever ends it. Raises UserError, before anything is flown, for what
    cannot be; EngineError and CannotWriteError later.
    """
    failed = 0
    with sweep_folder(folder, plan) as rows:
        there = rows.done()
        missing = (one for one in plan.missions() if one.key not in there)
        done = len(there)  # all of this plan, which has become no smaller
        progress(done, failed)
        try:
            for mission, figures in do_all(flies, missing, engine, count=plan.count - done, limit_s=limit_s):
                told = {"failure": figures.why} if isinstance(figures, Lost) else figures
                rows.add(row_of(plan, mission, told, rows.schema))
                failed += told.get("failure") is not None
                done += 1
                progress(done, failed)
        finally:
            rows.write()
        rows.join()
    return failed


def fly_sweep(
    scenario: str,
    folder: str,
    seeds: range,
    vary: Mapping[str, Any],
    settings: Sequence[str],
    executor: Executor | None,
    side_by_side: int | None,
) -> Sweep:
    """See `secondlook.fly_sweep`."""
    if side_by_side is not None and side_by_side < 1:
        raise UserError(f"side_by_side: {side_by_side} is not allowed; must be at least 1")
    slots = side_by_side or os.cpu_count() or 1
    plan = SweepPlan(scenario, seeds, tuple(settings), checked(vary))
    engine: AbstractContextManager[Engine] = (
        own_processes(slots) if executor is None else nullcontext(Engine(executor, lambda: slots))
    )
    with engine as flies:
        fly_missing(plan, Path(folder), flies)
    return load_sweep(folder)
