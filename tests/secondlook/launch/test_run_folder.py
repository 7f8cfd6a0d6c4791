"""Which folder is a run's, and that it is no other's."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from secondlook.errors import UserError
from secondlook.launch.run_folder import folder_beside, run_folder


@pytest.mark.parametrize(
    ("out", "beside"),
    [
        ("out", "out-2"),
        ("out/", "out-2"),
        ("link", "link-2"),
        ("link/sub", "link/sub-2"),
        (".", "../here-2"),
        ("..", "../../above-2"),
        ("link/..", "../here-2"),  # of where the link leads
        ("/", "/-2"),
    ],
)
def test_a_folder_beside_is_named_as_the_folder_is_however_that_is_told(
    out: str, beside: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "above" / "here"
    (here / "there").mkdir(parents=True)
    (here / "link").symlink_to("there")
    monkeypatch.chdir(here)
    assert os.path.realpath(folder_beside(Path(out), 2)) == os.path.realpath(beside)


def test_a_folder_beside_is_one_that_is_not_there(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert folder_beside(out, 3) == tmp_path / "out-3"
    (tmp_path / "out-3").mkdir()
    (tmp_path / "out-4").symlink_to("nowhere")
    assert folder_beside(out, 3) == tmp_path / "out-5"


def test_runs_that_begin_at_once_have_each_its_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with run_folder(None, "bay") as one, run_folder(None, "bay") as two, run_folder(None, "bay") as three:
        assert sorted(path.name for path in Path("runs").iterdir()) == sorted({one.name, two.name, three.name})
        assert len({one, two, three}) == 3
    (given := tmp_path / "given").mkdir()
    refused = pytest.raises(UserError, match=rf"^--out {given}: another process writes to it already; must be another")
    with run_folder(given, "bay"), refused, run_folder(given, "bay"):
        pass
    with run_folder(given, "bay") as again:
        assert again == given


def test_where_no_runs_can_be_kept_that_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("runs").write_text("")
    with pytest.raises(UserError, match=r"^--out runs: is a file; must be a folder"), run_folder(None, "bay"):
        pass
