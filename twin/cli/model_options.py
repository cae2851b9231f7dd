"""The options by which every command reads a robot file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from twin.errors import ModelError

RobotFile = Annotated[
    str,
    typer.Argument(
        metavar="FILE", help="A URDF or xacro file, or a robot of `twin robots`.", show_default=False
    ),
]
Args = Annotated[
    list[str] | None,
    typer.Option("--arg", metavar="NAME:=VALUE", help="Value of an <xacro:arg>; may be repeated."),
]
Packages = Annotated[
    list[str] | None,
    typer.Option(
        "--package", metavar="NAME=PATH", help="Folder of a ROS package that the file names; may be repeated."
    ),
]


def parse_args(words: Sequence[str] | None) -> dict[str, str]:
    """Split `NAME:=VALUE` words; raises ModelError."""
    valid = "NAME:=VALUE, such as --arg wheel_radius:=0.06"
    return dict(_split(word, ":=", "--arg", valid) for word in words or ())


def parse_packages(words: Sequence[str] | None) -> dict[str, Path]:
    """Split `NAME=PATH` words; raises ModelError."""
    valid = "NAME=PATH, such as --package my_robot=."
    pairs = (_split(word, "=", "--package", valid) for word in words or ())
    return {name: Path(path) for name, path in pairs}


def _split(word: str, separator: str, option: str, valid: str) -> tuple[str, str]:
    name, found, value = word.partition(separator)
    if not name or not found:
        raise ModelError(f"{option} {word}: must be {valid}")
    return name, value
