"""Who may write and who reads a key, for one roster of nodes: the topic table applied to a fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from comms.said.announcement import Role, RunInfo
from comms.said.topics import TOPICS, Reach, Topic, topic_of
from comms.said.wire import IDENTIFIER

MOST_ROUTES = 100_000  # that are remembered by their key


@dataclass(frozen=True, slots=True)
class RosterNode:
    """One node of the fleet: its id, its role and the vehicles it acts for (none for coordinator and watchers).

    `platform`: a vehicle, or another place, such as a ship, that it is on, where the fleet talks by modems: what
    crosses from one platform to another goes by theirs. "" for who is nowhere, as the world and those that only listen,
    and for all in a fleet where everybody hears everybody.
    """

    node_id: str
    role: Role
    vehicles: tuple[str, ...] = ()
    platform: str = ""

    def is_on(self, vehicle: str) -> bool:
        """Whether it sits on a vehicle."""
        return vehicle == self.platform if self.platform else vehicle in self.vehicles

    @property
    def listens_only(self) -> bool:
        """Whether the node only listens, so that no round waits for it."""
        return self.role in (Role.RECORDER, Role.OBSERVER)


def modem_of(platform: str) -> str:
    """The id of a platform's modem."""
    return f"{Role.MODEM.value}-{platform}"


def driver_of(platform: str) -> str:
    """The id of the driver of a platform's modem."""
    return f"{Role.DRIVER.value}-{platform}"


@dataclass(frozen=True, slots=True)
class Route:
    """What becomes of one key: its topic, the vehicle it names ("" for none), its only writer, and the nodes that read
    it (the writer left out), those that act and those that only listen."""

    topic: Topic
    vehicle: str
    writer: str
    readers: tuple[str, ...]
    watchers: tuple[str, ...]


