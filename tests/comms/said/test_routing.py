"""The topic table applied to a fleet: one writer a key, readers as the table says, expressions that cover no more."""

from __future__ import annotations

from dataclasses import replace

import pytest
import zenoh
from fleets import with_modems

from comms.said.announcement import Role
from comms.said.routing import RosterNode, Routing
from comms.said.topics import TOPICS, Topic, topic_of

VEHICLES = ("alpha", "beta", "gamma")
ROSTER = (
    RosterNode("clock", Role.CLOCK),
    RosterNode("world", Role.WORLD, ("alpha", "beta")),
    RosterNode("gamma-body", Role.BODY, ("gamma",)),
    RosterNode("alpha", Role.SURVEY, ("alpha",)),
    RosterNode("beta", Role.REVISIT, ("beta",)),
    RosterNode("gamma", Role.REVISIT, ("gamma",)),
    RosterNode("coordinator", Role.COORDINATOR),
    RosterNode("recorder", Role.RECORDER),
    RosterNode("observer", Role.OBSERVER),
)
# For each topic who writes it for alpha, beta and gamma (or at all), and who reads it apart from recorder and observer.
BODIES = {"alpha": "world", "beta": "world", "gamma": "gamma-body"}
AGENTS = {name: name for name in VEHICLES}
EXPECTED: dict[str, tuple[dict[str, str], dict[str, set[str]]]] = {
    "run": ({"": "clock"}, {"": {"world", "gamma-body", "alpha", "beta", "gamma", "coordinator"}}),
    "nav": (BODIES, {name: {name} for name in VEHICLES}),
    "look": (BODIES, {name: {name} for name in VEHICLES}),
    "maneuver_status": (BODIES, {name: {name} for name in VEHICLES}),
    "maneuver": (AGENTS, {name: {body} for name, body in BODIES.items()}),
    "state": (AGENTS, {name: {"coordinator"} for name in VEHICLES}),
    "plan": ({"alpha": "alpha"}, {"alpha": {"coordinator"}}),
    "curve": ({"alpha": "alpha"}, {"alpha": {"coordinator"}}),
    "coverage": (AGENTS, {name: {"coordinator"} for name in VEHICLES}),
    "contact": (AGENTS, {name: {"coordinator"} for name in VEHICLES}),
    "hotspot": ({"alpha": "alpha"}, {"alpha": {"coordinator"}}),
    "strip": ({"": "coordinator"}, {"": set()}),
    "task": (dict.fromkeys(VEHICLES, "coordinator"), {name: {name} for name in VEHICLES}),
    "task_status": ({"beta": "beta", "gamma": "gamma"}, {"beta": {"coordinator"}, "gamma": {"coordinator"}}),
    "mission_over": ({"": "coordinator"}, {"": {"world", "alpha", "beta", "gamma"}}),
    "truth_targets": ({"": "world"}, {"": set()}),
    "truth_look": ({"alpha": "world", "beta": "world"}, {"alpha": set(), "beta": set()}),
    "truth_pose": ({"alpha": "world", "beta": "world"}, {"alpha": set(), "beta": set()}),
}
routing = Routing(ROSTER)
by_topic = pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)


def keys_of(topic: Topic) -> list[tuple[str, str]]:
    """(vehicle, key) of a few keys of a topic, for each vehicle of the fleet."""
    vehicles = VEHICLES if topic.has_vehicle else ("",)
    return [
        (name, topic.key(vehicle=name, number=number, tile=f"{number}-0")) for name in vehicles for number in (0, 12)
    ]


ALL_KEYS = [key for topic in TOPICS for _, key in keys_of(topic)]


@by_topic
def test_a_key_has_the_writer_and_the_readers_that_the_table_says(topic: Topic) -> None:
    writers, readers = EXPECTED.get(topic.name, ({}, {}))  # without modems nobody writes what is theirs
    watchers = ("observer",) if topic.name == "look" else ("recorder", "observer")
    for vehicle, key in keys_of(topic):
        route = routing.route(key)
        if vehicle not in writers:
            assert route is None
            continue
        assert route is not None
        assert (route.topic, route.writer, route.watchers) == (topic, writers[vehicle], watchers)
        assert set(route.readers) == readers[vehicle]
        assert len(set(route.readers)) == len(route.readers)


