"""What the README shows works, and every picture shown is made by the program."""

import re
import subprocess
import sys
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


def test_the_tour_works(tmp_path: Path) -> None:
    (scenario,) = re.findall(r"```yaml\n(.*?)```", README, re.DOTALL)
    (commands,) = re.findall(r"```\n(secondlook .*?)```", README, re.DOTALL)
    (program,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (tmp_path / "bay.yaml").write_text(scenario)
    for command in commands.splitlines():
        program_named = Path(sys.executable).with_name(command.split()[0])
        run = subprocess.run([program_named, *command.split()[1:]], cwd=tmp_path, check=False, timeout=300)
        assert run.returncode == 0, command
    assert (tmp_path / "bay" / "report.html").exists()
    ran = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=300
    )
    left = {folder: float(risk) for folder, risk in (line.split() for line in ran.stdout.splitlines())}
    assert left["bay"] < left["alone"]


def test_it_is_a_front_page() -> None:
    assert len(README.splitlines()) < 120


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
