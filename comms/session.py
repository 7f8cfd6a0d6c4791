"""Opening Zenoh sessions: the hub on a loopback port that the system picks, everyone else as its client."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import zenoh

CONNECT_TIMEOUT_S = 10.0
PATIENCE_S = 60.0
LARGEST_MESSAGE_BYTES = 4 << 20
PACKET_BYTES = 8 << 10  # each has its memory cleared before it is received, however little comes
MOST_PACKETS = 16  # that may wait to be sent; the most there may be
MOST_MAIL = 1 << 20


class ConnectionFailedError(Exception):
    """A session that could not be opened; the text is one sentence."""


def open_hub(
    users: Mapping[str, str], access_control: dict[str, Any] | None, *, patience_s: float = PATIENCE_S
) -> tuple[zenoh.Session, str]:
    """A session that routes for all others, and the endpoint it listens on.

    `users`: a password for each user name that may connect. Only loopback is listened on. `patience_s`: see `_config`.
    """
    with tempfile.TemporaryDirectory(prefix="secondlook-") as folder:
        passwords = Path(folder) / "users"
        with open(os.open(passwords, os.O_WRONLY | os.O_CREAT, 0o600), "w") as file:
            file.writelines(f"{name}:{password}\n" for name, password in users.items())
        config = _config("router", patience_s, listen=["tcp/127.0.0.1:0"])
        set_config(config, "scouting/delay", 0)
        set_config(config, "adminspace", {"enabled": True, "permissions": {"read": True, "write": False}})
        set_config(config, "transport/auth/usrpwd/dictionary_file", str(passwords))
        if access_control is not None:
            set_config(config, "access_control", access_control)
        session = zenoh.open(config)
    # The session's own admin space is where the port that the system picked can be read.
    for reply in session.get(f"@/{session.info.zid()}/router"):
        if reply.ok is not None:
            return session, str(json.loads(reply.ok.payload.to_bytes())["locators"][0])
    session.close()  # type: ignore[no-untyped-call]
    raise ConnectionFailedError("the hub does not say which port it listens on")


def open_client(
    endpoint: str,
    user: str,
    password: str,
    *,
    connect_timeout_s: float = CONNECT_TIMEOUT_S,
    patience_s: float = PATIENCE_S,
) -> zenoh.Session:
    """A session that speaks through the hub at `endpoint`; raises ConnectionFailedError where there is none, or none
    that lets `user` in with `password`. `patience_s`: see `_config`."""
    config = _config("client", patience_s, connect=[endpoint])
    set_config(config, "connect/timeout_ms", round(connect_timeout_s * 1000))
    set_config(config, "transport/auth/usrpwd/user", user)
    set_config(config, "transport/auth/usrpwd/password", password)
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise ConnectionFailedError(f"no connection to the hub at {endpoint} as {user}") from error


def read_where_packets_are_awaited() -> None:
    """Lets the thread that waits for packets read them, where else it wakes another one for each. To be called before
    the first session, in a process that holds nothing but a client: where it held the hub too, that would keep itself
    from reading when it waits for its own client."""
    os.environ.setdefault("ZENOH_RUNTIME", "(rx: (handover: app))")


def put(session: zenoh.Session, key: str, payload: bytes, *, at_once: bool = True) -> None:
    """Publishes reliably. No declared publisher: one would drop what it sends before it has heard of a subscriber,
    while a plain put always goes to the hub.

    `at_once`: whether it goes out in a packet of its own, with what still waits before it. What is not may share its
    packet with what is put right after it, and so what a packet costs its receiver: most of what a message costs."""
    session.put(
        key,
        payload,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=zenoh.Priority.REAL_TIME,
        express=at_once,
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
    """Subscribes to all expressions and keeps what comes until it is taken: of a message that waits there no thread of
    Python is woken, which costs more than the rest of receiving it.

    An expression that another one includes is left out. What waits holds the whole packet that it came in, and a
    mailbox that is full holds up all that comes to the session: it is to be emptied from time to time.
    """

    def __init__(self, session: zenoh.Session, expressions: Iterable[str]) -> None:
        self._subscribers = [
            session.declare_subscriber(one, zenoh.handlers.FifoChannel(MOST_MAIL)) for one in _needed(expressions)
        ]

    def take(self) -> Iterator[tuple[str, bytes]]:
        """Key and payload of what has come, of each expression in the order of arrival; then it is gone from here."""
        for one in self._subscribers:
            while (sample := one.try_recv()) is not None:
                yield str(sample.key_expr), sample.payload.to_bytes()


def _needed(expressions: Iterable[str]) -> list[zenoh.KeyExpr]:
    wanted = [zenoh.KeyExpr(one) for one in dict.fromkeys(expressions)]
    return [one for one in wanted if not any(other != one and other.includes(one) for other in wanted)]


def _config(mode: str, patience_s: float, *, listen: Iterable[str] = (), connect: Iterable[str] = ()) -> zenoh.Config:
    """`patience_s`: wall time after which the other side gives up a session from which nothing comes, not even a sign
    of life, and for which a put waits for one that takes nothing. An end of the process is noticed at once."""
    config = zenoh.Config()
    set_config(config, "mode", mode)
    set_config(config, "scouting/multicast/enabled", False)
    set_config(config, "listen/endpoints", list(listen))  # always: a router listens on all interfaces by default
    set_config(config, "connect/endpoints", list(connect))
    set_config(config, "transport/shared_memory/enabled", False)  # a killed process would leave segments behind
    set_config(config, "transport/link/rx/max_message_size", LARGEST_MESSAGE_BYTES)
    set_config(config, "transport/link/tx/lease", round(patience_s * 1000))
    set_config(config, "transport/link/tx/batch_size", PACKET_BYTES)
    set_config(config, "transport/link/tx/queue/size/real_time", MOST_PACKETS)
    block_us = round(patience_s * 1e6)
    set_config(config, "transport/link/tx/queue/congestion_control/block/wait_before_close", block_us)
    return config


def set_config(config: zenoh.Config, path: str, value: Any) -> None:
    """Sets one key of a configuration."""
    config.insert_json5(path, json.dumps(value))
