"""The option by which commands learn a user's own message types."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

Interfaces = Annotated[
    list[Path] | None,
    typer.Option(
        "--interfaces",
        metavar="DIR",
        envvar="TWIN_INTERFACES",
        help="A package, workspace or share folder with .msg, .srv, .action files; repeatable.",
        show_default=False,
    ),
]


def add_interfaces(folders: Sequence[Path] | None) -> None:
    """Make the interfaces of folders known.

    Raises:
        BridgeError: no such folder, or all faults in its files.
    """
    if folders:
        from twin.bridge import types

        types.add_folders(folders)
