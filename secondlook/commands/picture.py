"""`secondlook picture` and `secondlook video`: a recorded mission at one moment, and as it went."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from secondlook.commands.given import Run
from secondlook.commands.reading import PICTURE, reading
from secondlook.errors import UserError
from secondlook.progress import no_remark, shown_progress
from secondlook.recorded import load_run

Out = Annotated[Path | None, typer.Option(help="The file to write; in the run's folder if left out.")]
Width = Annotated[int, typer.Option(min=320, max=3840, help="Of the picture, in pixels; it is 9/16 as high.")]


def picture(
    run: Run,
    time: Annotated[
        float | None, typer.Option(min=0, metavar="SECONDS", help="Simulated; the end if left out.")
    ] = None,
    out: Out = None,
    width: Width = 1280,
) -> None:
    """Draw a mission at one moment: its map, vehicles and strips, and how the risk has come down."""
    _check_matplotlib("picture")
    # Only who draws needs matplotlib.
    from secondlook.pictures import write_picture  # noqa: PLC0415

    path = run / "picture.png" if out is None else _ends_in(".png", out)
    with reading("picture", PICTURE) as on_read:
        write_picture(load_run(run, on_read), time, path, width)
    typer.echo(str(path))


def video(
    run: Run,
    out: Out = None,
    width: Width = 960,
    seconds: Annotated[float, typer.Option(min=1, max=600, help="That it takes to see.")] = 20.0,
    frames: Annotated[float, typer.Option(min=1, max=30, help="Pictures a second.")] = 8.0,
) -> None:
    """Draw a whole mission as an animated picture (WebP), which browsers show."""
    _check_matplotlib("video")
    # Only who draws needs matplotlib.
    from secondlook.pictures import write_video  # noqa: PLC0415

    path = run / "video.webp" if out is None else _ends_in(".webp", out)
    with shown_progress("video", "drawn", begins="reading") as tell:
        write_video(load_run(run), path, width, seconds, frames, lambda share: tell(share, no_remark))
    typer.echo(str(path))


def _ends_in(ending: str, out: Path) -> Path:
    """The file, which may have no ending but this. Raises UserError."""
    if out.suffix.lower() not in ("", ending):
        raise UserError(f"--out {out}: {out.suffix} is not allowed; must end in {ending}, which is what is written")
    return out


def _check_matplotlib(command: str) -> None:
    if find_spec("matplotlib") is None:
        raise UserError(
            f"secondlook {command}: needs matplotlib, not installed here; the extra secondlook[plots] has it"
        )
