"""Certificates for tests, made as `secondlook certificates` makes them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from comms.session import Certificates
from secondlook.fleet.certificates import certify


def make_certificates(folder: Path, names: Sequence[str], address: str) -> dict[str, Certificates]:
    """Certificates of one authority, by name, in a new folder; the router's holds for `address`."""
    certify(folder, {name: [address] if name == "router" else [] for name in names}, datetime.now(UTC), 1)
    return {name: files_of(folder, name) for name in names}


def files_of(folder: Path, name: str) -> Certificates:
    """The files of one name in the folder of an authority."""
    return Certificates(folder / "ca.pem", folder / f"{name}.pem", folder / f"{name}.key")


def options(one: Certificates) -> list[str]:
    """The same on the command line."""
    return ["--tls-ca", str(one.authority), "--tls-cert", str(one.certificate), "--tls-key", str(one.key)]
