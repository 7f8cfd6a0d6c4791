"""Opening Zenoh sessions for a fleet whose nodes are started one by one, on one host or on several."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh

from comms.session import LARGEST_MESSAGE_BYTES, ConnectionFailedError, set_config

LEASE_S = 4.0  # a link of which nothing is heard for so long, not even a sign of life, is given up
BLOCK_S = 1.0  # so long a message waits for a link that takes nothing, before that is given up
DROP_S = 0.02  # so long what may be left out waits for room: on a busy machine it takes a while to be made
RETRY_S = (0.2, 1.0)  # a lost link is tried again after the first of these, in the end every second one


@dataclass(frozen=True, slots=True)
class Certificates:
    """Files of this process for TLS: who is trusted, and with what it proves who it is, to both sides alike."""

    authority: Path
    certificate: Path
    key: Path


def open_router(
    endpoint: str, certificates: Certificates | None, access_control: dict[str, Any] | None
) -> tuple[zenoh.Session, str]:
    """A session through which all others speak, and the endpoint it listens on, which tells a port that the system
    picked. Raises ConnectionFailedError where it cannot listen there."""
    config = _config("router", certificates, listen=[endpoint])
    if access_control is not None:
        set_config(config, "access_control", access_control)
    session = _open(config, lambda cause: f"cannot listen on {endpoint}: {cause}")
    for reply in session.get(f"@/{session.info.zid()}/router"):
        if reply.ok is not None:
            return session, str(json.loads(reply.ok.payload.to_bytes())["locators"][0])
    session.close()  # type: ignore[no-untyped-call]
    raise ConnectionFailedError(f"the router at {endpoint} does not say where it listens")


def open_guest(
    connect: str, listen: str | None, certificates: Certificates | None, *, within_s: float
) -> zenoh.Session:
    """A session that speaks through the router at `connect`, and connects again whenever that link is lost. With
    `listen` others may speak through it in turn: so what is on one vehicle goes on talking without the router.

    Raises ConnectionFailedError where there is no router that lets it in within so many seconds, or it cannot listen.
    """
    config = _config(
        "client" if listen is None else "router", certificates, connect, [] if listen is None else [listen]
    )
    set_config(config, "connect/timeout_ms", round(within_s * 1000))
    set_config(config, "connect/exit_on_failure", True)
    return _open(config, lambda cause: _why(connect, listen, cause, within_s))


def _why(connect: str, listen: str | None, cause: str, within_s: float) -> str:
    if listen is not None and "listener" in cause:
        return f"cannot listen on {listen}: {cause}"
    hint = ", or it does not accept our certificate, or we not its" if connect.startswith("tls/") else ""
    return f"no connection to {connect} within {within_s:g} s: nobody listens there{hint}"


def _open(config: zenoh.Config, sentence: Callable[[str], str]) -> zenoh.Session:
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise ConnectionFailedError(sentence(_cause(str(error)))) from error


def _cause(error: str) -> str:
    """What the system says, without the path of Zenoh's sources."""
    for known in ("Address already in use", "Cannot assign requested address", "Permission denied"):
        if known in error:
            return known.lower()
    return error.split(" at /", maxsplit=1)[0]


def _config(
    mode: str, certificates: Certificates | None, connect: str | None = None, listen: list[str] | None = None
) -> zenoh.Config:
    config = zenoh.Config()
    first_s, most_s = RETRY_S
    settings: dict[str, Any] = {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,
        "listen/endpoints": listen or [],
        "connect/endpoints": [] if connect is None else [connect],
        "connect/retry": {
            "period_init_ms": round(first_s * 1000), "period_max_ms": round(most_s * 1000), "period_increase_factor": 2,
        },
        "adminspace": {"enabled": mode == "router", "permissions": {"read": True, "write": False}},
        "transport/shared_memory/enabled": False,
        "transport/link/rx/max_message_size": LARGEST_MESSAGE_BYTES,
        "transport/link/tx/lease": round(LEASE_S * 1000),
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": round(DROP_S * 1e6),
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
    for path, value in settings.items():
        set_config(config, path, value)
    return config
