"""Who may write and read what at the hub: the rules against the routing, and real sessions against real rules."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import msgpack
import pytest
import zenoh
from fleets import EACH_ALONE, KEYS, ROSTER, Notes, fleet_that_talks, nav, on_local, over_zenoh, password, state
from hypothesis import given
from hypothesis import strategies as st

from comms.errors import ConnectionFailedError, FleetError
from comms.keys import HostSpec, RunKeys
from comms.lockstep.access import access_rules
from comms.node import Step
from comms.said.announcement import Role
from comms.said.codec import Header, encode
from comms.said.messages import Maneuver, ManeuverKind, Task, TaskAction, TruthPose
from comms.said.routing import RosterNode, Routing
from comms.said.topics import TOPICS
from comms.session import open_client, open_hub, put, subscribe
from comms.words import pack

routing = Routing((*ROSTER, RosterNode("recorder", Role.RECORDER)))
ALONE = (*EACH_ALONE, HostSpec("recorder", ("recorder",)))
HOSTED = tuple(plan.host for plan in ALONE)
TOPIC_KEYS = sorted(
    {topic.key(vehicle=vehicle, number=7, tile="0-1") for topic in TOPICS for vehicle in ("alpha", "beta", "gamma")}
)

PARCEL_KEYS = [
    KEYS.parcel(some, sender).removeprefix(KEYS.root)
    for some in routing.audiences
    for sender in ("alpha", "coordinator", "gamma", "world")
]


def allowed(rules: dict[str, Any], host: str, flow: str, message: str, key: str) -> bool:
    """What Zenoh makes of the rules."""
    (subject,) = [one["id"] for one in rules["subjects"] if host in one["usernames"]]
    names = {rule for policy in rules["policies"] if subject in policy["subjects"] for rule in policy["rules"]}
    return any(
        rule["id"] in names
        and flow in rule["flows"]
        and message in rule["messages"]
        and any(zenoh.KeyExpr(one).includes(zenoh.KeyExpr(key)) for one in rule["key_exprs"])
        for rule in rules["rules"]
    )


def may_write(plan: HostSpec, key: str) -> bool:
    """What the routing lets the nodes of a host write, for those that only listen in parcels, and the clock's part."""
    if key.startswith("parcel/"):
        return key.rpartition("/")[2] in plan.nodes
    route = routing.route(key)
    return key == f"clock/from/{plan.host}" or (route is not None and route.writer in plan.nodes)


def may_read(plan: HostSpec, key: str) -> bool:
    """What the routing lets the nodes of a host read, those that only listen in parcels, and the clock's part."""
    if key.startswith("parcel/"):
        return not set(key.split("/")[1].split("+")).isdisjoint(plan.nodes)
    route = routing.route(key)
    readers = () if route is None else route.readers
    return key == f"clock/to/{plan.host}" or any(node in readers for node in plan.nodes)


@st.composite
def groupings(draw: st.DrawFn) -> tuple[HostSpec, ...]:
    """The three nodes that act, world apart, spread over up to three hosts and the hub's own; and those that listen."""
    places: dict[int, list[str]] = {}
    for node in ("alpha", "beta", "coordinator"):
        places.setdefault(draw(st.integers(0, 3)), []).append(node)
    places.pop(0, None)
    return (*(HostSpec(f"host{place}", tuple(nodes)) for place, nodes in places.items()), *ALONE[-2:])


@given(groupings())
def test_the_rules_of_any_grouping_allow_what_the_routing_says_and_nothing_more(plans: tuple[HostSpec, ...]) -> None:
    rules = access_rules(routing, plans, KEYS)
    assert (rules["enabled"], rules["default_permission"]) == (True, "deny")
    assert {rule["permission"] for rule in rules["rules"]} == {"allow"}
    assert {(flow, one) for rule in rules["rules"] for flow in rule["flows"] for one in rule["messages"]} == {
        ("ingress", "put"),
        ("egress", "put"),
        ("ingress", "declare_subscriber"),
        ("ingress", "liveliness_token"),
    }
    hosts = [plan.host for plan in plans]
    clock_keys = [f"clock/{way}/{host}" for way in ("to", "from", "alive") for host in (*hosts, "world")]
    for plan in plans:
        for key in (*(key for key in TOPIC_KEYS if routing.route(key)), *PARCEL_KEYS, *clock_keys):
            full = KEYS.topic(key)
            assert allowed(rules, plan.host, "ingress", "put", full) == may_write(plan, key)
            assert allowed(rules, plan.host, "egress", "put", full) == may_read(plan, key)
            assert allowed(rules, plan.host, "ingress", "declare_subscriber", full) == may_read(plan, key)
            assert allowed(rules, plan.host, "ingress", "liveliness_token", full) == (key == f"clock/alive/{plan.host}")
            for flow, message in (("ingress", "put"), ("egress", "put")):
                assert not allowed(rules, plan.host, flow, message, RunKeys("other").topic(key))


