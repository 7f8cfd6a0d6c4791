"""The clock of a fleet that the wall clock drives: what time it is, who is there, when the mission starts and is over.

Pure: readings of the local monotonic clock, in seconds, are arguments.

The mission starts when all hosts are there. A clock that is started anew takes the mission's time from the first host
that knows it, so that the hub may be restarted in mid-mission. Where all were, it goes on from the latest time that one
of them remembers.
"""

from __future__ import annotations

import enum
import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from comms.errors import WordsError
from comms.result import BusResult, Ending, LastWord, summed_up
from comms.said.codec import SCHEMA_VERSION
from comms.wall.words import Hello, pack_finish
from comms.words import pack

SIGNALS_KEPT = 32


class MissionTime:
    """Mission time by a local clock that is set by the time signals of the mission's clock.

    A signal tells the mission time at which it was sent, and by how much that runs faster than the wall. It is heard a
    little later, so that of the last signals the one that was least under way is the right one. Local times are those
    of a monotonic clock, in seconds. Mission time never goes back; it stands still while it is held.
    """

    def __init__(self) -> None:
        self.factor = 1.0
        self._zeros_ms: deque[float] = deque(maxlen=SIGNALS_KEPT)
        self._latest_ms = 0
        self._held = False

    @property
    def known(self) -> bool:
        """Whether a signal has told it."""
        return bool(self._zeros_ms)

    def hear(self, told_ms: float, factor: float, local_s: float) -> None:
        """A signal has arrived at this local time."""
        if factor != self.factor or self._held:
            self._zeros_ms.clear()
            self.factor, self._held = factor, False
        self._zeros_ms.append(told_ms - local_s * 1000 * factor)

    def hold(self, local_s: float) -> None:
        """It stands still until the next signal."""
        if self.known:
            self.now_ms(local_s)
            self._held = True

    @property
    def is_held(self) -> bool:
        """Whether it stands still."""
        return self._held

    def now_ms(self, local_s: float) -> int:
        """Mission time in whole milliseconds; to be asked once it is known."""
        if self._held:
            return self._latest_ms
        self._latest_ms = max(self._latest_ms, math.floor(max(self._zeros_ms) + local_s * 1000 * self.factor))
        return self._latest_ms

    def local_s(self, mission_ms: int) -> float:
        """When by the local clock a mission time comes; never as long as it stands still."""
        return math.inf if self._held else (mission_ms - max(self._zeros_ms)) / 1000 / self.factor


WRAP_UP_S = 0.5  # wall time in which the fleet's last words are said after the mission is over
LAST_WORD_WITHIN_S = 8.0
HERE_S = 3.0  # a host that was heard so lately is there
COMES_BACK_S = 8.0  # so long a process that has died may take to be there again, or one to find a clock started anew


class Phase(enum.Enum):
    """How far the run has come. ENDING: those that act give their last words; CLOSING: those that listen do."""

    WAITING = "waiting"
    RUNNING = "running"
    ENDING = "ending"
    CLOSING = "closing"
    ENDED = "ended"


FINISHED_LISTENING = (Phase.CLOSING, Phase.ENDED)
FINISHED_ACTING = (Phase.ENDING, *FINISHED_LISTENING)


@dataclass
class _Host:
    instance: str = ""
    heard_s: float = -HERE_S
    awaited_until_s: float = -math.inf
    ready: bool = False
    remembers_ms: int = 0
    last_word: LastWord | None = None


