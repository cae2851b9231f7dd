"""A new project: a folder with a robot, an arena, a scenario, a check and a test, which passes as it is.

`template/` is such a project, whose name is `my_robot`; a new one is its copy with another name.
"""

from __future__ import annotations

import keyword
import os
import re
import sys
import tempfile
from pathlib import Path

from twin.errors import RecordingError, TwinError
from twin.files.reading import read_text

_TEMPLATE = Path(__file__).parent / "template"
_NAME = "my_robot"
"""Of the template, in its files and in their names."""


def create(folder: Path) -> None:
    """Write a project into a new or empty folder, which gives it its name.

    Raises:
        TwinError: The name is none of a ROS package, or that of a module of Python.
        RecordingError: The folder is not empty or cannot be written; then nothing is left behind.
    """
    name = Path(os.path.abspath(folder)).name
    _check(name)
    files = {
        file.relative_to(_TEMPLATE).as_posix(): read_text(file)
        for file in sorted(_TEMPLATE.rglob("*"))
        if file.is_file() and "__pycache__" not in file.parts
    }
    _write(folder, {file.replace(_NAME, name): text.replace(_NAME, name) for file, text in files.items()})


def _check(name: str) -> None:
    if not re.fullmatch(r"[a-z]([a-z0-9]|_(?!_))+", name):
        raise TwinError(
            f"'{name}' is no name of a project; valid are those of ROS packages: lower-case letters, digits "
            "and single _, two or more, a letter first, such as my_robot"
        )
    folders = {path.name for path in _TEMPLATE.iterdir()} - {_NAME}
    if keyword.iskeyword(name) or name in {"twin", "pytest", *sys.stdlib_module_names, *folders}:
        raise TwinError(
            f"'{name}' is the name of a module or of a folder of every project; such as {name}_robot is free"
        )


def _write(folder: Path, files: dict[str, str]) -> None:
    """Write files into a folder beside, and move them to their place when all are there."""
    try:
        if folder.exists() and not folder.is_dir():
            raise RecordingError(f"{folder}: is no folder; name a new one")
        if folder.exists() and any(folder.iterdir()):
            raise RecordingError(f"{folder}: the folder is not empty; name a new one")
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as place:
            new = Path(place) / folder.name
            for file, text in files.items():
                (new / file).parent.mkdir(parents=True, exist_ok=True)
                (new / file).write_text(text, encoding="utf-8")
            if not folder.exists():
                new.rename(folder)
                return
            for each in sorted(new.iterdir()):  # it may be the current folder, which is to stay what it is
                each.rename(folder / each.name)
    except OSError as fault:
        raise RecordingError(f"{folder}: cannot be written: {fault.strerror or fault}") from fault
