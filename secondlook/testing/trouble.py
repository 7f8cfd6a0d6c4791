"""What is to go wrong in a mission on purpose, and when: nodes killed, frozen, let in late; words lost, late, corrupt;
modems that fall silent and frames that are lost on the water.

The same trouble strikes alike in every flight and on every bus. Times are simulated seconds.
"""

from __future__ import annotations

import math
from numbers import Real

from comms.lockstep.events import Freeze, Join, Kill, NodeEvent, absent_at_start, timeline
from comms.lockstep.faults import STRUCK, CutOff, FaultKind, Faults, MessageFault
from comms.said.announcement import Role
from comms.said.messages import FARTHEST_M
from comms.said.routing import Routing
from secondlook.errors import UserError
from secondlook.recorded.mission import chosen_keys
from sim_world.channel_config import Outage

LARGEST_FAULT_SEED = 2**63 - 1


class Trouble:
    """Schedules trouble for the fleet that `routing` describes; `seed` decides where what has a probability strikes.

    Where no time is given, trouble begins now: at the moment at which `Fleet.run_until` has ended, or at the mission's
    start. Before that moment nothing can be changed any more. UserError tells, in one sentence, what is not allowed.

    `held`: in words what is to strike, and from when on in milliseconds, of all trouble that a mission must not be over
    before: that which plans have scheduled is left out, as what a storm draws may lie after the end.
    """

    def __init__(self, routing: Routing, seed: int) -> None:
        self.routing = routing
        self.events: tuple[NodeEvent, ...] = ()
        self.disk_full_ms: int | None = None
        self.outages: tuple[Outage, ...] = ()
        self.held: list[tuple[str, int]] = []
        self._seed = seed
        self._message_faults: list[MessageFault] = []
        self._cut_offs: list[CutOff] = []
        self._from_ms = 0

    @property
    def faults(self) -> Faults:
        """All faults on messages that are scheduled."""
        return Faults(self._seed, self._message_faults, self._cut_offs)

    def kill(self, node: str, *, at_s: float | None = None) -> None:
        """The node, a vehicle's id or `coordinator`, is gone from then on; over Zenoh its process gets SIGKILL."""
        self._plan(Kill(node, self._event_ms(at_s)))

    def freeze(self, node: str, *, for_s: float, at_s: float | None = None) -> None:
        """The node does nothing for a while and then finds its mail waiting; over Zenoh its process is stopped."""
        at_ms = self._event_ms(at_s)
        self._plan(Freeze(node, at_ms, at_ms + _span_ms("for_s", for_s)))

    def join(self, node: str, *, at_s: float | None = None, memory: bool = False) -> None:
        """A node that was killed comes back, started anew or, with its memory, as it was; one that was not has been
        absent until then."""
        join = Join(node, self._event_ms(at_s), memory)
        if self._from_ms > 0 and node in absent_at_start([*self.events, join]) - absent_at_start(self.events):
            raise UserError(f"join: {node!r} is not allowed; must be killed before, or be let in late from the start")
        self._plan(join)

    def disk_full(self, *, at_s: float | None = None) -> None:
        """From then on no file can be written, the test's own included, until the mission has failed: with
        RunFailedError, which names a file, at the latest when it ends. On the local bus alone."""
        self.disk_full_ms = self._event_ms(at_s)
        self.held.append(("disk_full at", self.disk_full_ms))

    def cut_off(self, vehicle: str, *, for_s: float, from_s: float | None = None) -> None:
        """For a while nothing crosses the water from the vehicle's agent or to it. Agent and vehicle go on talking."""
        vehicles = self._vehicles()
        if vehicle not in vehicles:
            raise UserError(f"cut_off: {vehicle!r} is not allowed; must be one of {', '.join(vehicles)}")
        from_ms = self._time_ms("from_s", from_s)
        self._cut_offs.append(CutOff(vehicle, from_ms, from_ms + _span_ms("for_s", for_s)))
        self.held.append((f"cut_off of {vehicle} from", from_ms))

    def blackout(self, platform: str | None = None, *, for_s: float, from_s: float | None = None) -> None:
        """The modem of a platform, a vehicle or the ship, neither sends nor hears for a while; left out, no modem does.
        As the two faults that follow it needs a fleet with a `link`, and strikes what is sent or heard in that time."""
        self._silence("blackout", from_s, for_s, platform=platform)

    def range_cut(self, to_m: float, *, for_s: float, from_s: float | None = None) -> None:
        """For a while modems hear nothing from `to_m` away or farther."""
        if not isinstance(to_m, Real) or not 1 <= to_m <= FARTHEST_M:
            raise UserError(f"range_cut: to_m: {to_m!r} is not allowed; must be from 1 to {FARTHEST_M:.0f} m")
        self._silence("range_cut", from_s, for_s, beyond_m=to_m)

    def jammed(self, *, for_s: float, from_s: float | None = None, loss: float = 1.0) -> None:
        """For a while a share of all frames is lost; which, if that is not all, the scenario's seed decides."""
        if not isinstance(loss, Real) or not 0 < loss <= 1:
            raise UserError(f"jammed: loss: {loss!r} is not allowed; must be above 0, and at most 1")
        self._silence("jammed", from_s, for_s, loss=loss)

    def drop(
        self, keys: str, *, probability: float = 1.0, to: str = "", from_s: float | None = None, for_s: float = math.inf
    ) -> None:
        """Messages whose keys are like `keys`, `agent/*/coverage/*` say, are lost: `*` is one chunk of a key, `**` any
        number of chunks, `$*` any characters within one. What the clock says of the run is never struck.

        `probability`: for each message and reader by itself. `to`: the only reader concerned, by its node id; all if
        left out. What is sent from `from_s` on, for `for_s`, is concerned. So it is with the faults that follow.
        """
        self._strike(FaultKind.DROP, keys, probability, to, from_s, for_s)

    def repeat(
        self,
        keys: str,
        *,
        after_s: float = 1.0,
        probability: float = 1.0,
        to: str = "",
        from_s: float | None = None,
        for_s: float = math.inf,
    ) -> None:
        """Messages are delivered a second time, `after_s` later."""
        self._strike(FaultKind.REPEAT, keys, probability, to, from_s, for_s, _span_ms("after_s", after_s))

    def delay(
        self,
        keys: str,
        *,
        by_s: float,
        probability: float = 1.0,
        to: str = "",
        from_s: float | None = None,
        for_s: float = math.inf,
    ) -> None:
        """Messages are delivered `by_s` later."""
        self._strike(FaultKind.DELAY, keys, probability, to, from_s, for_s, _span_ms("by_s", by_s))

    def reorder(
        self,
        keys: str,
        *,
        within_s: float = 1.0,
        probability: float = 1.0,
        to: str = "",
        from_s: float | None = None,
        for_s: float = math.inf,
    ) -> None:
        """Messages are delivered later by anything up to `within_s`, so that others overtake them."""
        self._strike(FaultKind.REORDER, keys, probability, to, from_s, for_s, _span_ms("within_s", within_s))

    def corrupt(
        self, keys: str, *, probability: float = 1.0, to: str = "", from_s: float | None = None, for_s: float = math.inf
    ) -> None:
        """Messages arrive with one byte changed."""
        self._strike(FaultKind.CORRUPT, keys, probability, to, from_s, for_s)

    def _silence(
        self,
        what: str,
        from_s: float | None,
        for_s: float,
        *,
        platform: str | None = None,
        beyond_m: float = 0.0,
        loss: float = 1.0,
    ) -> None:
        platforms = [node.platform for node in self.routing.roster if node.role is Role.MODEM]
        if not platforms:
            raise UserError(f"{what}: not allowed without link in the scenario, as there are no modems")
        if platform not in (None, *platforms):
            raise UserError(f"{what}: {platform!r} is not allowed; must be one of {', '.join(platforms)}, or left out")
        from_ms = self._time_ms("from_s", from_s)
        until_ms = from_ms + _span_ms("for_s", for_s)
        self.outages = (*self.outages, Outage(from_ms, until_ms, platform, beyond_m=beyond_m, loss=loss))
        self.held.append((f"{what} from" if platform is None else f"{what} of {platform} from", from_ms))

    def _strike(
        self,
        kind: FaultKind,
        keys: str,
        probability: float,
        to: str,
        from_s: float | None,
        for_s: float,
        delay_ms: int = 1,
    ) -> None:
        chosen_keys(keys, self._vehicles(), STRUCK)
        readers = [one.node_id for one in self.routing.roster if not one.listens_only and one.role.value != "clock"]
        if to and to not in readers:
            raise UserError(f"{kind.value}: to: {to!r} is not allowed; must be one of {', '.join(readers)}")
        if not isinstance(probability, Real) or not 0 <= probability <= 1:
            raise UserError(f"{kind.value}: probability: {probability!r} is not allowed; must be from 0 to 1")
        from_ms = self._time_ms("from_s", from_s)
        until_ms = None if for_s == math.inf else from_ms + _span_ms("for_s", for_s)
        self._message_faults.append(MessageFault(kind, keys, probability, to, from_ms, until_ms, delay_ms))
        self.held.append((f"{kind.value} of {keys} from", from_ms))

    def _plan(self, event: NodeEvent) -> None:
        events = (*self.events, event)
        try:
            timeline(events, self.routing)
        except ValueError as error:
            raise UserError(str(error)) from error
        self.events = events
        self.held.append((f"{type(event).__name__.lower()} of {event.node_id} at", event.at_ms))

    def _event_ms(self, at_s: float | None) -> int:
        return max(1, self._time_ms("at_s", at_s))

    def _time_ms(self, name: str, time_s: float | None) -> int:
        if time_s is None:
            return self._from_ms
        if not isinstance(time_s, Real) or not 0 <= time_s < math.inf:
            raise UserError(f"{name}: {time_s!r} is not allowed; must be simulated seconds since the mission's start")
        time_ms = round(time_s * 1000)
        if time_ms < self._from_ms:
            now_s = (self._from_ms - 1) / 1000
            raise UserError(f"{name}: {time_s} is not allowed; must be after now, which is {now_s:g} s of the mission")
        return time_ms

    def _vehicles(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(vehicle for node in self.routing.roster for vehicle in node.vehicles))


def _span_ms(name: str, span_s: float) -> int:
    if not isinstance(span_s, Real) or not 0.001 <= span_s < math.inf:
        raise UserError(f"{name}: {span_s!r} is not allowed; must be at least 0.001 simulated seconds")
    return round(span_s * 1000)
