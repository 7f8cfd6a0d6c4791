"""How long a mission takes over a link, beside how long it takes without.

python -m bench.link_time [SCENARIO] [--profile NAME ...] [--runs N] [--set KEY=VALUE ...]

Flies `secondlook run`, `tellaro` if no other is named, over Zenoh and recorded: without a link and over each profile in
turn, N times round, as a machine may be faster in one minute than in another. Prints the median of the seconds that the
command took, and the median of its ratio to the one without link of the same round.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Sequence

from bench.flown import as_options, call_secondlook

WITHOUT = "ideal"
PROFILES = ("micromodem-0", "micromodem-1", "micromodem-6", "janus")


def took_s(scenario: str, profile: str, sets: Sequence[str]) -> float:
    """The wall time of one mission. Raises CalledProcessError where it fails."""
    with tempfile.TemporaryDirectory(prefix="secondlook-link-") as folder:
        settings = as_options((f"link.profile={profile}", *sets))
        began_s = time.monotonic()
        call_secondlook("run", scenario, "--out", f"{folder}/run", *settings, quiet=True)
        return time.monotonic() - began_s


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m bench.link_time", description=__doc__.split("\n")[0])
    parser.add_argument("scenario", nargs="?", default="tellaro")
    parser.add_argument("--profile", action="append", default=[], metavar="NAME")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = parser.parse_args()
    profiles = (WITHOUT, *(given.profile or PROFILES))
    rounds = [{one: took_s(given.scenario, one, given.set) for one in profiles} for _ in range(given.runs)]
    for one in profiles:
        seconds = statistics.median(flown[one] for flown in rounds)
        ratio = statistics.median(flown[one] / flown[WITHOUT] for flown in rounds)
        print(f"{one:14} {seconds:6.2f} s  {ratio:.2f}")


if __name__ == "__main__":
    main()
