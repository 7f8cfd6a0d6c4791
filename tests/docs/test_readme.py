"""What the README shows works."""

import re
from pathlib import Path

import pytest

from secondlook.scenario import ScenarioError, load_scenario

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def test_the_scenario_shown_loads_and_the_mistake_shown_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (shown,) = re.findall(r"```yaml\n(.*?)```", README, re.DOTALL)
    bay = tmp_path / "bay.yaml"
    bay.write_text(shown)
    assert load_scenario("bay.yaml").name == "bay"
    bay.write_text(shown.replace("speed_mps: 1.5", "speed_mps: 0"))
    with pytest.raises(ScenarioError) as caught:
        load_scenario("bay.yaml")
    assert f"```\n{caught.value}\n```" in README


def test_links_within_the_repository_lead_somewhere() -> None:
    root = Path(__file__).parents[2]
    documents = [root / "README.md", root / "CONTRIBUTING.md", *(root / "docs").rglob("*.md")]
    targets = [
        (document, target)
        for document in documents
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", document.read_text(encoding="utf-8"))
    ]
    assert targets
    assert [(document.name, target) for document, target in targets if not (document.parent / target).exists()] == []


def test_every_picture_shown_is_made_by_the_program() -> None:
    root = Path(__file__).parents[2]
    documents = [root / "README.md", *(root / "docs").rglob("*.md")]
    shown = {
        (document.parent / target).resolve().relative_to(root).as_posix()
        for document in documents
        for target in re.findall(r"!\[[^\]]*\]\((?!https?:)([^)#]+)", document.read_text(encoding="utf-8"))
    }
    recipe = re.search(r"^pictures:.*?\n\n", (root / "Makefile").read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert recipe is not None
    made = set(re.findall(r"docs/[\w/-]+\.png", recipe[0]))
    assert "secondlook paper --out docs/paper\n" in recipe[0]
    figures = (root / "secondlook" / "paper" / "figures.py").read_text(encoding="utf-8")
    made |= {f"docs/paper/{name}.png" for name in re.findall(r'^ +"([\w-]+)": draw_', figures, re.MULTILINE)}
    assert shown
    assert shown - made == set()
