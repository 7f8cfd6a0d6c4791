"""Which folder is a run's."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from secondlook.launch.run_folder import folder_beside


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
