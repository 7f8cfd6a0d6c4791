"""What is remarked of many missions before the first is flown."""

from __future__ import annotations

import random
import sys
from collections.abc import Sequence

from secondlook.commands.run import expected_of
from secondlook.errors import UserError
from secondlook.preflight.expectation import OR_ANYWAY
from secondlook.scenario import Scenario

MOST_LOOKED_AT = 100  # scenarios; each takes 0.07 s of `tellaro`, 1 s of `armada`
MOST_TOLD = 3


def remark_on(scenarios: Sequence[tuple[Scenario, Sequence[str]]]) -> None:
    """Tells on standard error why missions cannot end within their limits, which `secondlook run` refuses.

    `scenarios`: each with what is varied, KEY=VALUE; a reason is told once, with what all have in common for which it
    holds. Of more than MOST_LOOKED_AT so many are looked at, always the same.
    """
    places = random.Random(0).sample(range(len(scenarios)), min(MOST_LOOKED_AT, len(scenarios)))
    found = dict[str, list[str]]()
    for scenario, settings in (scenarios[place] for place in sorted(places)):
        try:
            reasons = expected_of(scenario).refusals
        except UserError:  # a spacing planner fails, or does not come back; missions tell that, and nobody waits again
            break
        for reason in reasons:
            found[reason] = [one for one in found.get(reason, settings) if one in settings]
    for reason, settings in list(found.items())[:MOST_TOLD]:
        varied = f"--vary {' '.join(settings)}: " if settings else ""
        sys.stderr.write(f"{varied}{reason.replace(OR_ANYWAY, 'but is flown all the same')}\n")
    if len(found) > MOST_TOLD:
        sys.stderr.write(f"and {len(found) - MOST_TOLD} more\n")
