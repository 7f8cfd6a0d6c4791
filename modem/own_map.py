"""What a vehicle's modem tells of the vehicle's own map: what was looked along, stretch by stretch, and where a packet
has room how far what stretches tell is off.
"""

from __future__ import annotations

from comms.said.announcement import RosterVehicle
from comms.said.messages import AgentState, CoverageTile, Curve, Look, TaskState, TaskStatus
from comms.said.wire import WireError
from modem.config import ModemConfig
from modem.correcting import Correcting
from modem.corrections import Correction
from modem.letters import Letters
from modem.stretches import Gathering, Stretch
from planner.types import GridSpec


class OwnMap:
    """Hears what the vehicle sees. What it returns is to be said, and counts as said from then on.

    `entry`: the vehicle as it was announced; `start`: of its modem. `by_strips`: whether the strips that it has done
    tell by themselves what was seen of them.
    """

    def __init__(
        self,
        config: ModemConfig,
        entry: RosterVehicle,
        grid: GridSpec,
        letters: Letters,
        start: int,
        *,
        by_strips: bool,
    ) -> None:
        self._gathering = Gathering(entry, start)
        # Who was started anew does not know what of its map is told.
        self._correcting = None if start or not config.corrects else Correcting(entry, grid)
        self._letters = letters
        self._by_strips = by_strips
        self._looked_ms = 0
        self._held: list[Stretch] = []  # of the strip under way, which may be done yet
        self._held_of = 0  # and its number

    def begin_anew(self) -> None:
        """Its vehicle was started anew, and knows of no looks before that: how far off they are told is not known."""
        self._correcting = None

    def hear_look(self, look: Look, now_ms: int) -> list[Stretch]:
        """The vehicle has looked."""
        ended = self._due(self._gathering.add(look), now_ms)
        self._looked_ms = now_ms
        return ended

    def hear_curve(self, curve: Curve, now_ms: int) -> list[Stretch]:
        """Its P(y), which is said behind the stretch that ends with it."""
        ended = self._due(self._gathering.hear_curve(curve), now_ms)
        self._note_said(curve, now_ms)
        return ended

    def hear_tile(self, tile: CoverageTile, now_ms: int) -> None:
        """A tile of its map as it is."""
        if self._correcting is not None:
            self._correcting.hear_tile(tile, now_ms)

    def hear_state(self, state: AgentState) -> None:
        """Its vehicle tells at which strip it is: a modem that was started anew since has heard no word of that."""
        if self._by_strips and state.works_on and not self._held_of:
            self._held_of = state.works_on

    def hear_status(self, status: TaskStatus, now_ms: int) -> list[Stretch]:
        """What was seen of the strip under way is said where that ends and is not done."""
        if status.state in (TaskState.ACCEPTED, TaskState.UNDER_WAY):
            self._held_of = status.strip
        elif status.strip == self._held_of:
            held, self._held = self._held, []
            if status.state is not TaskState.DONE:
                return [self._said(one, now_ms) for one in held]
        return []

    def flush(self, now_ms: int) -> list[Stretch]:
        """The stretch so far, if there is one."""
        return self._due(self._gathering.flush(), now_ms)

    def next_correction(self, now_ms: int) -> Correction | None:
        """What is best told of how far it is off; None where all is right, or none is asked for."""
        return None if self._correcting is None else self._correcting.next(now_ms)

    def _due(self, stretch: Stretch | None, now_ms: int) -> list[Stretch]:
        if stretch is not None and self._by_strips:
            self._held.append(stretch)
            return []
        return [] if stretch is None else [self._said(stretch, now_ms)]

    def _said(self, stretch: Stretch, now_ms: int) -> Stretch:
        self._note_said(stretch, now_ms)
        return stretch

    def _note_said(self, piece: Curve | Stretch, now_ms: int) -> None:
        """What is told of the map, as rounded as it crosses."""
        if self._correcting is None:
            return
        try:
            crossing = self._letters.as_it_crosses(piece, now_ms)
        except WireError:
            return  # nor will it be said
        if isinstance(crossing, Stretch):
            self._correcting.hear_stretch(crossing, self._looked_ms)
        else:
            self._correcting.hear_curve(crossing)
