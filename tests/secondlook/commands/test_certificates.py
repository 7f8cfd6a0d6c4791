"""`secondlook certificates`: a fleet flies with what it makes and nobody else takes part; keys are their owner's alone,
nothing is overwritten, and what cannot be made is told in one sentence."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from functools import partial
from ipaddress import ip_address
from pathlib import Path

import pytest
from called import Call
from certificates import files_of, make_certificates, options
from cryptography import x509
from cryptography.x509.oid import NameOID
from flights import BRIEF
from spread import PATIENT, SpreadFleet, loopback_endpoint, spread_fleet

from secondlook.fleet.certificates import certify

BAY = Path(__file__).parents[3] / "examples" / "vehicle" / "bay.yaml"
OF_BRIEF = ["router", "world", "primary", "helper", "coordinator", "recorder"]
HERE = ("--host", "127.0.0.1")
NOW = datetime(2026, 7, 1, 12, tzinfo=UTC)


@pytest.fixture
def command(called: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Call:
    """`secondlook certificates` in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return partial(called, "certificates")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def certificate(path: Path) -> x509.Certificate:
    return x509.load_pem_x509_certificate(path.read_bytes())


def common_name(one: x509.Certificate) -> str | bytes:
    (name,) = one.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return name.value


def alternatives(one: x509.Certificate) -> list[x509.GeneralName]:
    return list(one.extensions.get_extension_for_class(x509.SubjectAlternativeName).value)


def test_a_fleet_flies_with_them_and_nobody_takes_part_with_anything_else(command: Call, tmp_path: Path) -> None:
    assert command(BRIEF, "--out", "own", *HERE)[0] == 0
    stranger = make_certificates(tmp_path / "others", ["coordinator"], "127.0.0.1")["coordinator"]
    endpoint = loopback_endpoint().replace("tcp/", "tls/")

    def node(fleet: SpreadFleet, *role: str) -> None:
        fleet.node(*role, more=options(files_of(tmp_path / "own", role[-1])))

    with spread_fleet(tmp_path, endpoint, *PATIENT) as fleet:
        fleet.router(40, *options(files_of(tmp_path / "own", "router")))
        for role in (("world",), ("agent", "primary"), ("agent", "helper"), ("recorder",)):
            node(fleet, *role)
        assert all(fleet.started["router"].says(f"{name} is here") for name in ("world", "primary", "recorder"))
        helpers = options(files_of(tmp_path / "own", "helper"))
        refused = fleet.node("coordinator", name="stranger", more=[*options(stranger), "--wait", "2"])
        unheard = fleet.node("coordinator", name="false", more=[*helpers, "--wait", "5"])
        assert (refused.ends(), unheard.ends()) == (2, 2)
        assert refused.said == (
            f"no connection to {endpoint} within 2 s: nobody listens there, or it does not accept our certificate, "
            "or we not its\n"
        )
        assert unheard.said == (
            "no answer from the router to coordinator in run brief: the run there may be another, or the name in the "
            "certificate\n"
        )
        assert "coordinator is here" not in fleet.started["router"].said
        node(fleet, "coordinator")
        assert {name: fleet.started[name].ends() for name in OF_BRIEF} == dict.fromkeys(OF_BRIEF, 0)
        assert fleet.summary["ending"] == "over"
        assert fleet.summary["hotspots"]["revisited"] > 0


def test_every_node_has_one_that_the_authority_signed_in_its_name(command: Call) -> None:
    hosts = ("192.0.2.1", "ship.example", "[2001:db8::1]", "helper=192.0.2.7")
    before = datetime.now(UTC).replace(microsecond=0)
    code, out, err = command(BAY, "--out", "own", "--days", "30", *(word for one in hosts for word in ("--host", one)))
    assert (code, err) == (0, "")
    assert out.startswith(
        "own: certificates and keys of router, world, primary, helper, coordinator, recorder, helper-body, valid until "
    )
    names = [*OF_BRIEF, "helper-body"]
    assert contents(Path("own")).keys() == {f"{name}{suffix}" for name in ("ca", *names) for suffix in (".pem", ".key")}
    authority = certificate(Path("own/ca.pem"))
    for name in names:
        one = certificate(Path(f"own/{name}.pem"))
        one.verify_directly_issued_by(authority)
        assert common_name(one) == name
        assert before - timedelta(days=1) <= one.not_valid_before_utc <= datetime.now(UTC) - timedelta(days=1)
        assert one.not_valid_after_utc - one.not_valid_before_utc == timedelta(days=31)
    assert alternatives(certificate(Path("own/router.pem"))) == [
        x509.IPAddress(ip_address("192.0.2.1")), x509.DNSName("ship.example"), x509.IPAddress(ip_address("2001:db8::1"))
    ]  # fmt: skip
    assert alternatives(certificate(Path("own/helper.pem"))) == [x509.IPAddress(ip_address("192.0.2.7"))]
    with pytest.raises(x509.ExtensionNotFound):
        alternatives(certificate(Path("own/world.pem")))


