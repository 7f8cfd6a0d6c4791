"""The certificates of a fleet spread over hosts: an authority, and by it a certificate and a key for each node.

The one file that needs `cryptography`, of the extra `certificates`: it is to be imported where that is there.
"""

from __future__ import annotations

import contextlib
import ipaddress
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, load_pem_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from secondlook.errors import UserError
from secondlook.files import CannotWriteError, make_folder
from secondlook.scenario.vehicle import AUTHORITY

OF_OTHERS = 0o077
"""The bits of a folder's mode by which its group and others may look into it or change it."""
EARLIER = timedelta(days=1)
"""So long before they are made certificates are valid: the clock of a vehicle may be slow."""


@dataclass(frozen=True)
class Identity:
    """A certificate and the private key that belongs to it."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def certify(
    folder: Path, hosts: Mapping[str, Sequence[str]], now: datetime, days: int, *, add: bool = False
) -> datetime:
    """Makes an authority, and by it a certificate and a key for each name; returns until when they are valid.

    Args:
        folder: Where `NAME.pem` and `NAME.key` go, those of the authority as `ca`; new or empty, its owner's alone.
        hosts: For each name, another than that, which becomes the certificate's common name, the hosts and addresses
            for which it holds beside that: those at which others connect to it.
        now: With a time zone.
        days: How long they are valid, at least 1; with `add` no longer than the authority.
        add: By the authority that is in the folder.

    Raises:
        UserError: The folder is not as it is to be, or a file cannot be written. Nothing in the folder was changed
            then.
    """
    _prepare(folder, add)
    end = now + timedelta(days=days)
    if add:
        authority = _read_authority(folder)
        end = min(end, authority.certificate.not_valid_after_utc)
        if end <= now:
            raise UserError(
                f"--out {folder}: its authority was valid until {end:%Y-%m-%d}; a new one needs a folder of its own"
            )
    else:
        authority = _new_authority(now - EARLIER, end)
    made = {} if add else {AUTHORITY: authority}
    _write(folder, made | {name: _new_node(name, its, authority, now - EARLIER, end) for name, its in hosts.items()})
    return end


def _new_authority(begin: datetime, end: datetime) -> Identity:
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name("secondlook fleet")
    builder = (
        _builder(name, name, key, begin, end)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
    )
    return Identity(builder.sign(key, hashes.SHA256()), key)


def _new_node(name: str, hosts: Sequence[str], authority: Identity, begin: datetime, end: datetime) -> Identity:
    """Who has no hosts can connect with it, but not pass for one to whom others connect."""
    key = ec.generate_private_key(ec.SECP256R1())
    issuer = authority.certificate
    roles = [ExtendedKeyUsageOID.CLIENT_AUTH, *([ExtendedKeyUsageOID.SERVER_AUTH] if hosts else [])]
    known_by = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key())
    builder = (
        _builder(_name(name), issuer.subject, key, begin, end)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(roles), critical=False)
        .add_extension(known_by, critical=False)
    )
    if hosts:
        names = x509.SubjectAlternativeName([_alternative(host) for host in hosts])
        builder = builder.add_extension(names, critical=False)
    return Identity(builder.sign(authority.key, hashes.SHA256()), key)


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, begin: datetime, end: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder(subject_name=subject, issuer_name=issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begin.astimezone(UTC))
        .not_valid_after(end.astimezone(UTC))
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _prepare(folder: Path, add: bool) -> None:
    """A folder that keys may be written into; none is made for `add`. Raises UserError."""
    if not add:
        make_folder(folder, 0o700)
    try:
        mode = folder.stat().st_mode & 0o777
        taken = next(folder.iterdir(), None)
    except OSError as error:
        raise UserError(f"--out {folder}: {error.strerror}; must be a folder that can be written") from error
    if not add and taken is not None:
        raise UserError(
            f"--out {folder}: holds {taken.name} already; must be a new or empty folder, or go with --add, which makes "
            "what is missing by the authority there"
        )
    if mode & OF_OTHERS:  # also a new one, where the file system knows no rights
        raise UserError(
            f"--out {folder}: others than its owner may look into it (mode {mode:o}); must be its owner's alone, "
            "mode 700"
        )


def _read_authority(folder: Path) -> Identity:
    files = [folder / f"{AUTHORITY}{suffix}" for suffix in (".pem", ".key")]
    try:
        certificate_pem, key_pem = (file.read_bytes() for file in files)
    except OSError as error:
        raise UserError(
            f"--out {folder}: {error.strerror}: {error.filename}; --add needs the authority's {AUTHORITY}.pem and "
            f"{AUTHORITY}.key"
        ) from error
    with contextlib.suppress(ValueError, TypeError, UnsupportedAlgorithm):  # TypeError: of a key with a password
        certificate = x509.load_pem_x509_certificate(certificate_pem)
        key = load_pem_private_key(key_pem, password=None)
        if isinstance(key, ec.EllipticCurvePrivateKey) and key.public_key() == certificate.public_key():
            return Identity(certificate, key)
    raise UserError(
        f"--out {folder}: {AUTHORITY}.pem and {AUTHORITY}.key are no authority; must be a certificate and its private "
        "key, of an elliptic curve and without a password"
    )


def _write(folder: Path, made: Mapping[str, Identity]) -> None:
    """Writes all or nothing. A file that is there stays as it is; a key is its owner's alone from the first."""
    contents = {}
    for name, one in made.items():
        pem = one.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
        contents[folder / f"{name}.key"] = (pem, 0o600)
        contents[folder / f"{name}.pem"] = (one.certificate.public_bytes(Encoding.PEM), 0o644)
    written: list[Path] = []
    try:
        for path, (content, mode) in contents.items():
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
            written.append(path)
            with open(descriptor, "wb") as file:
                file.write(content)
    except BaseException as error:
        for file_of_ours in written:
            with contextlib.suppress(OSError):
                file_of_ours.unlink()
        if isinstance(error, OSError):
            raise UserError(f"--out {CannotWriteError(path, error)}") from error
        raise
