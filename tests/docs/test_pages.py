"""The documents say what is: made pages as they are made, names and paths that exist, keys that are there."""

from __future__ import annotations

import json
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from docs.pages import PAGES, ROOMS, ROOT, first_sentence, map_page
from secondlook import testing
from secondlook.recorded.observer import Observer
from secondlook.recorded.summary import summarise
from secondlook.recorded.whereabouts import Place
from secondlook.scenario import Scenario, bundled
from secondlook.scenario.plug_ins import ALLOCATOR, SPACING
from secondlook.testing import Fleet

ALL_TOLD = {  # what makes a summary tell what it does not of every mission
    "area.keep_out_m": [[[290, 90], [310, 90], [310, 120], [290, 120]]],
    "area.priorities": [{"polygon_m": [[0, 0], [50, 0], [50, 50]], "weight": 2}],
    "mission.goal": {"kind": "none_left"},
    "targets.correlation": 0.5,
}
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def code(document: Path) -> list[str]:
    """What a document sets as code within its lines."""
    text = re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return re.findall(r"`([^`\n]+)`", text)


@pytest.mark.parametrize("page", PAGES)
def test_made_pages_are_up_to_date(page: str) -> None:
    made = PAGES[page]()
    assert (ROOT / page).read_text(encoding="utf-8") == made, f"{page} is not what the program makes of it: make docs"


def test_every_file_says_what_it_holds() -> None:
    files = [file for top in (*ROOMS, "bench", "docs", "examples", "tests") for file in (ROOT / top).rglob("*.py")]
    assert files
    assert [file for file in files if not first_sentence(file)] == []


def test_the_map_has_every_module() -> None:
    page = map_page()
    for room in ROOMS:
        for module in pkgutil.walk_packages([str(ROOT / room)], f"{room}."):
            folder, _, name = module.name.rpartition(".")
            section = page.split(f"## `{folder.replace('.', '/')}/`\n")[1].split("\n## ")[0]
            assert module.ispkg or f"| `{name}.py` | " in section


def test_the_scenario_reference_names_all_that_may_be_chosen() -> None:
    page = (ROOT / "docs/reference/scenario.md").read_text(encoding="utf-8")
    for key, names in (("allocator", ALLOCATOR.ours), ("spacing", SPACING.ours), ("curve", bundled.curve_names())):
        (row,) = re.findall(rf"^\| `{key}` .*", page, re.MULTILINE)
        assert [name for name in names if f"`{name}`" not in row] == []


def test_the_scenario_reference_tells_values_and_defaults() -> None:
    page = (ROOT / "docs/reference/scenario.md").read_text(encoding="utf-8")
    assert "| `deadline_factor` | number in [1, 100] | `1.05` |" in page
    assert "| `altitude_m` | number in [0.01, 1000] | `15`; `5` |" in page
    assert "| `nadir_gap_m` | number in [0, 1000] | *required*; `0` |" in page
    assert "| `scale_m` | pair of numbers in [0.1, 1000] | `[40, 200]` |" in page
    assert "| `curve` | [mapping](#detection-curve) or text | none |" in page


def test_paths_and_names_in_code_are_there() -> None:
    tops = "|".join((*ROOMS, "bench", "docs", "examples", "tests"))
    rooms = "|".join(ROOMS)
    missing = []
    for document in DOCUMENTS:
        for said in code(document):
            if re.fullmatch(rf"({tops})/[\w./-]*", said) and not (ROOT / said).exists():
                missing.append((document.name, said))
            elif re.fullmatch(rf"({rooms})(\.[A-Za-z_]\w*)+(\(.*\))?", said) and not (
                said.endswith(".py") or is_key(said)
            ):
                try:
                    pkgutil.resolve_name(said.partition("(")[0])
                except (ImportError, AttributeError):
                    missing.append((document.name, said))
    assert missing == []


def is_key(said: str) -> bool:
    """Whether it is a key of a scenario's mapping of its own, such as `coordinator.allocator`."""
    key, _, inner = said.partition(".")
    mapping = Scenario.model_fields[key].annotation if key in Scenario.model_fields else None
    return inner in getattr(mapping, "model_fields", {})


def test_the_glossary_is_a_page() -> None:
    assert len((ROOT / "docs/glossary.md").read_text(encoding="utf-8").splitlines()) <= 60


def test_every_key_of_the_summary_is_told(tmp_path: Path) -> None:
    flight = Fleet(ROOT / "tests/support/brief.yaml", overrides=ALL_TOLD, folder=tmp_path / "run").run()
    (tmp_path / "again").mkdir()
    again = Observer(tmp_path / "again", with_messages=False)
    for one in flight.messages():
        again.on_message(one)
    again.close()
    again.metrics.entries.hear(Place("helper", 90.0, (305.0, 110.0), moves=True, is_true=True, counts=True))
    assert again.metrics.entries.found()
    ran: dict[str, Any] = {
        "bus": "zenoh",
        "processes": 5,
        "wall_s": 9.0,
        "ending": "failed",
        "failure": "-",
        "restarts": {"helper": 1},
    }
    summary = summarise(flight.scenario, again, None, **ran)
    page = (ROOT / "docs/reference/run-files.md").read_text(encoding="utf-8")
    told = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`\n]+)`", page.split("## summary.json")[1]))))
    names = {one for key in ("vehicles", "messages", "dropped") for one in flight.summary[key]}
    assert set(keys_of(json.loads(json.dumps([flight.summary, summary])))) - names - told == set()


@pytest.mark.parametrize("page", ["docs/testing.md", "docs/reference/testing.md"])
def test_all_that_may_be_asserted_or_checked_is_told(page: str) -> None:
    told = set(re.findall(r"\b(?:assert|check)_\w+", (ROOT / page).read_text(encoding="utf-8")))
    assert {one for one in testing.__all__ if one.startswith(("assert_", "check_"))} - told == set()


def keys_of(value: Any) -> Iterator[str]:
    """All keys within a JSON value."""
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        if isinstance(key, str):
            yield key
        yield from keys_of(inner)
