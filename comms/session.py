"""Opening Zenoh sessions, and what is done with one.

Within one host, `secondlook run`: a hub on a loopback port that the system picks, everyone else as its client, by user
name and password. For nodes that are started one by one, on one host or on several: a router at an endpoint, everyone
else as its guest, over TLS or in the clear.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh

from comms.errors import ConnectionFailedError

CONNECT_TIMEOUT_S = 10.0
PATIENCE_S = 60.0
SIGN_OF_LIFE_EVERY_S = 0.5  # so often a hub says that it is alive
LARGEST_MESSAGE_BYTES = 4 << 20
PACKET_BYTES = 8 << 10  # each has its memory cleared before it is received, however little comes
MOST_PACKETS = 16  # that may wait to be sent; the most there may be
MOST_MAIL = 1 << 14  # that may wait in a mailbox, each holding a packet
MOST_AT_THE_DOOR = 1000  # connections that have not proved yet who they are; each is a file to the system
AT_THE_DOOR_S = 3.0  # so long they may take: whoever is of the fleet tries again, for longer than this
LEASE_PATIENCE = 10.0  # times the patience: so long a fleet on one host may be stopped, and goes on
LEASE_S = 4.0  # on several hosts: a link of which nothing is heard for so long, not even a sign of life, is given up
BLOCK_S = 1.0  # so long a message waits for a link that takes nothing, before that is given up
DROP_S = 0.1  # so long what may be left out waits for room: on a busy machine it takes a while to be made
RETRY_S = (0.2, 1.0)  # a lost link is tried again after the first of these, in the end every second one


@dataclass(frozen=True, slots=True)
class Certificates:
    """Files of this process for TLS: who is trusted, and with what it proves who it is, to both sides alike."""

    authority: Path
    certificate: Path
    key: Path


def open_hub(
    users: Mapping[str, str], access_control: dict[str, Any] | None, *, patience_s: float = PATIENCE_S
) -> tuple[zenoh.Session, str]:
    """A session that routes for all others, and the endpoint it listens on.

    `users`: a password for each user name that may connect. Only loopback is listened on. `patience_s`: see
    `_on_one_host`.
    """
    with tempfile.TemporaryDirectory(prefix="secondlook-") as folder:
        passwords = Path(folder) / "users"
        with open(os.open(passwords, os.O_WRONLY | os.O_CREAT, 0o600), "w") as file:
            file.writelines(f"{name}:{password}\n" for name, password in users.items())
        settings = _on_one_host("router", patience_s, listen=["tcp/127.0.0.1:0"]) | {
            "transport/auth/usrpwd/dictionary_file": str(passwords)
        }
        session = zenoh.open(_config(settings, access_control))
    return session, _listening_at(session, "the hub does not say which port it listens on")


def open_client(
    endpoint: str,
    user: str,
    password: str,
    *,
    connect_timeout_s: float = CONNECT_TIMEOUT_S,
    patience_s: float = PATIENCE_S,
) -> zenoh.Session:
    """A session that speaks through the hub at `endpoint`; raises ConnectionFailedError where there is none, or none
    that lets `user` in with `password`. `patience_s`: see `_on_one_host`."""
    settings = _on_one_host("client", patience_s, connect=[endpoint]) | {
        "connect/timeout_ms": round(connect_timeout_s * 1000),
        "transport/auth/usrpwd/user": user,
        "transport/auth/usrpwd/password": password,
    }
    return _open(_config(settings), lambda cause: f"no connection to the hub at {endpoint} as {user}")


def open_router(
    endpoint: str, certificates: Certificates | None, access_control: dict[str, Any] | None
) -> tuple[zenoh.Session, str]:
    """A session through which all others speak, and the endpoint it listens on, which tells a port that the system
    picked. Raises ConnectionFailedError where it cannot listen there."""
    config = _config(_on_several_hosts("router", certificates, listen=[endpoint]), access_control)
    session = _open(config, lambda cause: f"cannot listen on {endpoint}: {cause}")
    return session, _listening_at(session, f"the router at {endpoint} does not say where it listens")


def open_guest(
    connect: str, listen: str | None, certificates: Certificates | None, *, within_s: float
) -> zenoh.Session:
    """A session that speaks through the router at `connect`, and connects again whenever that link is lost. With
    `listen` others may speak through it in turn: so what is on one vehicle goes on talking without the router.

    Raises ConnectionFailedError where there is no router that lets it in within so many seconds, or it cannot listen.
    """
    mode, listens = ("client", []) if listen is None else ("router", [listen])
    settings = _on_several_hosts(mode, certificates, listen=listens, connect=[connect]) | {
        "connect/timeout_ms": round(within_s * 1000),
        "connect/exit_on_failure": True,
    }

    def why(cause: str) -> str:
        if listen is not None and "listener" in cause:
            return f"cannot listen on {listen}: {cause}"
        hint = ", or it does not accept our certificate, or we not its" if connect.startswith("tls/") else ""
        return f"no connection to {connect} within {within_s:g} s: nobody listens there{hint}"

    return _open(_config(settings), why)


def read_where_packets_are_awaited() -> None:
    """Lets the thread that waits for packets read them, where else it wakes another one for each. To be called before
    the first session, in a process that holds nothing but a client: where it held the hub too, that would keep itself
    from reading when it waits for its own client."""
    os.environ.setdefault("ZENOH_RUNTIME", "(rx: (handover: app))")


def put(session: zenoh.Session, key: str, payload: bytes, *, at_once: bool = True, away_only: bool = False) -> None:
    """Publishes reliably. No declared publisher: one would drop what it sends before it has heard of a subscriber,
    while a plain put always goes to the hub.

    `at_once`: whether it goes out in a packet of its own, with what still waits before it. What is not may share its
    packet with what is put right after it, and so what a packet costs its receiver: most of what a message costs.
    `away_only`: whether it does not come to who subscribes to it by the same session."""
    session.put(
        key,
        payload,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=zenoh.Priority.REAL_TIME,
        express=at_once,
        allowed_destination=zenoh.Locality.REMOTE if away_only else zenoh.Locality.ANY,
    )


def subscribe(
    session: zenoh.Session, expressions: Iterable[str], handler: Callable[[str, bytes], None]
) -> list[zenoh.Subscriber[None]]:
    """Subscribes to all expressions; `handler(key, payload)` runs on the network's thread and must only enqueue.

    An expression that another one includes is left out, so that no message comes twice.
    """

    def forward(sample: zenoh.Sample) -> None:
        handler(str(sample.key_expr), sample.payload.to_bytes())

    return [
        session.declare_subscriber(one, zenoh.handlers.Callback(forward, indirect=False))
        for one in _needed(expressions)
    ]


class Mailbox:
    """Subscribes to all expressions and keeps what comes until it is fetched: of a message that waits there no thread
    of Python is woken, which costs more than the rest of receiving it.

    An expression that another one includes is left out. What waits holds the whole packet that it came in, and a
    mailbox that is full holds up all that comes to the session: it is to be emptied from time to time.
    """

    def __init__(self, session: zenoh.Session, expressions: Iterable[str]) -> None:
        self._subscribers = [
            session.declare_subscriber(one, zenoh.handlers.FifoChannel(MOST_MAIL)) for one in _needed(expressions)
        ]

    def fetch(self) -> Iterator[tuple[str, bytes]]:
        """Key and payload of what has come, of each expression in the order of arrival; then it is gone from here."""
        for one in self._subscribers:
            while (sample := one.try_recv()) is not None:
                yield str(sample.key_expr), sample.payload.to_bytes()


def _needed(expressions: Iterable[str]) -> list[zenoh.KeyExpr]:
    wanted = [zenoh.KeyExpr(one) for one in dict.fromkeys(expressions)]
    return [one for one in wanted if not any(other != one and other.includes(one) for other in wanted)]


def _on_one_host(
    mode: str, patience_s: float, *, listen: Iterable[str] = (), connect: Iterable[str] = ()
) -> dict[str, Any]:
    """Settings. `patience_s`: wall time for which a put waits for one that takes nothing. An end of the process is
    noticed at once; one that is silent the hub gives up, as it knows whether it was itself awake. A link outlasts
    that."""
    return _basic(mode, listen, connect) | {
        "transport/link/tx/lease": round(LEASE_PATIENCE * patience_s * 1000),
        "transport/link/tx/batch_size": PACKET_BYTES,
        "transport/link/tx/queue/size/real_time": MOST_PACKETS,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": round(patience_s * 1e6),
    }


def _on_several_hosts(
    mode: str, certificates: Certificates | None, *, listen: Iterable[str] = (), connect: Iterable[str] = ()
) -> dict[str, Any]:
    settings: dict[str, Any] = _basic(mode, listen, connect) | {
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,
        "transport/link/tx/lease": round(LEASE_S * 1000),
        "transport/link/tx/queue/congestion_control/block/wait_before_close": round(BLOCK_S * 1e6),
    }  # fmt: skip
    if certificates is not None:
        authority, certificate, key = map(str, (certificates.authority, certificates.certificate, certificates.key))
        settings["transport/link/tls"] = {
            "root_ca_certificate": authority,
            "enable_mtls": True,
            "listen_certificate": certificate,
            "listen_private_key": key,
            "connect_certificate": certificate,
            "connect_private_key": key,
            "verify_name_on_connect": True,
        }
    return settings


def _basic(mode: str, listen: Iterable[str], connect: Iterable[str]) -> dict[str, Any]:
    first_s, most_s = RETRY_S
    router = {"scouting/delay": 0, "adminspace": {"enabled": True, "permissions": {"read": True, "write": False}}}
    return {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "listen/endpoints": list(listen),  # always: a router listens on all interfaces by default
        "connect/endpoints": list(connect),
        "connect/retry": {
            "period_init_ms": round(first_s * 1000), "period_max_ms": round(most_s * 1000), "period_increase_factor": 2,
        },
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": round(DROP_S * 1e6),
        "transport/shared_memory/enabled": False,  # a killed process would leave segments behind
        "transport/link/rx/max_message_size": LARGEST_MESSAGE_BYTES,
        "transport/unicast/accept_pending": MOST_AT_THE_DOOR,
        "transport/unicast/accept_timeout": round(AT_THE_DOOR_S * 1000),
        **(router if mode == "router" else {}),
    }  # fmt: skip


def _config(settings: Mapping[str, Any], access_control: dict[str, Any] | None = None) -> zenoh.Config:
    config = zenoh.Config()
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    if access_control is not None:
        config.insert_json5("access_control", json.dumps(access_control))
    return config


def _open(config: zenoh.Config, sentence: Callable[[str], str]) -> zenoh.Session:
    """Opens a session; raises ConnectionFailedError with the sentence for what the system says, without the path of
    Zenoh's sources."""
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        told = str(error)
        known = ("Address already in use", "Cannot assign requested address", "Permission denied")
        cause = next((one.lower() for one in known if one in told), told.split(" at /", maxsplit=1)[0])
        raise ConnectionFailedError(sentence(cause)) from error


def _listening_at(session: zenoh.Session, failure: str) -> str:
    """The endpoint that a session listens on: its own admin space is where the port that the system picked can be
    read."""
    for reply in session.get(f"@/{session.info.zid()}/router"):
        if reply.ok is not None:
            return str(json.loads(reply.ok.payload.to_bytes())["locators"][0])
    session.close()  # type: ignore[no-untyped-call]
    raise ConnectionFailedError(failure)
