"""The faults of a storm, drawn from a number: each kind of fault in or out by a coin of its own, how many and how bad,
on which topics, vehicles and phases; then a core is healed, and everybody else fails for good.

Leaving kinds out altogether finds more than a little of everything in each storm (Groce and others, "Swarm Testing",
2012). That all but a core fails for good shows what faults that heal would hide: whoever waits for one that is gone.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

from comms.lockstep.faults import STRUCK
from comms.said.routing import modem_of
from comms.said.topics import LOOK, MANEUVER, MANEUVER_STATUS, Topic
from secondlook.fleet.link import patience_of, platforms_of
from secondlook.fleet.nodes import COORDINATOR
from secondlook.scenario import Scenario
from secondlook.storm.fleets import survey_s
from secondlook.testing.plan import TroublePlan, make_plan

CALM_SHARE = 0.1
"""Of all storms: nothing goes wrong in these, and more must hold."""
COORDINATOR_AGAIN_SHARE = 0.15
"""Of those in which something goes wrong: beside all else the coordinator goes on by its memory once more."""
FULL_DISK_SHARE = 0.02
"""Of those in which something goes wrong: the disk is full from some moment on."""
_SHORTEST_S = 20.0  # until the core is healed
_FOR_EVER_S = 1e6
_Entry = dict[str, Any]


def draw_storm(scenario: Scenario, number: int) -> TroublePlan:
    """What goes wrong in a mission, by the number of the storm, 0 or more; the same each time."""
    rng = Random(f"storm {number}")
    if rng.random() < CALM_SHARE:
        return _plan(scenario, number, (), 0.0, [])
    heals_s = max(_SHORTEST_S, _s(rng.choice((rng.uniform(0.1, 1.2), rng.uniform(0.1, 2))) * survey_s(scenario)))
    heals_s = min(heals_s, latest_heals_s(scenario))
    core = (COORDINATOR, *_core_vehicles(rng, scenario))
    trouble = _Swarm(rng, scenario, core, heals_s).drawn(number) + _full_disk(scenario, number)
    return _plan(scenario, number, core, heals_s, trouble)


def _full_disk(scenario: Scenario, number: int) -> list[_Entry]:
    """Seldom, as the mission ends there."""
    rng = Random(f"disk {number}")
    at_s = _s(rng.uniform(0.05, 1.2) * survey_s(scenario))
    return [{"what": "disk_full", "at_s": at_s}] if rng.random() < FULL_DISK_SHARE else []


def _plan(scenario: Scenario, number: int, core: tuple[str, ...], heals_s: float, trouble: list[_Entry]) -> TroublePlan:
    time_limit_s = max(limit_s(scenario, heals_s), scenario.mission.time_limit_s)
    mission = scenario.mission.model_copy(update={"time_limit_s": time_limit_s})
    drawn = {"fault_seed": number, "core": core, "heals_s": heals_s, "trouble": trouble}
    return make_plan({"scenario": scenario.model_copy(update={"mission": mission}), **drawn})


def latest_heals_s(scenario: Scenario) -> float:
    """Until when a core must be healed: later it may have been given up, or is too late for the end."""
    latest_s = _s(0.9 * patience_of(scenario).given_up_ms / 1000)
    deadline_s = scenario.mission.deadline_s
    return latest_s if deadline_s is None else min(latest_s, _s(deadline_s / 2))


def limit_s(scenario: Scenario, heals_s: float) -> float:
    """A mission whose core is healed at `heals_s` and that is not over by then never will be."""
    lost_s = patience_of(scenario).stuck_ms / 1000
    # Whoever was started anew surveys from the beginning.
    return 2 * scenario.mission.ends_s(heals_s + 2 * survey_s(scenario) + lost_s) + 600


def _core_vehicles(rng: Random, scenario: Scenario) -> list[str]:
    """One that surveys, and one that helps if there is any; that with the coordinator aboard is one of them."""
    core = [rng.choice(list(scenario.survey_vehicles))]
    helpers = list(scenario.revisit_vehicles)
    core += [rng.choice(helpers)] if helpers else []
    aboard = scenario.coordinator.platform
    if aboard in scenario.survey_vehicles:
        core[0] = aboard
    elif aboard in helpers:
        core[1] = aboard
    return core


def _s(seconds: float) -> float:
    return round(seconds, 3)


class _Swarm:
    """Draws all faults of one storm. `nodes`: those that may fail, the coordinator and the vehicles' agents."""

    def __init__(self, rng: Random, scenario: Scenario, core: tuple[str, ...], heals_s: float) -> None:
        self._rng = rng
        self._vehicles = list(scenario.vehicles)
        self._nodes = [COORDINATOR, *self._vehicles]
        self._revisiting = [name for name, one in scenario.survey_vehicles.items() if one.revisits]
        self._surveyed_s = survey_s(scenario)
        self._platforms = [] if scenario.link is None else list(platforms_of(scenario))
        self._core = core
        self._heals_s = heals_s
        self._free_s = dict.fromkeys(self._nodes, 0.0)  # from when on something else may happen to the node
        self._gone: set[str] = set()

    def drawn(self, number: int) -> list[_Entry]:
        """All that goes wrong in the storm of this number, in no order."""
        kinds: tuple[Callable[[], list[_Entry]], ...] = (
            self._late_joins,
            self._restarts,
            self._unheard_restarts,
            self._freezes,
            self._deaths,
            self._swizzle,
            self._cut_offs,
            self._partitions,
            self._slow_links,
            self._bodies,
            *(lambda what=what: self._strikes(what) for what in ("drop", "repeat", "delay", "reorder", "corrupt")),
        )
        if self._platforms:
            kinds += (self._blackouts, self._range_cuts, self._jams, self._modems)
        trouble: list[_Entry] = []
        for kind in kinds:
            if self._rng.random() < 0.4:
                trouble += kind()
        trouble += self._coordinator_again(Random(f"coordinator again {number}"))
        for_good = self._for_good()
        return trouble + self._second_surveys() + for_good  # what befalls a node in the order of time

    def _late_joins(self) -> list[_Entry]:
        joined = [node for node in self._nodes if self._rng.random() < 0.3]
        return [{"what": "join", "node": node, "at_s": self._later(node, 0.5)} for node in joined]

    def _restarts(self) -> list[_Entry]:
        found: list[_Entry] = []
        for _ in range(self._rng.randint(1, 3)):
            node = self._rng.choice(self._nodes)
            if self._free_s[node] + 2 < self._heals_s and node not in self._gone:
                found.append({"what": "kill", "node": node, "at_s": self._later(node)})
                memory = {"memory": True} if self._rng.random() < 0.4 else {}
                found.append({"what": "join", "node": node, "at_s": self._later(node), **memory})
        return found

    def _coordinator_again(self, rng: Random) -> list[_Entry]:
        """The coordinator alone is started anew, and goes on by its memory after a while in which much has changed."""
        from_s = self._free_s[COORDINATOR]
        if rng.random() >= COORDINATOR_AGAIN_SHARE or from_s + 20 > self._heals_s:
            return []
        at_s, until_s = sorted(_s(rng.uniform(from_s + 1, self._heals_s - 1)) for _ in range(2))
        self._free_s[COORDINATOR] = until_s
        killed = {"what": "kill", "node": COORDINATOR, "at_s": at_s}
        return [killed, {"what": "join", "node": COORDINATOR, "at_s": _s(until_s + 0.01), "memory": True}]

    def _unheard_restarts(self) -> list[_Entry]:
        """Late a vehicle is started anew, and at first nobody hears it: it counts as what it was."""
        found: list[_Entry] = []
        for vehicle in self._vehicles:
            from_s = max(self._free_s[vehicle], 0.5 * self._heals_s)
            if self._rng.random() < 0.5 and from_s + 8 < self._heals_s and vehicle not in self._gone:
                found += self._unheard_restart(vehicle, from_s)
        return found

    def _unheard_restart(self, vehicle: str, from_s: float) -> list[_Entry]:
        at_s = self._between(from_s, self._heals_s - 5)
        self._free_s[vehicle] = _s(at_s + self._rng.uniform(1, 3))
        lost = {"keys": _keys_of(vehicle), "from_s": at_s, "for_s": _s(self._heals_s - at_s)}
        return [
            {"what": "kill", "node": vehicle, "at_s": at_s},
            {"what": "join", "node": vehicle, "at_s": self._free_s[vehicle]},
            {"what": "drop", **lost},
        ]

    def _freezes(self) -> list[_Entry]:
        found: list[_Entry] = []
        for _ in range(self._rng.randint(1, 4)):
            node = self._rng.choice(self._nodes)
            if self._free_s[node] + 2 < self._heals_s and node not in self._gone:
                at_s = self._later(node)
                found.append({"what": "freeze", "node": node, "at_s": at_s, "for_s": _s(self._later(node) - at_s)})
        return found

    def _deaths(self) -> list[_Entry]:
        others = [node for node in self._nodes if node not in self._core]
        gone = [node for node in others if self._rng.random() < 0.5 and self._free_s[node] + 1 < self._heals_s]
        self._gone.update(gone)
        return [{"what": "kill", "node": node, "at_s": self._later(node)} for node in gone]

    def _swizzle(self) -> list[_Entry]:
        """Some stop one after the other, and go on in another order."""
        some = [
            one
            for one in self._nodes
            if self._free_s[one] + 4 < self._heals_s and one not in self._gone and self._rng.random() < 0.6
        ]
        from_s = max((self._free_s[one] for one in some), default=0.0) + 1
        middle_s = self._between(from_s, self._heals_s)
        found: list[_Entry] = []
        for node in some:
            at_s, ends_s = self._between(from_s, middle_s), self._between(middle_s, self._heals_s)
            if ends_s > at_s:
                found.append({"what": "freeze", "node": node, "at_s": at_s, "for_s": _s(ends_s - at_s)})
                self._free_s[node] = ends_s
        return found

    def _cut_offs(self) -> list[_Entry]:
        found: list[_Entry] = []
        for vehicle in self._vehicles:
            if self._rng.random() < 0.5:
                from_s, for_s = self._span()
                found.append({"what": "cut_off", "vehicle": vehicle, "from_s": from_s, "for_s": for_s})
        return found

    def _partitions(self) -> list[_Entry]:
        """Some nodes hear nothing of some others: in both directions, or in one alone."""
        one_side = [node for node in self._nodes if self._rng.random() < 0.5]
        other_side = [node for node in self._nodes if node not in one_side]
        from_s, for_s = self._span()
        pairs = [(one, other) for one in one_side for other in other_side]
        if self._rng.random() < 0.5:
            pairs += [(other, one) for one, other in pairs]
        return [
            {"what": "drop", "keys": _keys_of(one), "to": other, "from_s": from_s, "for_s": for_s}
            for one, other in pairs
        ]

    def _slow_links(self) -> list[_Entry]:
        """All that some vehicles say, or are told, takes longer than answers are waited for."""
        found: list[_Entry] = []
        for vehicle in self._vehicles:
            if self._rng.random() < 0.5:
                from_s, for_s = self._span()
                keys = self._rng.choice(
                    (_keys_of(vehicle), f"agent/{vehicle}/task_status/*", f"coord/task/{vehicle}/*")
                )
                found.append(
                    {
                        "what": "delay",
                        "keys": keys,
                        "from_s": from_s,
                        "for_s": for_s,
                        "by_s": _s(self._rng.uniform(8, 29)),
                    }
                )
        return found

    def _bodies(self) -> list[_Entry]:
        """What agents and their vehicles say to each other is lost: looks, the ends of manoeuvres, commands."""
        found: list[_Entry] = []
        for vehicle in self._vehicles:
            if self._rng.random() < 0.5:
                from_s, for_s = (0.0, self._heals_s) if self._rng.random() < 0.5 else self._span()
                topic = self._rng.choice((LOOK, MANEUVER_STATUS, MANEUVER))
                found.append({"what": "drop", "keys": topic.expression(vehicle), "from_s": from_s, "for_s": for_s})
        return found

    def _blackouts(self) -> list[_Entry]:
        """Modems neither send nor hear, one after another or all at once."""
        silent: list[str | None] = [one for one in self._platforms if self._rng.random() < 0.5]
        found: list[_Entry] = []
        for platform in silent if self._rng.random() < 0.8 else [None]:
            from_s, for_s = self._span()
            whose = {} if platform is None else {"platform": platform}
            found.append({"what": "blackout", **whose, "from_s": from_s, "for_s": for_s})
        return found

    def _range_cuts(self) -> list[_Entry]:
        from_s, for_s = self._span()
        to_m = round(self._rng.uniform(20, 400), 1)
        return [{"what": "range_cut", "to_m": to_m, "from_s": from_s, "for_s": for_s}]

    def _jams(self) -> list[_Entry]:
        found: list[_Entry] = []
        for _ in range(self._rng.randint(1, 3)):
            from_s, for_s = self._span()
            loss = round(10 ** self._rng.uniform(-1, 0), 3)
            found.append({"what": "jammed", "loss": loss, "from_s": from_s, "for_s": for_s})
        return found

    def _modems(self) -> list[_Entry]:
        """Modems are started again, anew or as they were, or do nothing for a while."""
        found: list[_Entry] = []
        for platform in self._platforms:
            if self._rng.random() < 0.5:
                node, at_s = modem_of(platform), self._between(0, self._heals_s)
                until_s = self._between(at_s, self._heals_s)
                if self._rng.random() < 0.3:
                    found.append({"what": "freeze", "node": node, "at_s": at_s, "for_s": _s(until_s - at_s)})
                    continue
                memory = {"memory": True} if self._rng.random() < 0.5 else {}
                found.append({"what": "kill", "node": node, "at_s": at_s})
                found.append({"what": "join", "node": node, "at_s": until_s, **memory})
        return found

    def _strikes(self, what: str) -> list[_Entry]:
        found: list[_Entry] = []
        for _ in range(self._rng.randint(1, 3)):
            from_s, for_s = (0.0, self._heals_s) if self._rng.random() < 0.3 else self._span()
            entry: _Entry = {"what": what, "keys": self._keys(), "from_s": from_s, "for_s": for_s}
            entry["probability"] = round(10 ** self._rng.uniform(-2, 0), 3)
            if self._rng.random() < 0.3:
                entry["to"] = self._rng.choice(self._nodes)
            later = {"repeat": "after_s", "delay": "by_s", "reorder": "within_s"}.get(what)
            if later is not None:
                entry[later] = _s(10 ** self._rng.uniform(-2, 1.5))
            found.append(entry)
        return found

    def _for_good(self) -> list[_Entry]:
        """From the moment at which the core is healed on, each of the others has failed in a way of its own."""
        found: list[_Entry] = []
        at_s = _s(max(self._heals_s, *self._free_s.values()) + 0.001)
        for node in self._vehicles:
            if node in self._core or node in self._gone:
                continue
            ways = ("killed", "frozen", "cut off", "deaf", "dumb", "lossy", "blind")
            match self._rng.choice((*ways, "silent") if self._platforms else ways):
                case "killed":
                    found.append({"what": "kill", "node": node, "at_s": at_s})
                case "frozen":
                    found.append({"what": "freeze", "node": node, "at_s": at_s, "for_s": _FOR_EVER_S})
                case "cut off":
                    found.append({"what": "cut_off", "vehicle": node, "from_s": at_s, "for_s": _FOR_EVER_S})
                case "silent":
                    found.append({"what": "blackout", "platform": node, "from_s": at_s, "for_s": _FOR_EVER_S})
                case "deaf":
                    found.append({"what": "drop", "keys": "**", "to": node, "from_s": at_s})
                case "dumb":
                    found.append({"what": "drop", "keys": _keys_of(node), "from_s": at_s})
                case "blind":
                    found.append({"what": "drop", "keys": LOOK.expression(node), "from_s": at_s})
                case "lossy":
                    share = round(self._rng.uniform(0.3, 0.95), 2)
                    found.append({"what": "drop", "keys": _keys_of(node), "from_s": at_s, "probability": share})
        return found

    def _second_surveys(self) -> list[_Entry]:
        """Primaries that take strips are started anew when they have surveyed all, and nobody hears that they begin
        again."""
        found: list[_Entry] = []
        for vehicle in self._revisiting:
            from_s = max(self._free_s[vehicle], self._surveyed_s)
            if from_s + 8 < self._heals_s and vehicle not in self._gone and self._rng.random() < 0.7:
                found += self._unheard_restart(vehicle, from_s)
        return found

    def _keys(self) -> str:
        """Whose loss may matter: all, a node's, a topic's of all vehicles or of one."""
        topic: Topic = self._rng.choice(STRUCK)
        vehicle = self._rng.choice(self._vehicles)
        node = self._rng.choice(self._nodes)
        return self._rng.choice(("**", _keys_of(node), topic.expression(), topic.expression(vehicle)))

    def _later(self, node: str, share: float = 1.0) -> float:
        """A time at which something may happen to a node: after all that was, and before the core is healed."""
        after_s = self._free_s[node]
        time_s = self._between(after_s, after_s + share * (self._heals_s - after_s))
        self._free_s[node] = time_s
        return time_s

    def _between(self, from_s: float, until_s: float) -> float:
        return _s(from_s + max(0.002, (until_s - from_s) * self._rng.uniform(0.01, 0.99)))

    def _span(self) -> tuple[float, float]:
        from_s = self._between(0, self._heals_s)
        return from_s, _s(max(0.001, self._between(from_s, self._heals_s) - from_s))


def _keys_of(node: str) -> str:
    """What a node says; of a vehicle's, its agent."""
    return "coord/**" if node == COORDINATOR else f"agent/{node}/**"
