"""A small fleet of scripted nodes on real topics, and how to run it on either bus."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from comms.errors import FleetError, NodeError, Stop
from comms.keys import HostSpec, RunKeys
from comms.lockstep.access import access_rules
from comms.lockstep.events import Change, NodeEvent, timeline
from comms.lockstep.faults import NO_FAULTS, Faults
from comms.lockstep.host import ListenerHost, NodeHost
from comms.lockstep.hub import Hub
from comms.lockstep.local_bus import run_local
from comms.node import Listener, Node, Publication, Received, Step
from comms.result import BusResult
from comms.said.announcement import ClockMode, Grid, Role, RunInfo
from comms.said.messages import AgentState, ManeuverState, ManeuverStatus, MissionOver, Mode, Nav
from comms.said.routing import RosterNode, Routing
from comms.said.topics import MANEUVER_STATUS, MISSION_OVER, NAV, STATE
from comms.session import open_client, open_hub, put
from comms.words import pack

RUN_INFO = RunInfo(
    schema=1,
    scenario="toy",
    scenario_sha256="0" * 64,
    seed=1,
    mode=ClockMode.LOCKSTEP,
    area=(),
    grid=Grid(0, 0, 0, 5, 2, 2),
    rho=0.0,
    vehicles=(),
)
ROSTER = (
    RosterNode("clock", Role.CLOCK),
    RosterNode("world", Role.WORLD, ("alpha", "beta")),
    RosterNode("alpha", Role.SURVEY, ("alpha",)),
    RosterNode("beta", Role.REVISIT, ("beta",)),
    RosterNode("coordinator", Role.COORDINATOR),
    RosterNode("observer", Role.OBSERVER),
)


def with_modems(roster: tuple[RosterNode, ...]) -> tuple[RosterNode, ...]:
    """The same fleet with its coordinator on a ship, talking by modems."""
    agents = {one.node_id for one in roster if one.role.surveys or one.role.revisits}
    ship = {one.node_id: "ship" for one in roster if one.role is Role.COORDINATOR}
    on = {**{name: name for name in agents}, **ship}
    return (
        *(replace(one, platform=on.get(one.node_id, "")) for one in roster),
        *(RosterNode(f"modem-{name}", Role.MODEM, (name,), name) for name in sorted(agents)),
        RosterNode("modem-ship", Role.MODEM, (), "ship"),
    )


def nav(x_m: float = 0.0) -> Nav:
    """A position message that differs in x only."""
    return Nav(x_m, 0, 0, 1, 0, 0)


def state(mode: Mode = Mode.IDLE, works_on: int = 0) -> AgentState:
    """An agent's state."""
    return AgentState(mode, works_on, 1.0, 0, 0, 0, 0)


@dataclass
class Scripted:
    """A node that writes down all it is told and acts as its three functions say.

    `hears` may return None: nothing to publish, and the wake-up asked for before stays.
    """

    starts: Callable[[int], Step] = lambda now_ms: Step()
    hears: Callable[[Received, int], Step | None] = lambda received, now_ms: None
    wakes: Callable[[int], Step] = lambda now_ms: Step()
    log: list[tuple[object, ...]] = field(default_factory=list)
    wake_ms: int | None = None

    def start(self, now_ms: int) -> Step:
        self.log.append(("start", now_ms))
        return self._keep(self.starts(now_ms))

    def on_message(self, received: Received, now_ms: int) -> Step:
        header = received.header
        self.log.append((now_ms, received.key, header.sender, header.sequence, header.sent_ms))
        return self._keep(self.hears(received, now_ms) or Step(wake_ms=self.wake_ms))

    def on_wake(self, now_ms: int) -> Step:
        self.log.append(("wake", now_ms))
        return self._keep(self.wakes(now_ms))

    def _keep(self, step: Step) -> Step:
        self.wake_ms = step.wake_ms
        return step


@dataclass
class Notes:
    """A listener that writes down what it hears."""

    heard: list[Received] = field(default_factory=list)
    closed: int = 0

    def on_message(self, received: Received) -> None:
        self.heard.append(received)

    def close(self) -> None:
        self.closed += 1


