"""Reads the files of a run."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from secondlook.errors import UserError
from secondlook.recorded.mission import RecordedMission
from secondlook.recorded.mission_files import read_messages


def load_run(run: str | os.PathLike[str]) -> RecordedMission:
    """The mission of a run's folder, of one that failed or was cut off as far as it came.

    Summary and scenario are empty mappings where their files are missing. Raises UserError, in one sentence, for what
    is not the folder of a recorded run.
    """
    folder = Path(run)
    if not folder.is_dir():
        raise UserError(f"{folder}: there is no such folder; must be the folder of a run")
    messages = folder / "messages.mpk"
    if not messages.exists():
        raise UserError(f"{folder}: holds no messages.mpk; must be the folder of a run without --no-record")
    return RecordedMission(
        folder,
        summary=_mapping(folder / "summary.json", json.loads),
        scenario=_mapping(folder / "scenario.yaml", yaml.safe_load),
        messages=read_messages(messages),
    )


def _mapping(path: Path, parse: Any) -> Mapping[str, Any]:
    try:
        content = parse(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, yaml.YAMLError) as error:
        raise UserError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: is not a mapping; must be as the run wrote it")
    return content
