"""The options by which every command reads a robot file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer

from twin.cli import completion
from twin.cli.option_groups import takes
from twin.errors import ModelError
from twin.models.options import ReadOptions

RobotFile = Annotated[
    str,
    typer.Argument(
        metavar="FILE",
        help="A URDF or xacro file, or a robot of `twin robots`.",
        show_default=False,
        autocompletion=completion.robots,
    ),
]


def _options(
    arg: Annotated[
        list[str] | None,
        typer.Option("--arg", metavar="NAME:=VALUE", help="Value of an <xacro:arg>; may be repeated."),
    ] = None,
    package: Annotated[
        list[str] | None,
        typer.Option("--package", metavar="NAME=PATH", help="Folder of a ROS package that the file names."),
    ] = None,
    allow_env: Annotated[
        list[str] | None,
        typer.Option("--allow-env", metavar="NAME", help="Environment variable that $(env …) may read."),
    ] = None,
    allow_path: Annotated[
        list[Path] | None,
        typer.Option(
            "--allow-path",
            metavar="DIR",
            exists=True,
            file_okay=False,
            help="Another folder that the file may read from.",
        ),
    ] = None,
    missing_mesh: Annotated[
        Literal["error", "skip"],
        typer.Option(help="skip: leave out shapes whose mesh is missing or unreadable."),
    ] = "error",
    ignore_up_axis: Annotated[
        bool, typer.Option("--ignore-up-axis", help="Ignore what COLLADA meshes call up, as RViz does.")
    ] = False,
    repair: Annotated[
        bool,
        typer.Option("--repair", help="Take the nearest possible inertia where the file's is not."),
    ] = False,
) -> ReadOptions:
    folders = _pairs(package, "=", "--package", "NAME=PATH, such as --package my_robot=.")
    return ReadOptions(
        args=_pairs(arg, ":=", "--arg", "NAME:=VALUE, such as --arg wheel_radius:=0.06"),
        packages={name: Path(folder) for name, folder in folders.items()},
        allow_env=tuple(allow_env or ()),
        allow_paths=tuple(allow_path or ()),
        missing_mesh=missing_mesh,
        apply_up_axis=not ignore_up_axis,
        repair=repair,
    )


def reads_robot(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command with a parameter `read: ReadOptions` the options of which that is made."""
    return takes("read", _options)(command)


def _pairs(words: Sequence[str] | None, separator: str, option: str, valid: str) -> dict[str, str]:
    pairs = {}
    for word in words or ():
        name, found, value = word.partition(separator)
        if not name or not found:
            raise ModelError(f"{option} {word}: must be {valid}")
        pairs[name] = value
    return pairs
