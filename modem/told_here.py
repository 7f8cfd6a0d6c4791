"""What has come through the water, as it is told to the nodes of the platform: states in the order in which they were
said, reckoned on where none has come, and of maps the tiles that they have become.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from comms.node import Publication
from comms.said.codec import LARGEST_INCARNATION, Header, body_of, packed
from comms.said.messages import AgentState, Curve, Heard, TaskState, TaskStatus
from comms.said.topics import COVERAGE, HEARD, STATE, Topic
from modem.config import ModemConfig
from modem.corrections import Correction
from modem.layers import Layers
from modem.letters import Said
from modem.plain_tiles import PlainTile, told
from modem.presence import REPORT_MS, Presence
from modem.stretches import Stretch, Told
from planner.types import GridSpec

MOST_BESIDE, MOST_STARTS = 1024, 8
"""So many starts of a vehicle are told apart by each of so many of the coordinator's modem."""


class ToldHere:
    """`start`: of the modem. `presences`: by vehicle, what it is taken to do; what comes of it is noted there."""

    def __init__(
        self, config: ModemConfig, layers: Layers, grid: GridSpec, start: int, presences: Mapping[str, Presence]
    ) -> None:
        self._config, self._layers, self._grid, self._start = config, layers, grid, start
        self._presences = presences
        self._waiting: list[Publication] = []
        self._tiles = 0  # that were told
        self._state_headers: dict[str, Header] = {}  # of the last states told
        self._state_told_ms: dict[str, int] = {}  # and when that was
        self._newest: dict[str, tuple[int, int]] = {}  # of states and words on tasks that told

    def take(self) -> list[Publication]:
        """What is to be said here since it was asked last."""
        waiting, self._waiting = self._waiting, []
        return waiting

    def say(self, key: str, header: Header, message: Any) -> None:
        """A message as it was said."""
        heard = Heard(key, packed(header, body_of(message)))
        self._waiting.append(Publication(HEARD.key(vehicle=self._config.platform), heard))

    def hear(self, platform: str, topic: Topic | None, said: Said, now_ms: int) -> None:
        """What a platform has said. `topic`: None for a piece of a map."""
        header, message = said.header, said.message
        if isinstance(message, AgentState):
            if self._is_overtaken(platform, header):
                return  # another has overtaken it, or its word on a task, which tells what it does since
            self._newest[platform] = header.newness
            header = self._in_order(platform, header, now_ms)
            self._presences[platform].hear_state(message, header.incarnation, said.header.sent_ms)
        elif isinstance(message, TaskStatus):
            is_old = self._is_overtaken(platform, header)  # where it had to be said again
            tells = not is_old and self._presences[platform].hear_status(message, said.header.sent_ms)
            strip = self._presences[platform].strips.get(message.strip) if message.state is TaskState.DONE else None
            if tells:
                self._newest[platform] = header.newness
            # The map is told before the word.
            self._say_tiles(platform, header, self._layers.hear_done(platform, header.incarnation, strip))
        if topic is not None:
            self.say(said.key, header, message)
        if isinstance(message, PlainTile):
            self._say_tiles(platform, header, [told(message, self._grid, header.sequence)])
        elif isinstance(message, Curve | Stretch | Correction) and platform != self._config.hub:
            self._say_tiles(platform, header, self._layers.hear(platform, header.incarnation, message))

    def reckon(self, platform: str, now_ms: int) -> None:
        """Who is heard is there: its state as it is by now, where it was not told for a while.

        It is newer than what has come, and no newer than what was said meanwhile and may still come.
        """
        before = self._state_headers.get(platform)
        if before is None or now_ms - self._state_told_ms[platform] < REPORT_MS:
            return
        state = self._presences[platform].at(now_ms)
        header = before._replace(sequence=self._newest.get(platform, before.newness)[1] + 1, sent_ms=now_ms)
        self.say(STATE.key(vehicle=platform), self._in_order(platform, header, now_ms), state)

    def _say_tiles(self, platform: str, header: Header, tiles: Iterable[Told]) -> None:
        header = header._replace(incarnation=layer_start(header.incarnation, self._start))
        for name, tile in tiles:
            self._tiles += 1
            self.say(COVERAGE.key(vehicle=platform, tile=name), header._replace(sequence=self._tiles), tile)

    def _is_overtaken(self, platform: str, header: Header) -> bool:
        """Whether a vehicle has told newer things of itself or its work, which have come. Small frames keep the
        order."""
        return not self._config.is_small and header.newness < self._newest.get(platform, header.newness)

    def _in_order(self, platform: str, header: Header, now_ms: int) -> Header:
        """A state's header as it is told here: one that was reckoned before does not make it an old one."""
        before = self._state_headers.get(platform, header)
        if header.incarnation == before.incarnation:
            sequence = header.sequence if before is header else max(header.sequence, before.sequence + 1)
            header = header._replace(sequence=sequence, sent_ms=max(header.sent_ms, before.sent_ms))
        if header.incarnation >= before.incarnation:
            self._state_headers[platform], self._state_told_ms[platform] = header, now_ms
        return header


def layer_start(incarnation: int, start: int) -> int:
    """Under which of a vehicle's starts a layer is told that is put together by a start of the coordinator's modem.

    One that was started anew knows nothing of what it has told before: what it tells from then on counts beside that,
    as that of a vehicle that was started anew does.
    """
    if start == 0:
        return incarnation
    return LARGEST_INCARNATION - (MOST_BESIDE - incarnation % MOST_BESIDE) * MOST_STARTS + start
