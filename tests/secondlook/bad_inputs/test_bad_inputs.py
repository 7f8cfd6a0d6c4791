"""Whatever a user gives wrongly is told in a sentence that says what and where, by exit code 2, and no file changes: a
row each in the tables beside.

A table has `files`, which lie in the folder where each of its commands is called, and rows of four forms:

- `rows`: by the command line, where `{a|b}` stands for a row each, what each line on standard error holds;
- `contents`: by the command line and a file, what is put there, and then the same;
- `changed`: by a file and what is wrong, what of it is replaced in `bad.yaml`, by what, and the lines that
  `secondlook check bad.yaml` writes, whole;
- `set`: by a file, a key of it and a value, what the line that `secondlook check FILE --set KEY=VALUE` writes holds
  behind the key; or, under `says`, anywhere.

A file is a text, null where it is to be missing, or a mapping: `bytes` as Latin-1 has them, a `text` so many `times`, a
`link`, a `folder`; of another mapping or list it is the JSON. `flown` is the folder of a mission that was flown.

Signals and faults have tests of their own: Ctrl-C, SIGTERM and SIGHUP in `launch/test_processes.py`, `test_signals.py`
and `test_spread_fleet.py` there, `compare/test_compare.py` and `commands/test_cli.py`; a standard output that is full
in the last; full disks in `test_files.py`, `launch/test_files_of_a_run.py` and `storm/test_storm.py`; processes
that are killed or frozen in `launch/test_processes.py` and `test_stopped.py`; parts of a user's that fail in flight in
`scenario/test_plug_ins.py`.
"""

from __future__ import annotations

import itertools
import json
import logging
import re
import shlex
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import pytest
import typer
import yaml
from called import Call
from pydantic import BaseModel

from secondlook import cli
from secondlook.scenario import Scenario
from secondlook.scenario.degrees import IN_DEGREES

TABLES = sorted(Path(__file__).parent.glob("*.yaml"))
LONGEST_LINE = 600  # characters
COMMAND = typer.main.get_command(cli.app_for([]))


class Loader(yaml.CSafeLoader):
    """Refuses a key that is given twice: one of its rows would be lost."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """As PyYAML's."""
        given = [key.value for key, _ in node.value]
        assert len(set(map(str, given))) == len(given), f"a key is given twice{node.start_mark}"
        return super().construct_mapping(node, deep)


@dataclass(frozen=True)
class Row:
    """A command line, what lies where it is called, and of each line that it writes what it `begins` with and `holds`,
    and whether that is the `whole` line."""

    arguments: list[str]
    files: Mapping[str, Any]
    holds: list[str]
    begins: str = ""
    whole: bool = False


def rows_of(path: Path) -> Iterator[tuple[str, Row]]:
    """All rows of a table, each with its name."""
    data = yaml.load(path.read_text(encoding="utf-8"), Loader)
    files = data["files"]
    for pattern, says in data.get("rows", {}).items():
        for line in spelt_out(pattern):
            yield line, Row(shlex.split(line), files, [says] if isinstance(says, str) else says)
    for line, places in data.get("contents", {}).items():
        for place, contents in places.items():
            for number, (content, *says) in enumerate(contents, start=1):
                yield f"{line} with {place}, {number}", Row(shlex.split(line), {**files, place: content}, says)
    for base, changes in data.get("changed", {}).items():
        for name, (old, new, *says) in changes.items():
            assert old in files[base], name
            bad = {"bad.yaml": files[base].replace(old, new, 1)}
            yield name, Row(["check", "bad.yaml"], {**files, **bad}, says, whole=True)
    for base, keys in data.get("set", {}).items():
        for key, values in keys.items():
            for value, says in values.items():
                setting = f"{key}={value}"
                holds, begins = (says, f"--set {setting}: {key}") if isinstance(says, str) else (says["says"], "")
                yield f"{base} {setting}", Row(["check", base, "--set", setting], files, [holds], begins)


def spelt_out(pattern: str) -> list[str]:
    """The command lines that one with alternatives stands for."""
    parts = re.split(r"\{([^{}|]*(?:\|[^{}|]*)+)\}", pattern)
    choices = [part.split("|") if index % 2 else [part] for index, part in enumerate(parts)]
    return ["".join(chosen) for chosen in itertools.product(*choices)]


