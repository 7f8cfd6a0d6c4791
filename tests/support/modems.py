"""Modems that are told by hand what their platforms say, and water that carries their packets as a test wants it."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import Any, Literal

from fleets import ROSTER, state, with_modems

from comms.node import Received, Step
from comms.runner import Intake, Stamp
from comms.said.announcement import ClockMode, Grid, Role, RosterVehicle, RunInfo, Vertex
from comms.said.codec import Header, body_of, packed
from comms.said.messages import AgentState, Heard, Packet
from comms.said.routing import Routing
from comms.said.topics import HEARD, MODEM_RX, MODEM_TX, RUN
from modem.config import ModemConfig, PollTimes
from modem.modem import Modem
from modem.presence import REPORT_MS

SIDE_M = 400.0
RUN_INFO = RunInfo(
    schema=1,
    scenario="toy",
    scenario_sha256="0" * 64,
    seed=1,
    mode=ClockMode.LOCKSTEP,
    area=(Vertex(0, 0), Vertex(SIDE_M, 0), Vertex(SIDE_M, SIDE_M), Vertex(0, SIDE_M)),
    grid=Grid(0, 0, 0, 5, 80, 80),
    rho=0.0,
    vehicles=(
        RosterVehicle("alpha", Role.SURVEY, 1.5, 20, 30, 40, 145, 0.4, 10_000_000),
        RosterVehicle("beta", Role.REVISIT, 2.0, 6, 10, 0, 25, 0.7, 10_000_000),
    ),
)
PLATFORMS = ("ship", "alpha", "beta")


def config_of(
    platform: str,
    *,
    frame_bits: int = 256,
    frames: int = 1,
    slot_ms: int = 4000,
    polls: PollTimes | None = None,
    deck_ms: int = 0,
    answer_ms: int = 10**9,
    by_age: bool = False,
    maps: Literal["stretches", "corrected", "tiles"] = "stretches",
) -> ModemConfig:
    """A modem's configuration in a fleet of alpha and beta with a ship."""
    return ModemConfig(
        platform,
        PLATFORMS,
        PLATFORMS[1:],
        frame_bits,
        frames,
        slot_ms,
        100,
        (-500.0, -500.0),
        (900.0, 900.0),
        polls,
        deck_ms,
        answer_ms,
        by_age,
        maps,
    )


class Waters:
    """Three modems. `arrives(platform, to, count)`: whether a platform's packet of that count, from 0, reaches another;
    `way_ms`: how long it takes; `reports`: agents tell the last state they were made to say again every 10 s."""

    def __init__(
        self,
        arrives: Callable[[str, str, int], bool] = lambda *_: True,
        way_ms: int = 3500,
        reports: bool = False,
        **terms: Any,
    ) -> None:
        self.routing = Routing(with_modems(ROSTER))
        self.now_ms = 0
        self.modems: dict[str, Modem] = {}
        self.heard: list[tuple[int, str, Received]] = []
        self.packets: list[tuple[int, str, Packet]] = []
        self._arrives, self._way_ms, self._terms = arrives, way_ms, terms
        self._stamps: dict[str, Stamp] = {}
        self._wakes: dict[str, int | None] = {}
        self._intake = Intake(self.routing)
        self._reports = reports
        self._states: dict[str, tuple[str, AgentState]] = {}
        self._on_the_way: list[tuple[int, int, str, Packet]] = []
        for platform in PLATFORMS:
            self.start(platform)

    def start(self, platform: str) -> None:
        """Starts a modem, anew if there was one."""
        self.modems[platform] = Modem(config_of(platform, **self._terms))
        self._note(platform, self.modems[platform].start(self.now_ms))
        self._stamps.setdefault("clock", Stamp("clock", self.routing))
        self._tell(platform, "clock", RUN.key(), RUN_INFO)

    def say(self, sender: str, key: str, message: Any) -> Step:
        """A node says something on its platform now; returns what its modem does."""
        platform = self.routing.nodes[sender].platform or self.routing.route(key).vehicle  # type: ignore[union-attr]
        if isinstance(message, AgentState):
            self._states[sender] = key, message
        return self._tell(platform, sender, key, message)

    def run(self, until_ms: int) -> None:
        """Lets time pass."""
        while self._reports and self._states and self.now_ms + REPORT_MS < until_ms:
            self._run(self.now_ms + REPORT_MS)
            for sender, (key, message) in self._states.items():
                self.say(sender, key, message)
        self._run(until_ms)

    def _run(self, until_ms: int) -> None:
        while True:
            arrival_ms = self._on_the_way[0][0] if self._on_the_way else until_ms + 1
            wakes = [(ms, name) for name, ms in self._wakes.items() if ms is not None]
            wake_ms, name = min(wakes, default=(until_ms + 1, ""))
            if min(arrival_ms, wake_ms) > until_ms:
                break
            self.now_ms = min(arrival_ms, wake_ms)
            if arrival_ms <= wake_ms:
                _, _, to, packet = heapq.heappop(self._on_the_way)
                self._tell(to, "world", MODEM_RX.key(vehicle=to), packet)
            else:
                self._note(name, self.modems[name].on_wake(self.now_ms))
        self.now_ms = until_ms

    def _tell(self, platform: str, sender: str, key: str, message: Any) -> Step:
        stamp = self._stamps.setdefault(sender, Stamp(sender, self.routing))
        received = stamp(key, message, self.now_ms).opened()
        step = self.modems[platform].on_message(received, self.now_ms)
        self._note(platform, step)
        return step

    def _note(self, platform: str, step: Any) -> None:
        self._wakes[platform] = step.wake_ms
        for key, message in step.publish:
            if isinstance(message, Packet):
                assert key == MODEM_TX.key(vehicle=platform)
                count = sum(one == platform for _, one, _ in self.packets)
                self.packets.append((self.now_ms, platform, message))
                for to in PLATFORMS:
                    if to != platform and self._arrives(platform, to, count):
                        place = len(self.packets) * len(PLATFORMS) + PLATFORMS.index(to)
                        heapq.heappush(self._on_the_way, (self.now_ms + self._way_ms, place, to, message))
            else:
                assert isinstance(message, Heard)
                assert key == HEARD.key(vehicle=platform)
                opened = self._intake.open(message.key, message.payload)
                assert opened is not None
                self.heard.append((self.now_ms, platform, opened))


def said(sender: str, key: str, message: Any, at_ms: int) -> Received:
    """What one of a fleet with modems says."""
    return Stamp(sender, Routing(with_modems(ROSTER)))(key, message, at_ms).opened()


def state_heard(sent_ms: int, at_ms: int) -> Received:
    """What the ship's modem tells of a state of beta's."""
    payload = packed(Header("beta", 0, 0, sent_ms), body_of(state()))
    return said("modem-ship", "modem/ship/heard", Heard("agent/beta/state", payload), at_ms)
