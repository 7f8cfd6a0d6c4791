"""How long it takes over Zenoh from a strip that is published while a helper is free to its acceptance.

python -m bench.strip_latency [SCENARIO] [--seeds N] [--crowded] [--set KEY=VALUE]

Pools `latency_ms.strip_to_task` over the seeds 1 to N: wall time, stamped by the coordinator's process where it sends
and receives. `--crowded`: strips of 10 to 20 m and a slow helper, so that some 200 strips are open; how many there were
when strips were offered is told, too. Every mission has its processes on this machine; other load makes it slower.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.progress import track

from comms.lockstep.drive import Lockstep
from comms.node import Received
from comms.result import STRIP_TO_TASK
from comms.said.messages import StripState, StripStatus
from secondlook.errors import UserError
from secondlook.fleet.build import build_fleet
from secondlook.launch.processes import Processes, RunFailedError
from secondlook.scenario import Scenario, load_scenario

CROWDED = (
    "coordinator.min_strip_m=10",
    "coordinator.max_strip_m=20",
    "coordinator.worth_risk=0.05",
    "vehicles.helper.speed_mps=0.8",
)


@dataclass
class OpenStrips:
    """A listener that counts the strips open whenever one is offered."""

    at_offers: list[int] = field(default_factory=list)
    _states: dict[str, StripState] = field(default_factory=dict)

    def on_message(self, received: Received) -> None:
        """Takes one message."""
        if isinstance(received.message, StripStatus):
            if received.message.state is StripState.OFFERED:
                self.at_offers.append(list(self._states.values()).count(StripState.OPEN))
            self._states[received.key] = received.message.state

    def close(self) -> None:
        """Holds nothing to close."""


def latencies_ms(scenario: Scenario, strips: OpenStrips) -> list[float]:
    """Those of one mission, each node in a process of its own."""
    with (
        tempfile.TemporaryDirectory(prefix="secondlook-latency-") as folder,
        Processes(build_fleet(scenario, record=False), _logs(Path(folder)), strips, Lockstep()) as processes,
    ):
        return processes.run().latencies_ms.get(STRIP_TO_TASK, [])


def _logs(folder: Path) -> Path:
    logs = folder / "logs"
    logs.mkdir()
    return logs


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m bench.strip_latency", description=__doc__.split("\n")[0])
    parser.add_argument("scenario", nargs="?", default="tellaro")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--crowded", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    arguments = parser.parse_args()
    settings = [*(CROWDED if arguments.crowded else ()), *arguments.set]
    pooled: list[float] = []
    strips = OpenStrips()
    try:
        seeds = range(1, arguments.seeds + 1)
        for seed in track(seeds, "strip latency", transient=True, disable=not sys.stderr.isatty()):
            pooled += latencies_ms(load_scenario(arguments.scenario, settings, seed), strips)
    except UserError as error:
        sys.exit(f"{error}")
    except (RunFailedError, KeyboardInterrupt) as error:
        sys.exit(f"{error}" or "interrupted")
    if not pooled:
        sys.exit("no strip was published while a helper was free")
    p50, p90, p99 = np.percentile(pooled, [50, 90, 99])
    print(f"{arguments.scenario}, seeds 1 to {arguments.seeds}: {len(pooled)} strips")
    print(f"strip to task: p50 {p50:.1f} ms, p90 {p90:.1f} ms, p99 {p99:.1f} ms, largest {max(pooled):.1f} ms")
    low, median, high = np.percentile(strips.at_offers, [10, 50, 90])
    print(f"strips open when one was offered: median {median:.0f}, from {low:.0f} to {high:.0f} in 80 % of offers")


if __name__ == "__main__":
    main()