def test_a_key_is_its_owners_alone_from_the_first_whatever_the_umask(
    command: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("rights were changed after a file was made")

    for name in ("chmod", "fchmod"):
        monkeypatch.setattr(os, name, refuse)
    before = os.umask(0)
    try:
        code, _, err = command(BRIEF, "--out", "own", *HERE)
    finally:
        os.umask(before)
    assert (code, err) == (0, "")
    assert Path("own").stat().st_mode & 0o777 == 0o700
    modes = {path.name: path.stat().st_mode & 0o777 for path in Path("own").iterdir()}
    names = ("ca", *OF_BRIEF)
    assert modes == {f"{name}.key": 0o600 for name in names} | {f"{name}.pem": 0o644 for name in names}


def test_a_folder_that_others_may_look_into_is_refused(command: Call) -> None:
    Path("own").mkdir()
    Path("own").chmod(0o755)
    assert command(BRIEF, "--out", "own", *HERE) == (
        2, "", "--out own: others than its owner may look into it (mode 755); must be its owner's alone, mode 700\n"
    )  # fmt: skip
    assert contents(Path("own")) == {}


def test_nothing_is_overwritten(command: Call) -> None:
    command(BRIEF, "--out", "own", *HERE)
    before = contents(Path("own"))
    code, out, err = command(BRIEF, "--out", "own", *HERE)
    assert (code, out) == (2, "")
    assert re.fullmatch(
        r"--out own: holds \S+ already; must be a new or empty folder, or go with --add, which makes what is missing "
        r"by the authority there\n",
        err,
    )
    assert command(BRIEF, "--out", "own", "--add") == (0, "own: every node of brief has a certificate\n", "")
    assert contents(Path("own")) == before


def test_what_is_missing_is_added_by_the_same_authority_and_valid_no_longer(command: Call) -> None:
    command(BRIEF, "--out", "own", *HERE, "--days", "30")
    before = contents(Path("own"))
    primary, helper = BRIEF.read_text().split("  helper:\n")
    Path("more.yaml").write_text(f"{primary}  helper:\n{helper}  second:\n{helper}")
    code, out, err = command("more.yaml", "--out", "own", "--add", "--days", "60")
    assert (code, err) == (0, "")
    assert out.startswith("own: certificates and keys of second, valid until ")
    after = contents(Path("own"))
    assert {name: after.pop(name) for name in before} == before
    assert after.keys() == {"second.pem", "second.key"}
    one, authority = certificate(Path("own/second.pem")), certificate(Path("own/ca.pem"))
    one.verify_directly_issued_by(authority)
    assert common_name(one) == "second"
    assert one.not_valid_after_utc == authority.not_valid_after_utc


def test_where_half_a_pair_is_missing_nothing_is_written(command: Call) -> None:
    command(BRIEF, "--out", "own", *HERE)
    for name in ("world.pem", "world.key", "helper.pem"):
        Path("own", name).unlink()
    before = contents(Path("own"))
    assert command(BRIEF, "--out", "own", "--add") == (
        2, "", "own/helper.pem: is missing or empty; helper must have both its files or, for new ones, neither\n"
    )  # fmt: skip
    assert contents(Path("own")) == before


@pytest.mark.parametrize("name", ["router.key", "router.pem"])
def test_an_empty_file_is_no_half_of_a_pair(command: Call, name: str) -> None:
    command(BRIEF, "--out", "own", *HERE)
    Path("own", name).write_bytes(b"")
    assert command(BRIEF, "--out", "own", "--add") == (
        2, "", f"own/{name}: is missing or empty; router must have both its files or, for new ones, neither\n"
    )  # fmt: skip


def test_a_host_of_one_that_has_its_certificate_is_refused(command: Call) -> None:
    command(BRIEF, "--out", "own", *HERE)
    for name in ("world.pem", "world.key"):
        Path("own", name).unlink()
    assert command(BRIEF, "--out", "own", "--add", *HERE) == (
        2, "", "--host 127.0.0.1: router has its certificate already\n"
    )  # fmt: skip


NO_AUTHORITY = (
    "--out own: ca.pem and ca.key are no authority; must be a certificate and its private key, of an elliptic curve "
    "and without a password\n"
)


@pytest.mark.parametrize(("file", "content"), [("ca.pem", "senseless"), ("ca.key", "senseless"), ("ca.key", None)])
def test_an_authority_that_is_none_is_refused(command: Call, file: str, content: str | None) -> None:
    command(BRIEF, "--out", "own", *HERE)
    for name in ("world.pem", "world.key"):
        Path("own", name).unlink()
    Path("own", file).write_text(content or Path("own/helper.key").read_text())
    assert command(BRIEF, "--out", "own", "--add") == (2, "", NO_AUTHORITY)
    Path("own", file).unlink()
    assert command(BRIEF, "--out", "own", "--add") == (
        2,
        "",
        f"--out own: No such file or directory: own/{file}; --add needs the authority's ca.pem and ca.key\n",
    )


def test_an_authority_that_is_over_adds_nothing(command: Call, tmp_path: Path) -> None:
    own = Path("own")
    assert certify(own, {"router": ["127.0.0.1"]}, NOW, 10) == NOW + timedelta(days=10)
    before = contents(own)
    code, out, err = command(BRIEF, "--out", "own", "--add")
    assert (code, out, err) == (
        2, "", "--out own: its authority was valid until 2026-07-11; a new one needs a folder of its own\n"
    )  # fmt: skip
    assert contents(own) == before


WITHOUT = """
import sys
sys.modules["cryptography"] = None
from secondlook.installed_command import main
main()
"""


def test_without_the_extra_one_sentence_names_it(tmp_path: Path) -> None:
    arguments = ["certificates", str(BRIEF), "--out", "own", *HERE]
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr) == (
        2,
        "",
        "secondlook certificates needs cryptography, not installed here; the extra secondlook[certificates] has it\n",
    )
    assert list(tmp_path.iterdir()) == []