def says(*publications: Publication, wake_ms: int | None = None) -> Step:
    """A step that publishes these."""
    return Step(publications, wake_ms)


def say_nav(vehicle: str, x_m: float = 0.0) -> Publication:
    """A vehicle's position, which wakes nobody."""
    return Publication(NAV.key(vehicle=vehicle), nav(x_m))


def say_status(vehicle: str, number: int = 0) -> Publication:
    """A vehicle's word on a manoeuvre."""
    status = ManeuverStatus(number, ManeuverState.ACCEPTED, 0, "")
    return Publication(MANEUVER_STATUS.key(vehicle=vehicle), status)


def say_state(vehicle: str, works_on: int = 0) -> Publication:
    """An agent's state."""
    return Publication(STATE.key(vehicle=vehicle), state(works_on=works_on))


def say_over() -> Publication:
    """The end of the mission."""
    return Publication(MISSION_OVER.key(), MissionOver("enough"))


Bus = Callable[..., BusResult]


def on_local(
    nodes: Mapping[str, Node],
    listener: Listener,
    *,
    time_limit_ms: int = 60_000,
    faults: Faults = NO_FAULTS,
    events: tuple[NodeEvent, ...] = (),
) -> BusResult:
    """Runs the toy fleet on the local bus; nodes left out do nothing.

    Whoever joins after it was killed is, as on every bus here, the node under its id with a dot and its incarnation.
    """
    all_nodes = filled(nodes)
    starts = {name: iter([all_nodes[name], nodes.get(f"{name}.1", all_nodes[name])]) for name in all_nodes}
    makers = {name: partial(next, starts[name]) for name in all_nodes}
    watchers = {"observer": listener}
    return run_local(Routing(ROSTER), makers, watchers, RUN_INFO, time_limit_ms, faults=faults, events=events)


def on_zenoh(
    nodes: Mapping[str, Node], listener: Listener, *, events: tuple[NodeEvent, ...] = (), **options: Any
) -> BusResult:
    """Runs the toy fleet over Zenoh on loopback: the world at the hub, each other node behind a session of its own."""
    return over_zenoh(nodes, listener, plans=plans_with(events, EACH_ALONE), events=events, **options)


def on_zenoh_grouped(
    nodes: Mapping[str, Node], listener: Listener, *, events: tuple[NodeEvent, ...] = (), **options: Any
) -> BusResult:
    """The same with coordinator and one agent behind one session, but for whom something is to happen to."""
    plans: tuple[HostSpec, ...] = (
        HostSpec("alpha", ("alpha",)),
        HostSpec("both", ("beta", "coordinator")),
        HostSpec("observer", ("observer",)),
    )
    if {event.node_id for event in events} & {"beta", "coordinator"}:
        plans = EACH_ALONE
    return over_zenoh(nodes, listener, plans=plans_with(events, plans), events=events, **options)


BUSES: dict[str, Bus] = {"local": on_local, "zenoh": on_zenoh, "zenoh-grouped": on_zenoh_grouped}
EACH_ALONE = tuple(HostSpec(name, (name,)) for name in ("alpha", "beta", "coordinator", "observer"))
KEYS = RunKeys("toy")


def plans_with(events: tuple[NodeEvent, ...], plans: tuple[HostSpec, ...]) -> tuple[HostSpec, ...]:
    """These plans with those for whoever joins later."""
    joins = [one for one in timeline(events, Routing(ROSTER)) if one.change is Change.JOIN]
    late = {one.node_id for one in joins if one.incarnation == 0}
    later = [
        HostSpec(f"{one.node_id}.1" if one.incarnation else one.node_id, (one.node_id,), one.incarnation, joins=True)
        for one in joins
    ]
    return (*(plan for plan in plans if late.isdisjoint(plan.nodes)), *later)


def password(host: str) -> str:
    """With which a host of the toy fleet connects."""
    return f"secret-{host}"


