"""Arguments and options that several `twin param` commands share."""

from __future__ import annotations

from typing import Annotated

import typer

Node = Annotated[str, typer.Argument(metavar="NODE", help="Such as /talker.")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="Of the parameter.")]
Hidden = Annotated[bool, typer.Option("--include-hidden-nodes", help="Nodes of tools too.")]
Timeout = Annotated[
    float, typer.Option("--timeout", metavar="S", min=0.0, help="How long to wait for the node.")
]