class Guarded:
    """A hub with the rules of the toy fleet, each host by itself, and the sessions that are opened at it."""

    def __init__(self, sessions: ExitStack) -> None:
        self._sessions = sessions
        users = {plan.host: password(plan.host) for plan in ALONE}
        self.hub, self.endpoint = open_hub(users, access_rules(routing, ALONE, KEYS))
        sessions.enter_context(self.hub)

    def client(self, user: str) -> zenoh.Session:
        """A session with the user's true password."""
        return self._sessions.enter_context(open_client(self.endpoint, user, password(user), connect_timeout_s=5.0))


@pytest.fixture
def guarded() -> Iterator[Guarded]:
    with ExitStack() as sessions:
        yield Guarded(sessions)


END = b"end"


class Ears:
    """Subscriptions that note the keys they hear, below the run id, each as often as it is heard."""

    def __init__(self, session: zenoh.Session, expressions: list[str]) -> None:
        self.heard: list[str] = []
        self._ended = False
        self._news = threading.Condition()
        self._subscribers = [one for each in expressions for one in subscribe(session, [each], self._note)]

    def _note(self, key: str, payload: bytes) -> None:
        with self._news:
            self.heard.append(key.removeprefix(KEYS.root))
            self._ended |= payload == END
            self._news.notify_all()

    def wait_for(self, key: str, timeout_s: float = 5.0) -> bool:
        """Whether the key is heard in time."""
        with self._news:
            return self._news.wait_for(lambda: key in self.heard, timeout_s)

    def wait_for_end(self, timeout_s: float = 5.0) -> bool:
        """Whether a payload that says END is heard in time."""
        with self._news:
            return self._news.wait_for(lambda: self._ended, timeout_s)


WILD_KEYS = ["**", "agent/**", "agent/*/state", "*/alpha/**", "world/truth/**", "clock/**", "clock/from/*", "parcel/**"]
CLOCK_KEYS = [f"clock/{way}/{host}" for way in ("to", "from", "alive") for host in (*HOSTED, "world")]


@pytest.mark.parametrize("plan", ALONE, ids=lambda plan: plan.host)
def test_the_hub_lets_a_host_write_its_own_keys_alone(guarded: Guarded, plan: HostSpec) -> None:
    ears = Ears(guarded.hub, ["**"])
    client = guarded.client(plan.host)
    last = f"clock/from/{plan.host}"
    keys = [key for key in (*TOPIC_KEYS, *PARCEL_KEYS, *CLOCK_KEYS) if key != last]
    for key in (*WILD_KEYS, *keys):
        put(client, KEYS.topic(key), b"x")
        client.delete(KEYS.topic(key))
    put(client, KEYS.topic(last), b"x")
    assert ears.wait_for(last)  # what was let through before has arrived before
    gammas = {"coord/task/gamma/7"} if plan.host == "coordinator" else set()
    assert sorted(ears.heard) == sorted({key for key in keys if may_write(plan, key)} | gammas | {last})


@pytest.mark.parametrize("plan", ALONE, ids=lambda plan: plan.host)
def test_the_hub_tells_a_host_what_it_may_read_alone(guarded: Guarded, plan: HostSpec) -> None:
    keys = [key for key in TOPIC_KEYS if routing.route(key)] + PARCEL_KEYS + CLOCK_KEYS
    last = f"clock/to/{plan.host}"
    client = guarded.client(plan.host)
    # Every key by itself, so that one refused subscription does not hide the others; `last` is declared last.
    one_by_one = [KEYS.topic(key) for key in keys if key != last]
    ears = Ears(client, [*(KEYS.topic(key) for key in WILD_KEYS), *one_by_one, KEYS.topic(last)])
    while not ears.wait_for(last, 0.05):
        put(guarded.hub, KEYS.topic(last), b"x")
    ears.heard.clear()
    for key in keys:
        if key != last:
            put(guarded.hub, KEYS.topic(key), b"x")
    put(guarded.hub, KEYS.topic(last), END)
    assert ears.wait_for_end()  # not just for the key, which may still come from above
    assert set(ears.heard) == {key for key in keys if may_read(plan, key)}


def test_an_agent_gets_no_answer_to_a_question(guarded: Guarded) -> None:
    def answer(query: zenoh.Query) -> None:
        query.reply(query.key_expr, b"the truth")

    truth = KEYS.topic("world/truth/targets")
    with guarded.hub.declare_queryable(KEYS.topic("**"), answer):
        assert [reply.ok is not None for reply in guarded.hub.get(truth)] == [True]
        agent = guarded.client("alpha")
        for selector in (truth, KEYS.topic("world/truth/**"), KEYS.topic("**"), KEYS.topic("agent/alpha/state")):
            assert list(agent.get(selector, timeout=5.0)) == []
        told = [str(reply.ok.key_expr) for reply in agent.get("@/**", timeout=5.0) if reply.ok is not None]
        assert not any(str(guarded.hub.info.zid()) in key.split("/")[1] for key in told)


