"""The table of what storms are to try sometimes holds each branch that meets a fault, as far as they can be counted."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from comms.lockstep.faults import FaultKind
from comms.said.messages import StripState, TaskAction, TaskState
from coordinator.ledger import ALLOWED
from secondlook.storm.sometimes import DISK_FULL, LOGGED, REASONS, REFUSALS, SOMETIMES, WHYS
from secondlook.testing.plan import KINDS

ROOT = Path(__file__).parents[3]

OUT_OF_REACH = {
    "another run": "a storm has one run",
    " failed: ": "no vehicle refuses a manoeuvre of our agents, and what they leave at the end nobody hears",
    "no position yet": "who is started anew is given the last position first",
    "that is no strip": "a coordinator of ours offers none",
    "it lies outside the area": "a coordinator of ours offers none",
    "dropped a message from {}: {} (said once)": "a tile that fits no grid: no agent of ours tells of one",
    "{}: dropped a look that makes no sense (said once)": "no sonar of ours tells of one",
    "{} cannot be pickled ({}): whoever takes it up has to handle again all that it has handled": "no files are kept",
    "frames of the modem on {} are not sent: a packet has at most {}, of at most {} bits (said once)": "no link",
    "modem of {}: {}: {} (said once)": "no link is flown",
    "{} has failed": "then the storm has failed",
    "unknown key": "nobody writes one within one process",
    "too long": "nobody writes one within one process",
    "wrong sender": "nobody writes one within one process",
}
"""What is in the sources and not in the table, and why storms cannot come there."""
SAID_OTHERWISE = ("its coordinator is gone", "left when the mission was over: ")


def texts(path: str, within: str = "") -> Iterator[str]:
    """What a source says in words, with {} for what is filled in: all but docstrings and names, in functions whose
    source holds `within`."""
    tree = ast.parse((ROOT / path).read_text())
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        if isinstance(node.body[0], ast.Expr)
    }
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        if within in ast.unparse(function):
            parts = {id(part) for node in ast.walk(function) if isinstance(node, ast.JoinedStr) for part in node.values}
            for node in ast.walk(function):
                if isinstance(node, ast.JoinedStr):
                    yield "".join(str(one.value) if isinstance(one, ast.Constant) else "{}" for one in node.values)
                elif (
                    isinstance(node, ast.Constant)
                    and isinstance(node.value, str)
                    and id(node) not in docstrings | parts
                ):
                    yield node.value


def in_words(found: Iterator[str]) -> list[str]:
    return sorted({one for one in found if " " in one.replace("{}", "").strip(" :")})


def is_held(text: str, fragments: list[str]) -> bool:
    return any(one.strip(" :,") in text for one in fragments) or any(one in text for one in OUT_OF_REACH)


def test_each_reason_of_a_change_of_a_strip_is_in_the_table() -> None:
    said = in_words(texts("coordinator/strip_life.py"))
    assert len(said) > 12
    assert [one for one in said if not is_held(one, list(REASONS.values()))] == []
    everything = " ".join(texts("coordinator/strip_life.py"))
    assert [one for one in REASONS.values() if one.strip(" :,") not in everything and one not in SAID_OTHERWISE] == []


def test_each_reason_to_refuse_is_in_the_table() -> None:
    said = in_words(texts("vehicle_agent/revisit.py", within="REFUSED"))
    assert "no position yet" in said
    assert [one for one in said if not is_held(one, list(REFUSALS.values()))] == []


def test_each_cause_of_a_strip_is_in_the_table() -> None:
    source = (ROOT / "coordinator/reasons.py").read_text()
    named = re.search(r"^NADIR_GAP, .* = (.*)$", source, re.MULTILINE)
    assert named is not None
    assert set(ast.literal_eval(named[1])) <= set(WHYS.values())


def test_each_warning_of_a_node_is_in_the_table() -> None:
    warned = []
    for room in (
        "coordinator",
        "vehicle_agent",
        "modem",
        "comms/lockstep",
        "comms/memory",
        "comms/runner.py",
        "sim_world",
    ):
        files = [ROOT / room] if room.endswith(".py") else sorted((ROOT / room).rglob("*.py"))
        for file in files:
            for node in ast.walk(ast.parse(file.read_text())):
                is_log = isinstance(node, ast.Call) and ast.unparse(node.func) in ("log.warning", "log.error")
                if is_log and isinstance(node.args[0], ast.Constant):  # type: ignore[attr-defined]
                    warned.append(re.sub(r"%[sd]|%\.0f", "{}", str(node.args[0].value)))  # type: ignore[attr-defined]
    told_of = {
        "{} is given up: {} since {} s": "a primary is given up: it stands still",
        "{} is offered nothing more: {}": "a helper is given up: it does not answer",
        "dropped a message from {}: {}: {} (said once)": "a damaged message is dropped",
    }
    assert set(told_of.values()) <= set(LOGGED)
    assert len(warned) >= 6
    assert [one for one in warned if one not in told_of and one not in OUT_OF_REACH] == []


def test_each_reason_to_drop_a_message_is_in_the_table() -> None:
    source = (ROOT / "comms/runner.py").read_text()
    dropped = re.findall(r'self\.drop\("([^"]+)"', source)
    assert "malformed" in dropped
    assert [one for one in dropped if f"a message is {one}" not in SOMETIMES and one not in OUT_OF_REACH] == []


@pytest.mark.parametrize(
    "name",
    [f"a message is struck: {one.value}" for one in FaultKind]
    + [f"a task: {one.value}" for one in TaskAction]
    + [f"an answer: {one.value}" for one in TaskState]
    + [
        f"a strip that is {one.value} is {other.value}"
        for one in StripState
        for other in StripState
        if other in ALLOWED[one]
    ],
)
def test_each_kind_is_in_the_table(name: str) -> None:
    assert name in SOMETIMES


def test_each_kind_of_trouble_is_in_the_table() -> None:
    tried = {
        "kill": "a helper is killed for good",
        "join": "a helper comes late",
        "freeze": "a helper is frozen",
        "cut_off": "a message is lost",
        "blackout": "modems fall silent",
        "range_cut": "modems hear nothing from afar",
        "jammed": "a share of frames is lost",
        **{one.value: f"a message is struck: {one.value}" for one in FaultKind},
    }
    assert set(tried) == set(KINDS) - {"disk_full"}  # that mission fails, and nothing is read of it
    assert set(tried.values()) <= set(SOMETIMES)


ROWS = {
    "a helper refuses a strip": ("a helper refuses a strip",),
    "it does not answer": ("a helper does not answer", "a helper is given up: it does not answer"),
    "it answers later than that": (
        "a helper is at a strip after all",
        "a helper is at another strip than it was offered",
    ),
    "over a link: it does not answer": ("a strip that is next is open", "a helper does a strip next after all"),
    "its word that it is done with a strip is lost": ("a helper says again that it is done",),
    "it goes on to its next strip": ("a helper at its next strip has seen the one before",),
    "it accepts and does not get there": ("a helper does not serve a strip in time", "a task: give_back"),
    "it fails at, gives back unasked": ("a helper is given up: it does not serve what it accepts",),
    "it says done, but has not covered": ("a helper says done, and the map says no",),
    "over a link: it says done, and its looks": (
        "a helper says done before its looks have come",
        "a helper has left a strip before its looks have come",
    ),
    "it vanishes": ("a helper that has a strip is lost",),
    "it comes back": ("a helper is at a strip after all", "two starts of a vehicle tell of one tile"),
    "its battery does not last": ("a helper refuses: its battery is too low",),
    "a battery does not last for the next track": ("a primary is returning", "a primary is home", "a helper is home"),
    "a battery runs empty": ("a vehicle's battery runs empty",),
    "a word about a strip is repeated": ("a word about a strip comes after a newer one, or again",),
    "a message is damaged on its way": ("a message is malformed", "a damaged message is dropped"),
    "a primary vanishes, or stands still": ("a primary is not waited for any more",),
    "a primary is cut off while it finishes": ("a task: tell_again", "a hotspot is said again"),
    "a vehicle's course is lost": ("a message is lost",),
    "an agent's answer or a tile is lost": ("a helper's word that it is done is lost", "a tile is said again"),
    "a node is killed and goes on by its memory": ("a primary goes on by its memory",),
    "the coordinator is killed and started anew": ("a strip of a coordinator that is gone is given back",),
    "a modem is silent, or frames are lost": (
        "modems fall silent",
        "modems hear nothing from afar",
        "a share of frames is lost",
    ),
    "a modem is killed and started anew": ("a modem is started anew",),
    "a file cannot be written, as the disk is full": (DISK_FULL,),
    "a helper hears late that the mission is over": ("a helper at a strip hears that the mission is over",),
}


def test_each_row_of_what_goes_wrong_is_in_the_table_or_said_to_be_out_of_reach() -> None:
    text = (ROOT / "docs/faults.md").read_text()
    first = text[text.index("| fault | outcome |") :].split("\n\n")[0].splitlines()[2:]
    faults = [line.split("|")[1].strip() for line in first]
    beyond = text[text.index("Storms do not reach") :].split("\n\n")[0].replace("\n", " ")
    missing = [one for one in faults if not any(one.startswith(row) for row in ROWS) and f"*{one}*" not in beyond]
    assert missing == []
    assert [row for row in ROWS if not any(one.startswith(row) for one in faults)] == []
    assert {name for names in ROWS.values() for name in names} <= set(SOMETIMES)