def over_zenoh(
    nodes: Mapping[str, Node],
    listener: Listener,
    *,
    plans: tuple[HostSpec, ...] = EACH_ALONE,
    absent: tuple[str, ...] = (),
    before: Callable[[str], None] = lambda endpoint: None,
    on_failure: Callable[[], None] = lambda: None,
    rules: bool = True,
    time_limit_ms: int = 60_000,
    faults: Faults = NO_FAULTS,
    **hub_options: Any,
) -> BusResult:
    """Runs the toy fleet over Zenoh, its hosts started in the order of `plans`, those `absent` left out.

    Without `rules` everyone who has a password may write and read everything.
    `before` is told the hub's endpoint before any host is started. `hub_options` go to `Hub`. When the hub fails,
    `on_failure` is called, and what is left of the fleet sent home, before its error goes on.
    """
    all_nodes = filled(nodes)
    routing = Routing(ROSTER)
    users = {plan.host: password(plan.host) for plan in plans}
    hub_session, endpoint = open_hub(users, access_rules(routing, plans, KEYS) if rules else None)

    def serve(plan: HostSpec) -> None:
        with (
            contextlib.suppress(NodeError, Stop),  # the hub is told of the one and notices the other
            open_client(endpoint, plan.host, password(plan.host)) as session,
        ):
            if plan.host == "observer":
                ListenerHost(session, KEYS, plan.host, "observer", listener, routing).run()
            else:
                its_nodes = {name: nodes.get(plan.host, all_nodes[name]) for name in plan.nodes}
                NodeHost(session, KEYS, plan, its_nodes, routing, faults).run()

    threads = {
        plan.host: threading.Thread(target=serve, args=(plan,), name=plan.host, daemon=True)
        for plan in plans
        if plan.host not in absent
    }
    killed: list[str] = []

    def carry_out(change: Change, host: str) -> None:
        if change is Change.JOIN:
            threads[host].start()
        elif change is Change.KILL:
            killed.append(host)  # a thread cannot be killed; it is sent home in the end

    def send_home(hosts: Iterable[str]) -> None:
        for host in hosts:
            put(hub_session, KEYS.to_host(host), pack("finish", 0, 0, {}))
            put(hub_session, KEYS.to_host(host), pack("goodbye"))

    with hub_session:
        before(endpoint)
        world = {"world": all_nodes["world"]}
        options = {"faults": faults, "carry_out": carry_out, **hub_options}
        hub = Hub(hub_session, KEYS, routing, plans, world, time_limit_ms, **options)
        for plan in plans:
            if plan.host in threads and not plan.joins:
                threads[plan.host].start()
        try:
            result = hub.run(RUN_INFO)
            send_home(killed)
            return result
        except FleetError:
            on_failure()
            send_home(threads)
            raise
        finally:
            for thread in threads.values():
                if thread.ident is not None:
                    thread.join(timeout=20)
                    assert not thread.is_alive(), f"{thread.name} has not ended"


def filled(nodes: Mapping[str, Node]) -> dict[str, Node]:
    """The nodes, and silent ones for those left out."""
    acting = [node.node_id for node in ROSTER if not node.listens_only and node.role is not Role.CLOCK]
    return {node_id: nodes.get(node_id, Scripted()) for node_id in acting}


def fleet_that_talks(until_ms: int = 20_000) -> dict[str, Scripted]:
    """A fleet in which everyone says something again and again, until the coordinator ends it."""

    def tick(now_ms: int) -> Step:
        positions = (say_nav("alpha", now_ms), say_nav("beta", -now_ms))
        return says(*positions, say_status("alpha", now_ms), say_status("beta"), wake_ms=now_ms + 700)

    return {
        "world": Scripted(starts=tick, wakes=tick),
        "alpha": Scripted(hears=lambda received, now_ms: says(say_state("alpha", now_ms))),
        "beta": Scripted(hears=lambda received, now_ms: says(say_state("beta", 1), say_state("beta", 2))),
        "coordinator": Scripted(starts=lambda now_ms: Step(wake_ms=until_ms), wakes=lambda now_ms: says(say_over())),
    }
