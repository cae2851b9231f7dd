"""The robots that have a name: those that ship with twin, and those of installed packages."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from twin.errors import ModelError, Problem, nearest
from twin.files.reading import refusal
from twin.plugins import Files

ROBOTS = Path(__file__).parent / "robots"
"""A ROS package (`$(find twin_robots)`) with one folder per robot."""


def catalogue() -> Mapping[str, Path]:
    """Return the file of every robot that has a name, in alphabetical order."""
    files = sorted(ROBOTS.glob("*/*.urdf.xacro"))
    shipped = {path.parent.name: path for path in files if path.name == f"{path.parent.name}.urdf.xacro"}
    return Files("robot", shipped, group="twin.robots", endings=(".urdf.xacro", ".xacro", ".urdf"))


def resolve(name_or_path: str | Path) -> Path:
    """Return the model file that `name_or_path` means: a file, or a name of the catalogue.

    Raises:
        ModelError: Neither such a file nor such a robot exists.
    """
    text = str(name_or_path)
    path = Path(text)
    if path.is_file():
        return path
    robots = catalogue()
    if text in robots:
        return robots[text]
    if isinstance(name_or_path, Path) or path.suffix in (".urdf", ".xacro", ".xml") or len(path.parts) > 1:
        why = refusal(path)
        message = f"{text} is no model file: {why}" if why else f"no such model file: {text}"
        raise ModelError(Problem(message, code="no-file"))
    message = f"unknown robot '{text}': {nearest(text, robots)}, or the path of a URDF or xacro file"
    raise ModelError(Problem(message, code="no-file"))
