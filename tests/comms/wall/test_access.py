"""Who may write, read and ask for what by the wall clock: rules by certificate name at a real router."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import zenoh
from by_wall import ROUTING, WALL_KEYS
from certificates import files_of, make_certificates
from fleets import EACH_ALONE
from flights import until

from comms.errors import ConnectionFailedError
from comms.keys import HostSpec
from comms.session import Certificates, open_guest, open_router, subscribe
from comms.wall.access import access_rules
from secondlook.fleet.certificates import certify

NAMES = ("router", "world", "alpha", "beta", "coordinator", "observer")
HOSTS = (HostSpec("world", ("world",)), *EACH_ALONE)
SOON_S = 20.0


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Certificates]:
    return make_certificates(tmp_path_factory.mktemp("fleet") / "certificates", NAMES, "127.0.0.1")


class Guarded:
    """A router with the rules of the toy fleet, and the sessions that are opened at it."""

    def __init__(self, sessions: ExitStack, certificates: dict[str, Certificates]) -> None:
        self._sessions = sessions
        self._certificates = certificates
        rules = access_rules(ROUTING, HOSTS, WALL_KEYS, "cert_common_names")
        self.router, self.endpoint = open_router("tls/127.0.0.1:0", certificates["router"], rules)
        sessions.enter_context(self.router)

    def session(self, name: str) -> zenoh.Session:
        """A session with the certificate of that name."""
        opened = open_guest(self.endpoint, None, self._certificates[name], within_s=SOON_S)
        return self._sessions.enter_context(opened)


@pytest.fixture
def guarded(certificates: dict[str, Certificates]) -> Iterator[Guarded]:
    with ExitStack() as sessions:
        yield Guarded(sessions, certificates)


def hears(session: zenoh.Session, *keys: str) -> queue.SimpleQueue[str]:
    """The keys below the run id that come under these key expressions."""
    heard: queue.SimpleQueue[str] = queue.SimpleQueue()
    for one in keys:
        subscribe(session, [WALL_KEYS.topic(one)], lambda key, payload: heard.put(key.removeprefix(WALL_KEYS.root)))
    return heard


def test_a_certificate_lets_its_node_write_its_own_keys_alone(guarded: Guarded) -> None:
    heard = hears(guarded.router, "**")
    beta = guarded.session("beta")
    for key in (
        "agent/alpha/state", "coord/mission_over", "veh/beta/nav", "world/truth/targets", "run", "clock/time",
        "clock/beat/alpha", "clock/from/alpha", "clock/to/beta",
        "agent/beta/state", "clock/beat/beta", "clock/from/beta",
    ):  # fmt: skip
        beta.put(WALL_KEYS.topic(key), b"x")
    assert [heard.get(timeout=SOON_S) for _ in range(3)] == ["agent/beta/state", "clock/beat/beta", "clock/from/beta"]
    assert heard.empty()


def test_a_certificate_lets_its_node_read_what_is_for_it_alone(guarded: Guarded) -> None:
    heard = hears(
        guarded.session("beta"), "world/truth/**", "veh/alpha/nav", "veh/beta/nav", "clock/time", "clock/to/beta"
    )

    def is_heard() -> bool:
        guarded.router.put(WALL_KEYS.topic("clock/to/beta"), b"x")
        return not heard.empty()

    assert until(is_heard)  # the router knows of the last subscription
    for key in ("world/truth/targets", "veh/alpha/nav", "veh/beta/nav", "clock/time"):
        guarded.router.put(WALL_KEYS.topic(key), b"x")
    keys = set()
    while "clock/time" not in keys:
        keys.add(heard.get(timeout=SOON_S))
    assert keys == {"clock/to/beta", "veh/beta/nav", "clock/time"}


def test_a_certificate_lets_its_process_live_under_its_own_name_alone(guarded: Guarded) -> None:
    lives: queue.SimpleQueue[str] = queue.SimpleQueue()

    def note(sample: zenoh.Sample) -> None:
        lives.put(str(sample.key_expr).removeprefix(WALL_KEYS.root))

    handler = zenoh.handlers.Callback(note, indirect=False)
    with guarded.router.liveliness().declare_subscriber(WALL_KEYS.life("*", "*"), handler, history=True):
        liveliness = guarded.session("beta").liveliness()
        tokens = [liveliness.declare_token(WALL_KEYS.life(host, "1")) for host in ("alpha", "beta")]
        assert lives.get(timeout=SOON_S) == "clock/alive/beta/1"
    assert len(tokens) == 2


def test_what_is_kept_is_told_to_those_who_may_read_it(guarded: Guarded) -> None:
    alpha = guarded.session("alpha")
    key = WALL_KEYS.topic("agent/alpha/state")
    alpha.declare_queryable(key, lambda query: query.reply(key, b"kept"))
    coordinator, beta = guarded.session("coordinator"), guarded.session("beta")

    def answers(asker: zenoh.Session) -> list[bytes]:
        return [reply.ok.payload.to_bytes() for reply in asker.get(key, timeout=SOON_S) if reply.ok is not None]

    assert until(lambda: answers(coordinator) == [b"kept"])
    assert answers(beta) == []


def test_nobody_answers_for_somebody_else(guarded: Guarded) -> None:
    beta = guarded.session("beta")
    for key in ("agent/alpha/state", "agent/beta/state"):
        full = WALL_KEYS.topic(key)
        beta.declare_queryable(full, lambda query: query.reply(query.key_expr, b"from beta"))
    coordinator = guarded.session("coordinator")

    def answers(key: str) -> list[bytes]:
        replies = coordinator.get(WALL_KEYS.topic(key), timeout=SOON_S)
        return [reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None]

    assert until(lambda: answers("agent/beta/state") == [b"from beta"])
    assert answers("agent/alpha/state") == []


def test_who_is_not_certified_by_the_authority_cannot_connect(guarded: Guarded, tmp_path: Path) -> None:
    others = make_certificates(tmp_path / "others", ["beta"], "127.0.0.1")
    for wrong in (others["beta"], None):
        with pytest.raises(ConnectionFailedError, match=r"^no connection to tls/127.0.0.1:\d+ within 0.5 s: nobody"):
            open_guest(guarded.endpoint, None, wrong, within_s=0.5)
    assert guarded.session("beta").info.routers_zid() == [guarded.router.info.zid()]


def test_a_certificate_that_is_over_connects_neither_way(tmp_path: Path) -> None:
    folder, begin = tmp_path / "certificates", datetime.now(UTC) - timedelta(days=3)
    certify(folder, {"router": ["127.0.0.1"], "beta": []}, begin, 10)
    certify(folder, {"late-router": ["127.0.0.1"], "late-beta": []}, begin, 1, add=True)
    beta, late_beta = files_of(folder, "beta"), files_of(folder, "late-beta")
    router, endpoint = open_router("tls/127.0.0.1:0", files_of(folder, "router"), None)
    with router:
        with pytest.raises(ConnectionFailedError):
            open_guest(endpoint, None, late_beta, within_s=0.5)
        with open_guest(endpoint, None, beta, within_s=SOON_S) as session:
            assert session.info.routers_zid() == [router.info.zid()]
    late_router, endpoint = open_router("tls/127.0.0.1:0", files_of(folder, "late-router"), None)
    with late_router, pytest.raises(ConnectionFailedError):
        open_guest(endpoint, None, beta, within_s=0.5)


def test_a_nodes_certificate_does_not_pass_for_the_routers(certificates: dict[str, Certificates]) -> None:
    router, endpoint = open_router("tls/127.0.0.1:0", certificates["alpha"], None)
    with router, pytest.raises(ConnectionFailedError):
        open_guest(endpoint, None, certificates["beta"], within_s=0.5)