def test_the_audiences_are_who_listens_to_any_key() -> None:
    routes = [route for route in map(routing.route, ALL_KEYS) if route is not None]
    assert routing.audiences == {route.watchers for route in routes} == {("recorder", "observer"), ("observer",)}


@by_topic
def test_a_key_belongs_to_one_topic(topic: Topic) -> None:
    for vehicle, key in keys_of(topic):
        assert [one for one in TOPICS if one.regex.fullmatch(key)] == [topic]
        assert topic_of(key) == (topic, vehicle)


@pytest.mark.parametrize("node_id", [node.node_id for node in ROSTER])
def test_expressions_cover_exactly_the_keys_of_a_node(node_id: str) -> None:
    reads = [zenoh.KeyExpr(one) for one in routing.subscriptions(node_id)]
    writes = [zenoh.KeyExpr(one) for one in routing.publications(node_id)]
    for key in ALL_KEYS:
        route = routing.route(key)
        if route is None:
            continue
        assert any(one.includes(zenoh.KeyExpr(key)) for one in writes) == (route.writer == node_id)
        if route.writer != node_id:
            is_reader = node_id in (*route.readers, *route.watchers)
            assert any(one.includes(zenoh.KeyExpr(key)) for one in reads) == is_reader


@pytest.mark.parametrize(
    "key",
    [
        "", "run/", "/run", "runs", "veh/alpha", "veh//nav", "veh/alpha/nav/1", "veh/delta/nav", "veh/*/nav", "veh/**",
        "veh/ALPHA/nav", "agent/alpha/hotspot/-1", "agent/alpha/hotspot/1a", "agent/alpha/hotspot/\u0661",
        "agent/alpha/hotspot/01", "agent/alpha/hotspot/1000000000", f"agent/alpha/contact/{'9' * 5000}",
        f"agent/alpha/coverage/{'0' * 41}",
        "agent/alpha/coverage/*", "world/truth/look/delta", "clock/to/alpha", "secondlook/v1/x/run", "run\n",
    ],
)  # fmt: skip
def test_a_key_of_no_topic_or_no_vehicle_of_the_fleet_has_no_route(key: str) -> None:
    assert routing.route(key) is None


def test_a_route_is_looked_up_once_and_keys_that_lead_nowhere_are_not_kept() -> None:
    fresh = Routing(ROSTER)
    assert fresh.route("veh/alpha/nav") is fresh.route("veh/alpha/nav")
    for number in range(100):
        fresh.route(f"nowhere/{number}")
    assert len(fresh._routes) == 1


def test_of_keys_that_one_vehicle_may_think_of_few_are_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("comms.said.routing.MOST_ROUTES", 10)
    fresh = Routing(ROSTER)
    for number in range(100):
        assert fresh.route(f"agent/alpha/coverage/{number}") is not None
        assert len(fresh._routes) <= 10