NAMED = [(f"{path.stem}: {name}", row) for path in TABLES for name, row in rows_of(path)]
ROWS = dict(NAMED)
assert len(ROWS) == len(NAMED), "two rows have one name"


def put(path: Path, content: Any) -> None:
    """Makes a file of what a table says of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_file():
        path.unlink()
    match content:
        case None:
            pass
        case str(text):
            path.write_text(text, encoding="utf-8")
        case {"bytes": text}:
            path.write_bytes(text.encode("latin-1"))
        case {"times": times, "text": text}:
            path.write_text(times * text, encoding="utf-8")
        case {"link": there}:
            path.symlink_to(there)
        case {"folder": True}:
            path.mkdir(exist_ok=True)
        case _:
            path.write_text(json.dumps(content))


def tree(folder: Path) -> dict[str, bytes | None]:
    """What lies in a folder."""
    return {str(one): one.read_bytes() if one.is_file() else None for one in sorted(folder.rglob("*"))}


@pytest.fixture
def folder(users_folder: Path) -> Iterator[Path]:
    """Where a command is called."""
    yield users_folder
    logging.getLogger("secondlook").setLevel(logging.NOTSET)  # nodes say more


@pytest.mark.parametrize("row", ROWS.values(), ids=ROWS)
def test_a_bad_input_is_told_in_a_sentence_and_changes_no_file(
    row: Row,
    folder: Path,
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
    called: Call,
) -> None:
    if any("flown" in word for word in row.arguments):
        shutil.copytree(request.getfixturevalue("brief_run"), folder / "flown")
    for name, content in row.files.items():
        put(folder / name, content)
    before = tree(folder)
    monkeypatch.setattr(cli, "app_for", lambda arguments: COMMAND)  # made once: that takes longer than most rows
    code, out, err = called(*row.arguments)
    lines = err.splitlines()
    if err.startswith("Usage: "):  # what the command line's parser refuses it tells below two lines of help
        assert lines[1:3] == [lines[1], ""], err
        assert lines[1].startswith("Try 'secondlook "), err
        lines = [line.removeprefix("Error: ") for line in lines[3:]]
    assert (code, out) == (2, ""), err
    assert len(lines) == len(row.holds), err
    for line, holds in zip(lines, row.holds, strict=True):
        assert line == holds if row.whole else line.startswith(row.begins), line
        assert holds in line.removeprefix(row.begins), line
        assert len(line) <= LONGEST_LINE, line
    assert tree(folder) == before


def keys(model: type[BaseModel], path: str = "") -> Iterator[str]:
    """A pattern for each key of a scenario, as a sentence names it."""
    models = [model, *([IN_DEGREES[model]] if model in IN_DEGREES else [])]
    for name, info in ((name, info) for one in models for name, info in one.model_fields.items()):
        here = rf"{path}{name}"
        yield here
        for inner in inner_models(info.annotation):
            between = {"vehicles": r"\.\w+", "priorities": r"\[\d\]", "outages": r"\[\d\]"}.get(name, "")
            yield from keys(inner, rf"{here}{between}\.")


def inner_models(annotation: Any) -> Iterator[type[BaseModel]]:
    """The models that a field's type speaks of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for one in get_args(annotation):
        yield from inner_models(one)


def test_each_key_of_a_scenario_has_a_row() -> None:
    told = "\n".join(f"{row.begins}{line}" for row in ROWS.values() for line in row.holds)
    assert [key for key in keys(Scenario) if not re.search(rf"\b{key}\b", told)] == []


def commands(command: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Every command by its name."""
    inner = getattr(command, "commands", None)
    if inner is None:
        yield name, command
    for word, one in (inner or {}).items():
        yield from commands(one, f"{name} {word}".strip())


def test_each_option_of_each_command_has_a_row() -> None:
    lines = [" ".join(row.arguments) for row in ROWS.values()]
    missing = [
        f"{name} {option.opts[0]}"
        for name, command in commands(COMMAND)
        for option in command.params
        if option.opts[0].startswith("-") and option.name != "help"
        if not any(re.match(rf"{name} (.* )?{option.opts[0]}\b", line) for line in lines)
    ]
    assert missing == []
