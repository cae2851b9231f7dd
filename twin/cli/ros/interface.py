"""`twin interface`: which message, service and action types there are, and what they look like."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.option_groups import example, takes
from twin.cli.ros.joining import Interfaces, add_interfaces

if TYPE_CHECKING:
    from twin.bridge.types.text import Comments

app = typer.Typer(no_args_is_help=True, help="Types: list, show, prototypes; as `ros2 interface`.")

TypeName = Annotated[
    str, typer.Argument(metavar="TYPE", help="Such as geometry_msgs/msg/Twist; - reads it from stdin.")
]

_HEADINGS = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}


def _kinds(
    only_msgs: Annotated[bool, typer.Option("--only-msgs", "-m", help="Only messages.")] = False,
    only_srvs: Annotated[bool, typer.Option("--only-srvs", "-s", help="Only services.")] = False,
    only_actions: Annotated[bool, typer.Option("--only-actions", "-a", help="Only actions.")] = False,
    interfaces: Interfaces = None,
) -> list[str]:
    add_interfaces(interfaces)
    chosen = {"msg": only_msgs, "srv": only_srvs, "action": only_actions}
    return [kind for kind, wanted in chosen.items() if wanted or not any(chosen.values())]


@app.command(epilog=example("twin interface show geometry_msgs/msg/Twist"))
def show(
    typename: TypeName,
    all_comments: Annotated[bool, typer.Option("--all-comments", help="Those of nested types too.")] = False,
    no_comments: Annotated[bool, typer.Option("--no-comments", help="No comments, no empty lines.")] = False,
    interfaces: Interfaces = None,
) -> None:
    """Show a definition, and those of the types that it uses, indented."""
    if all_comments and no_comments:
        raise typer.BadParameter("not together with --no-comments", param_hint="--all-comments")
    from twin.bridge.types.text import show_lines

    add_interfaces(interfaces)
    comments: Comments = "all" if all_comments else "none" if no_comments else "own"
    _print(show_lines(_given(typename), comments))


@app.command("list", epilog=example("twin interface list --only-actions"))
@takes("kinds", _kinds)
def list_interfaces(*, kinds: list[str]) -> None:
    """List all types."""
    from twin.bridge import types

    names = types.names()
    for kind in kinds:
        _print([_HEADINGS[kind], *(f"    {name}" for name in names if f"/{kind}/" in name)])


@app.command(epilog=example("twin interface package nav2_msgs"))
@takes("kinds", _kinds)
def package(
    name: Annotated[str, typer.Argument(metavar="PACKAGE", help="Such as example_interfaces.")],
    *,
    kinds: list[str],
) -> None:
    """List the types of a package."""
    from twin.bridge import types
    from twin.errors import BridgeError, nearest

    names = [item for item in types.names() if item.startswith(f"{name}/")]
    if not names:
        packages = {item.split("/")[0] for item in types.names()}
        raise BridgeError(f"Unknown package '{name}'; {nearest(name, packages)}")
    _print(item for kind in kinds for item in names if f"/{kind}/" in item)


@app.command(epilog=example("twin interface packages"))
@takes("kinds", _kinds)
def packages(*, kinds: list[str]) -> None:
    """List the packages that have types."""
    from twin.bridge import types

    found = {name.split("/")[0] for name in types.names() if name.split("/")[1] in kinds}
    _print(sorted(found))


@app.command(epilog=example("twin interface proto geometry_msgs/msg/Twist"))
def proto(
    typename: TypeName,
    no_quotes: Annotated[bool, typer.Option("--no-quotes", help="Without quotes around it.")] = False,
    interfaces: Interfaces = None,
) -> None:
    """Show a message, a request or a goal with all its fields as YAML, to copy and fill in."""
    from twin.bridge.messages.as_text import prototype

    add_interfaces(interfaces)
    text = prototype(_given(typename))
    typer.echo(text if no_quotes else f'"{text}"')


def _given(typename: str) -> str:
    return sys.stdin.readline().strip() if typename == "-" else typename


def _print(lines: Iterable[str]) -> None:
    for line in lines:
        typer.echo(line)