@pytest.mark.parametrize(
    ("node_id", "expressions"),
    [
        ("clock", {"run"}),
        ("coordinator", {"coord/strip/*", "coord/task/beta/*", "coord/mission_over"}),
        ("observer", set()),
        ("nobody", set()),
        ("beta", {"agent/beta/maneuver", "agent/beta/state", "agent/beta/coverage/*", "agent/beta/contact/*",
                  "agent/beta/task_status/*"}),
    ],
)  # fmt: skip
def test_what_a_node_keeps_is_what_it_says_of_each_vehicle(node_id: str, expressions: set[str]) -> None:
    assert routing.kept_by(node_id) >= expressions
    assert all(zenoh.KeyExpr(one) for one in routing.kept_by(node_id))
    assert not routing.kept_by(node_id) & {"veh/alpha/look"}
    if node_id not in ("coordinator",):
        assert routing.kept_by(node_id) == expressions


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        (RosterNode("alpha", Role.REVISIT, ("delta",)), "^two nodes have the same id$"),
        (RosterNode("other", Role.SURVEY, ("alpha",)), "^maneuver of alpha has two writers: alpha, other$"),
        (RosterNode("other", Role.REVISIT, ("beta",)), "^maneuver of beta has two writers: beta, other$"),
        (RosterNode("body", Role.BODY, ("beta",)), "of beta has two writers: world, body$"),
        (RosterNode("other", Role.COORDINATOR), "^strip of the fleet has two writers: coordinator, other$"),
        (RosterNode("other", Role.CLOCK), "^run of the fleet has two writers: clock, other$"),
        (RosterNode("other", Role.WORLD), "^truth_targets of the fleet has two writers: world, other$"),
        (RosterNode("*", Role.OBSERVER), r"^'\*' is not an id"),
        (RosterNode("a/b", Role.OBSERVER), "^'a/b' is not an id"),
        (RosterNode("", Role.OBSERVER), "^'' is not an id"),
        (RosterNode("a" * 41, Role.OBSERVER), "is not an id"),
        (RosterNode("delta", Role.SURVEY, ("**",)), r"^'\*\*' is not an id"),
    ],
)
def test_a_roster_that_clashes_is_refused(extra: RosterNode, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        Routing((*ROSTER, extra))


class TestWithModems:
    """Coordinator on a ship or aboard alpha; what crosses from one platform to another is heard by modems alone."""

    routing = Routing(with_modems(ROSTER))
    aboard = Routing(
        tuple(replace(one, platform="alpha") if one.node_id == "coordinator" else one for one in with_modems(ROSTER))
    )

    @pytest.mark.parametrize(
        ("key", "readers", "aboard_readers"),
        [
            ("agent/alpha/state", {"modem-alpha"}, {"modem-alpha", "coordinator"}),
            ("agent/beta/state", {"modem-beta"}, {"modem-beta"}),
            ("agent/alpha/hotspot/3", {"modem-alpha"}, {"modem-alpha", "coordinator"}),
            ("coord/task/alpha/3", {"modem-ship"}, {"modem-alpha", "alpha"}),
            ("coord/task/beta/3", {"modem-ship"}, {"modem-alpha"}),
            ("coord/mission_over", {"modem-ship", "world"}, {"modem-alpha", "alpha", "world"}),
            ("veh/beta/nav", {"beta"}, {"beta"}),
            ("veh/beta/look", {"beta", "modem-beta"}, {"beta", "modem-beta"}),
            ("modem/beta/tx", {"world"}, {"world"}),
            ("modem/beta/rx", {"modem-beta"}, {"modem-beta"}),
            ("modem/beta/heard", {"beta"}, {"beta"}),
            ("modem/ship/heard", {"coordinator"}, set()),
            ("modem/alpha/heard", {"alpha"}, {"alpha", "coordinator"}),
        ],
    )
    def test_readers(self, key: str, readers: set[str], aboard_readers: set[str]) -> None:
        for routing, expected in ((self.routing, readers), (self.aboard, aboard_readers)):
            route = routing.route(key)
            assert route is not None
            assert {*route.readers} == expected
            assert route.watchers in (("recorder", "observer"), ("observer",))

    def test_a_driver_carries_for_its_platform_and_the_world_for_the_others(self) -> None:
        driven = Routing((*self.routing.roster, RosterNode("driver-beta", Role.DRIVER, (), "beta")))
        carriers = {"alpha": "world", "beta": "driver-beta", "gamma": "world", "ship": "world"}
        for platform, carrier in carriers.items():
            sent, come = (driven.route(f"modem/{platform}/{way}") for way in ("tx", "rx"))
            assert sent is not None
            assert come is not None
            assert (sent.readers, come.writer) == ((carrier,), carrier)
        assert driven.subscriptions("driver-beta") == ("run", "modem/beta/tx")
        assert driven.publications("driver-beta") == ("modem/beta/rx",)

    @pytest.mark.parametrize("key", ["modem/delta/tx", "modem/world/rx", "modem/*/heard", "modem/beta/tx/1"])
    def test_no_platform_of_the_fleet(self, key: str) -> None:
        assert self.routing.route(key) is None

    @pytest.mark.parametrize("fleet", ["routing", "aboard"])
    def test_expressions_cover_exactly_the_keys_of_a_node(self, fleet: str) -> None:
        routing: Routing = getattr(self, fleet)
        names = (*VEHICLES, "ship")
        keys = [
            topic.key(vehicle=name, number=7, tile="7-0")
            for topic in TOPICS
            for name in (names if topic.has_vehicle else [""])
        ]
        routes = [(key, route) for key in keys if (route := routing.route(key)) is not None]
        assert len(routes) > 45
        for node_id in routing.nodes:
            reads = [zenoh.KeyExpr(one) for one in routing.subscriptions(node_id)]
            for key, route in routes:
                is_reader = node_id in (*route.readers, *route.watchers)
                covered = any(one.includes(zenoh.KeyExpr(key)) for one in reads)
                assert covered == is_reader or (covered and route.writer == node_id)