class WallClock:
    """The clock of one run.

    `hosts`: those it waits for, each with whether it only listens. `taken_up`: whether it has the mission's time from
    others. `words` are to be sent to hosts, and taken away, by
    whoever holds the clock; `notices` are for people.
    """

    def __init__(
        self, hosts: Mapping[str, bool], scenario_sha256: str, time_limit_ms: int, factor: float, began_s: float
    ) -> None:
        self.time = MissionTime()
        self.phase = Phase.WAITING
        self.words: list[tuple[str, bytes]] = []
        self.notices: list[str] = []
        self.over_ms: int | None = None
        self.taken_up = False
        self.factor = factor
        self._listens = dict(hosts)
        self._hosts = {host: _Host(heard_s=began_s - HERE_S) for host in hosts}
        self._scenario_sha256 = scenario_sha256
        self._time_limit_ms = time_limit_ms
        self._began_s = began_s
        self._until_s = 0.0
        self._last_words_here: list[LastWord] = []
        self._result = BusResult(Ending.OVER, 0)

    @property
    def result(self) -> BusResult:
        """What has come of it, as far as is known."""
        return self._result

    @property
    def missing(self) -> list[str]:
        """The hosts that the start waits for."""
        return [host for host, known in self._hosts.items() if not known.ready]

    def hello(self, host: str, hello: Hello, now_s: float) -> None:
        """A host says that it is there. Raises WordsError where a process that takes part is said to be another than it
        was: it would be sent away for words that cannot be its own."""
        known = self._hosts.get(host)
        fits = hello.schema == SCHEMA_VERSION and hello.scenario_sha256 == self._scenario_sha256
        if known is None:
            self._refuse(host, hello, f"{host} is none of the scenario's nodes that the router knows")
        elif known.instance == hello.instance and not fits:
            raise WordsError("a hello that is not like those before")
        elif hello.schema != SCHEMA_VERSION:
            self._refuse(
                host, hello, f"the fleet speaks schema version {SCHEMA_VERSION}, {host} version {hello.schema}"
            )
        elif hello.scenario_sha256 != self._scenario_sha256:
            ours, theirs = self._scenario_sha256[:12], hello.scenario_sha256[:12]
            self._refuse(
                host,
                hello,
                f"the router has another scenario than {host}, {ours} and not {theirs}: file, --seed and --set must be "
                "the same everywhere",
            )
        elif known.instance not in ("", hello.instance) and now_s - known.heard_s < HERE_S:
            self._refuse(host, hello, f"another {host} takes part already")
        else:
            self._greet(host, known, hello, now_s)

    def gone(self, host: str, instance: str, now_s: float) -> None:
        """The connection of a process is gone; one that takes no part is not missed. At the end it is waited for a
        while as if it were there: it may be started again."""
        known = self._hosts.get(host)
        if known is not None and known.instance == instance and known.last_word is None:
            known.instance, known.ready = "", False
            known.awaited_until_s = now_s + COMES_BACK_S
            self.notices.append(f"{host} is gone")

    @property
    def unfinished(self) -> list[str]:
        """The listeners that have not said that they have heard all there was."""
        return [host for host, listens in self._listens.items() if listens and not self.is_done(host)]

    def is_done(self, host: str) -> bool:
        """Whether a host has given its last word."""
        return host in self._hosts and self._hosts[host].last_word is not None

    def done(self, host: str, last_word: LastWord) -> None:
        """A host's last word."""
        if host in self._hosts:
            self._hosts[host].last_word = last_word
            self.words.append((host, pack("goodbye")))

    def done_here(self, last_word: LastWord) -> None:
        """The last word of those in the clock's own process."""
        self._last_words_here.append(last_word)

    def over(self, at_ms: int) -> None:
        """The coordinator has said that the mission is over."""
        if self.over_ms is None:
            self.over_ms = at_ms

    def silent(self, now_s: float, patience_s: float) -> list[str]:
        """Hosts of which nothing was heard for so long."""
        return [
            host
            for host, known in self._hosts.items()
            if known.last_word is None and now_s - max(known.heard_s, self._began_s) >= patience_s
        ]

    def pass_time(self, now_s: float) -> None:
        """Goes on to the next phase if it is time for it."""
        if self.phase is Phase.WAITING and not self.missing:
            begins_ms = max((known.remembers_ms for known in self._hosts.values()), default=0)
            self.taken_up = begins_ms > 0
            self.time.hear(begins_ms, self.factor, now_s)
            goes_on = f"goes on at {begins_ms / 1000:.0f} s"
            self._run(f"all are here, the mission {goes_on if self.taken_up else 'begins'}")
        elif self.phase is Phase.RUNNING:
            now_ms = self.time.now_ms(now_s)
            if self.over_ms is not None:
                self._until_s = self._until_s or now_s + WRAP_UP_S
                if now_s >= self._until_s:
                    self._finish(Ending.OVER, self.over_ms, now_s)
            elif now_ms > self._time_limit_ms:
                self._finish(Ending.TIME_LIMIT, self._time_limit_ms, now_s)
        elif self.phase is Phase.ENDING and self._all_done(now_s, listens=False):
            self._sum_up()
            self._to_all(listens=True, now_s=now_s)
            self.phase = Phase.CLOSING
        elif self.phase is Phase.CLOSING and self._all_done(now_s, listens=True):
            self._sum_up()
            self.phase = Phase.ENDED

    def _refuse(self, host: str, hello: Hello, sentence: str) -> None:
        self.words.append((host, pack("refused", hello.instance, sentence)))
        self.notices.append(f"refused: {sentence}")

    def _greet(self, host: str, known: _Host, hello: Hello, now_s: float) -> None:
        if known.instance != hello.instance or now_s - known.heard_s >= HERE_S:
            self.notices.append(f"{host} is here")
        known.instance, known.heard_s = hello.instance, now_s
        known.ready = hello.welcomed
        if not hello.welcomed:
            self.words.append((host, pack("welcome")))
            known.remembers_ms = hello.now_ms or 0
        elif self.phase is Phase.WAITING and hello.now_ms is not None:
            self.taken_up = True
            self.time.hear(hello.now_ms, self.factor, now_s)
            self._run(f"the mission is under way, at {hello.now_ms / 1000:.0f} s")
            for one in self._hosts.values():  # the others find this clock sooner or later, even if the mission is over
                one.awaited_until_s = now_s + COMES_BACK_S
        if known.last_word is None and self.phase in (FINISHED_LISTENING if self._listens[host] else FINISHED_ACTING):
            self.words.append((host, pack_finish(self._result)))

    def _run(self, notice: str) -> None:
        self.phase = Phase.RUNNING
        self.notices.append(notice)

    def _finish(self, ending: Ending, mission_ms: int, now_s: float) -> None:
        self._result = BusResult(ending, mission_ms)
        self._to_all(listens=False, now_s=now_s)
        self.phase = Phase.ENDING

    def _to_all(self, *, listens: bool, now_s: float) -> None:
        self._until_s = now_s + LAST_WORD_WITHIN_S
        self.words.extend((host, pack_finish(self._result)) for host in self._here(now_s, listens=listens))

    def _here(self, now_s: float, *, listens: bool) -> list[str]:
        return [
            host
            for host, known in self._hosts.items()
            if self._listens[host] is listens and (now_s - known.heard_s < HERE_S or now_s < known.awaited_until_s)
        ]

    def _all_done(self, now_s: float, *, listens: bool) -> bool:
        return now_s >= self._until_s or all(self.is_done(host) for host in self._here(now_s, listens=listens))

    def _sum_up(self) -> None:
        theirs = [known.last_word for known in self._hosts.values() if known.last_word is not None]
        self._result = result_of(self._result.ending, self._result.mission_ms, [*self._last_words_here, *theirs])


def result_of(ending: Ending, mission_ms: int, last_words: Iterable[LastWord]) -> BusResult:
    """The result of a run by the wall clock, from the last words of its hosts."""
    last = summed_up(last_words)
    return BusResult(ending, mission_ms, None, None, last.messages, last.dropped, last.latencies_ms)