class Routing:
    """Answers for a fixed roster; keys are below the run id. `announced`: how the run is announced, where that is known
    beforehand: then nobody believes another announcement. Raises ValueError for an id that is no identifier, for two
    nodes with one id, and for two that may write one topic of one vehicle."""

    def __init__(self, roster: tuple[RosterNode, ...], announced: RunInfo | None = None) -> None:
        self.roster = roster
        self.announced = announced
        self.nodes = {node.node_id: node for node in roster}
        for name in (*self.nodes, *(vehicle for node in roster for vehicle in node.vehicles)):
            if not IDENTIFIER.fullmatch(name):  # a `*` or `/` would let a node write and read what is not its own
                raise ValueError(f"{name!r} is not an id: at most 40 of a-z, 0-9, _ and -")
        if len(self.nodes) != len(roster):
            raise ValueError("two nodes have the same id")
        self._routes: dict[str, Route] = {}
        self._routes_of: dict[tuple[Topic, str], Route] = {}
        self._kept_by: dict[str, set[str]] = {}
        for topic in TOPICS:
            for vehicle in self._named(topic) if topic.has_vehicle else {""}:
                writers = self._who(topic, topic.writers, vehicle)
                if len(writers) > 1:
                    raise ValueError(f"{topic.name} of {vehicle or 'the fleet'} has two writers: {', '.join(writers)}")
                if writers:
                    self._kept_by.setdefault(writers[0], set()).add(topic.expression(vehicle))

    @cached_property
    def audiences(self) -> frozenset[tuple[str, ...]]:
        """All that `Route.watchers` may be."""
        listening = [node for node in self.roster if node.listens_only]
        return frozenset(tuple(node.node_id for node in listening if node.role in topic.readers) for topic in TOPICS)

    def route(self, key: str) -> Route | None:
        """The key's route; None where it belongs to no topic, names no vehicle of the fleet, or nobody may write it."""
        try:
            return self._routes[key]
        except KeyError:
            found = self._find(key)
            if found is not None:  # keys that lead nowhere are not kept: anyone may think of any number of them
                if len(self._routes) >= MOST_ROUTES:  # of those that lead somewhere a vehicle may, too
                    self._routes.clear()
                self._routes[key] = found
            return found

    def subscriptions(self, node_id: str) -> tuple[str, ...]:
        """Key expressions, below the run id, of all that a node reads."""
        return self._expressions(node_id, writing=False)

    def publications(self, node_id: str) -> tuple[str, ...]:
        """Key expressions, below the run id, of all that a node may write."""
        return self._expressions(node_id, writing=True)

    def kept_by(self, node_id: str) -> frozenset[str]:
        """Key expressions, below the run id, of what a node says and keeps for others: one for each topic and, where
        its keys name a vehicle, each vehicle. None for who is not of the fleet."""
        return frozenset(self._kept_by.get(node_id, ()))

    def _find(self, key: str) -> Route | None:
        found = topic_of(key)
        if found is None:
            return None
        route = self._routes_of.get(found)
        if route is None:
            route = self._route_of(*found)
            if route is not None:
                self._routes_of[found] = route
        return route

    def _route_of(self, topic: Topic, vehicle: str) -> Route | None:
        writers = self._who(topic, topic.writers, vehicle)
        if not writers:
            return None
        everyone = [n for n in self._who(topic, topic.readers, vehicle) if n != writers[0]]
        if topic.crosses_water and not topic.has_platform:
            here = self.nodes[writers[0]].platform
            everyone = [n for n in everyone if here in ("", self.nodes[n].platform) or not self.nodes[n].platform]
        return Route(
            topic=topic,
            vehicle=vehicle,
            writer=writers[0],
            readers=tuple(n for n in everyone if not self.nodes[n].listens_only),
            watchers=tuple(n for n in everyone if self.nodes[n].listens_only),
        )

    def _who(self, topic: Topic, table: Mapping[Role, Reach], vehicle: str) -> list[str]:
        known = not topic.has_vehicle or vehicle in self._named(topic)
        return [
            node.node_id
            for node in self.roster
            if known
            and node.role in table
            and (table[node.role] is Reach.ALL or not topic.has_vehicle or vehicle in self._own(node, topic))
        ]

    def _named(self, topic: Topic) -> frozenset[str]:
        """The vehicles, or platforms, that keys of a topic may name."""
        return self._platforms if topic.has_platform else self._vehicles

    @cached_property
    def _vehicles(self) -> frozenset[str]:
        return frozenset(vehicle for node in self.roster for vehicle in node.vehicles)

    @cached_property
    def _platforms(self) -> frozenset[str]:
        return frozenset(node.platform for node in self.roster if node.platform)

    def _expressions(self, node_id: str, *, writing: bool) -> tuple[str, ...]:
        node = self.nodes[node_id]
        found: list[str] = []
        for topic in TOPICS:
            reach = (topic.writers if writing else topic.readers).get(node.role)
            if reach is None:
                continue
            if node.platform and topic.crosses_water and not writing:
                found.extend(self._on_its_platform(node_id, topic))
            elif reach is Reach.OWN and topic.has_vehicle:
                found.extend(topic.expression(vehicle) for vehicle in self._own(node, topic))
            else:
                found.append(topic.expression())
        return tuple(found)

    def _on_its_platform(self, node_id: str, topic: Topic) -> list[str]:
        """What a node hears of a topic without a modem."""
        names = sorted(self._named(topic)) if topic.has_vehicle else [""]
        routes = {name: self._route_of(topic, name) for name in names}
        return [topic.expression(name) for name, route in routes.items() if route and node_id in route.readers]

    def _own(self, node: RosterNode, topic: Topic) -> tuple[str, ...]:
        """What keys of a topic name as a node's own."""
        if not topic.has_platform:
            return node.vehicles
        return (node.platform,) if node.platform else self._without_driver

    @cached_property
    def _without_driver(self) -> tuple[str, ...]:
        """The platforms whose modems have no driver: between these the world carries frames."""
        driven = {node.platform for node in self.roster if node.role is Role.DRIVER}
        return tuple(sorted(self._platforms - driven))
