"""A scenario that is kept as plain data, written as a file again."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from twin.errors import ScenarioError
from twin.files.writing import write_whole
from twin.scenario.source import Source
from twin.strict_yaml import read


def write(source: Source, file: Path, comments: list[str]) -> None:
    """Write a scenario; the files that it names are found from where it lies then.

    Raises:
        RecordingError: It cannot be written.
    """
    named = source.files()
    folder = file.absolute().parent
    data = _moved(source.data, {text: _seen_from(folder, source.file.parent / text) for text in named})
    head = "".join(f"# {line}\n" for line in comments)
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    write_whole(file, head + text)
    if read(file, ScenarioError).data != data:  # a text that YAML 1.2 takes for a number: quoted then
        quoted = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_style='"', width=110)
        write_whole(file, head + quoted)


def _seen_from(folder: Path, path: Path) -> str:
    seen = os.path.relpath(path, folder)
    return seen if os.sep in seen else f"./{seen}"


def _moved(value: Any, places: Mapping[str, str]) -> Any:
    if isinstance(value, Mapping):
        return {_moved(key, places): _moved(item, places) for key, item in value.items()}
    if isinstance(value, list):
        return [_moved(item, places) for item in value]
    if not isinstance(value, str):
        return value
    file, colon, name = value.rpartition(":") if ".py:" in value else (value, "", "")
    return f"{places[file]}{colon}{name}" if file in places else value
