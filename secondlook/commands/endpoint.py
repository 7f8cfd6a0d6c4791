"""Where a node of a fleet listens or connects to, and whether that is safe."""

from __future__ import annotations

import ipaddress
import re
from pathlib import Path

from comms.wall.session import Certificates
from secondlook.errors import UserError

_FORM = re.compile(r"(?P<protocol>tcp|tls)/(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):(?P<port>[0-9]{1,5})")
LARGEST_PORT = 65_535


def check_endpoint(option: str, endpoint: str, *, insecure: bool, any_port: bool = False) -> None:
    """Raises UserError for what is no endpoint, and for one that leaves this host in the clear without `insecure`.

    `any_port`: port 0 stands for one that the system picks.
    """
    match = _FORM.fullmatch(endpoint)
    if match is None or not (0 if any_port else 1) <= int(match["port"]) <= LARGEST_PORT:
        raise UserError(f"{option} {endpoint}: is no endpoint; must be tcp/HOST:PORT or tls/HOST:PORT")
    if match["protocol"] == "tcp" and not insecure and not _is_loopback(match["host"].strip("[]")):
        raise UserError(
            f"{option} {endpoint}: leaves this host, where anyone could listen and take part; must be a tls endpoint, "
            "or go with --insecure"
        )


def certificates(endpoints: list[str], authority: Path | None, certificate: Path | None, key: Path | None) -> (
    Certificates | None
):  # fmt: skip
    """The certificates for these endpoints, None where no tls is among them; UserError where they do not fit."""
    given = {"--tls-ca": authority, "--tls-cert": certificate, "--tls-key": key}
    if not any(endpoint.startswith("tls/") for endpoint in endpoints):
        useless = next((option for option, path in given.items() if path is not None), None)
        if useless is not None:
            raise UserError(f"{useless}: is for a tls endpoint, which {' and '.join(endpoints)} is not")
        return None
    for option, path in given.items():
        if path is None:
            raise UserError(f"{option}: is missing, which a tls endpoint needs")
        try:
            path.read_bytes()
        except OSError as error:
            raise UserError(f"{option} {path}: {error.strerror}; must be a PEM file") from error
    assert authority is not None
    assert certificate is not None
    assert key is not None
    return Certificates(authority, certificate, key)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
