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
