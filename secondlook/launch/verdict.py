"""Why a run has failed, in one sentence, from what its processes say and how they end. Pure: times are arguments.

The same failure shows in several ways, one after the other: a process that dies takes its connection to the hub with
it; one that fails says why before it ends. The best of them is what is told.
"""

from __future__ import annotations

from dataclasses import dataclass

BETTER_WORDS_S = 1.0  # so long better words are waited for


@dataclass(frozen=True)
class Fate:
    """How a process has ended: `how` goes on from its name, `last_words` is the last line of its log, if it failed."""

    exit_code: int
    how: str
    last_words: str = ""


class Verdict:
    """Tell it what is seen, with the wall time in seconds, and ask for the sentence. `hub`: the hub's host."""

    def __init__(self, hub: str) -> None:
        self._hub = hub
        self._sentence: str | None = None
        self._lost: tuple[str, int, float] | None = None
        self._ended: dict[str, tuple[Fate, float]] = {}

    def says(self, sentence: str) -> None:
        """A process has said itself why it fails."""
        self._sentence = self._sentence or sentence

    def loses(self, host: str, at_ms: int, now_s: float) -> None:
        """The hub has lost a host at a simulated time."""
        self._lost = self._lost or (host, at_ms, now_s)

    def ends(self, host: str, fate: Fate, now_s: float) -> None:
        """A process has ended; with exit code 0 that is no failure by itself, except of a hub without a result."""
        self._ended.setdefault(host, (fate, now_s))

    def sentence(self, now_s: float) -> str | None:
        """The sentence; None as long as nothing has failed, or better words may come."""
        if self._sentence is not None:
            return self._sentence
        if self._lost is not None:
            host, at_ms, lost_s = self._lost
            when = f"at {at_ms / 1000:.3f} s of the mission"
            if host in self._ended:
                return _obituary(host, self._ended[host][0], when)
            return f"{host} has fallen silent {when}" if now_s - lost_s >= BETTER_WORDS_S else None
        for host, (fate, ended_s) in self._ended.items():
            waited, failed, is_hub = now_s - ended_s >= BETTER_WORDS_S, fate.exit_code != 0, host == self._hub
            if (waited and failed) or (waited and is_hub) or (failed and is_hub):
                return _obituary(host, fate, "")
        return None


def _obituary(host: str, fate: Fate, when: str) -> str:
    told = " ".join(part for part in (host, fate.how, when) if part)
    return f"{told}: {fate.last_words}" if fate.last_words else told