def test_a_host_can_stand_in_for_its_own_life_alone(guarded: Guarded) -> None:
    news = threading.Event()
    alive: set[str] = set()

    def note(sample: zenoh.Sample) -> None:
        alive.add(str(sample.key_expr).removeprefix(KEYS.root))
        if sample.key_expr == zenoh.KeyExpr(KEYS.alive("alpha")):
            news.set()

    handler: Any = zenoh.handlers.Callback(note, indirect=False)
    with guarded.hub.liveliness().declare_subscriber(KEYS.alive("*"), handler, history=True):
        liveliness = guarded.client("alpha").liveliness()
        tokens = [liveliness.declare_token(KEYS.alive(host)) for host in ("beta", "observer", "alpha")]
        assert news.wait(timeout=20.0)
    assert alive == {"clock/alive/alpha"}
    assert len(tokens) == 3


@pytest.mark.parametrize(
    ("user", "secret"),
    [("alpha", "wrong"), ("alpha", password("beta")), ("alpha", ""), ("gamma", password("gamma")), ("", "")],
)
def test_who_does_not_know_a_hosts_password_cannot_connect(guarded: Guarded, user: str, secret: str) -> None:
    with pytest.raises(ConnectionFailedError, match=rf"^no connection to the hub at \S+ as {user}$"):
        open_client(guarded.endpoint, user, secret, connect_timeout_s=0.3)
    assert guarded.client("alpha").info.routers_zid() == [guarded.hub.info.zid()]


class Intruder:
    """Someone who has alpha's password, and in its name listens to, asks and says what alpha may not."""

    def __init__(self, sessions: ExitStack) -> None:
        self._sessions = sessions

    def connect(self, endpoint: str) -> None:
        """Before the fleet starts. One session speaks, another listens: a session hears itself without the hub."""
        self._session, listening = (
            self._sessions.enter_context(open_client(endpoint, "alpha", password("alpha"))) for _ in range(2)
        )
        wanted = ("world/truth/**", "veh/beta/**", "clock/to/beta", "coord/**", "**")
        self.ears = Ears(listening, [KEYS.topic(key) for key in wanted])

    def meddle(self, now_ms: int) -> None:
        """Says what would end the mission or change it."""
        for sender, key, message in (
            ("beta", "agent/beta/maneuver", Maneuver(1, ManeuverKind.HOLD, 0, 0, 0, 0, 0)),
            ("beta", "agent/beta/state", state(works_on=666)),
            ("coordinator", "coord/task/beta/1", Task(TaskAction.TAKE, 1, 0, 0, 0, 50, 10)),
            ("world", "veh/beta/nav", nav(666.0)),
            ("world", "world/truth/pose/beta", TruthPose(0, 0, 0)),
        ):
            payload = encode(Header(sender, 0, 0, now_ms), message)
            put(self._session, KEYS.topic(key), payload)
            for some in routing.audiences:
                put(self._session, KEYS.parcel(some, sender), msgpack.packb([key, payload]))
        put(self._session, KEYS.to_host("beta"), pack("finish", 0, 0, {}))
        put(self._session, KEYS.from_host("beta"), pack("answer", [["beta", None, []]]))
        put(self._session, KEYS.from_host("coordinator"), pack("failed", "no more"))


@pytest.mark.parametrize("guarded_by_rules", [True, False])
def test_an_intruder_with_an_agents_password_hears_nothing_and_changes_nothing(guarded_by_rules: bool) -> None:
    nodes, notes, calm_nodes, calm_notes = fleet_that_talks(), Notes(), fleet_that_talks(), Notes()
    tick = nodes["world"].wakes

    def tick_and_meddle(now_ms: int) -> Step:
        intruder.meddle(now_ms)
        return tick(now_ms)

    nodes["world"].wakes = tick_and_meddle
    with ExitStack() as sessions:
        intruder = Intruder(sessions)
        if not guarded_by_rules:  # to show that nothing but the rules keeps the intruder out
            with pytest.raises(FleetError):
                over_zenoh(nodes, notes, before=intruder.connect, rules=False)
            assert "veh/beta/nav" in intruder.ears.heard
            return
        result = over_zenoh(nodes, notes, before=intruder.connect)
    expected = on_local(calm_nodes, calm_notes)
    assert intruder.ears.heard == []
    assert (result.digest, result.messages, result.dropped) == (expected.digest, expected.messages, {})
    assert {name: node.log for name, node in nodes.items()} == {name: node.log for name, node in calm_nodes.items()}
    assert [one.payload for one in notes.heard] == [one.payload for one in calm_notes.heard]
