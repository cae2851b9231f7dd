"""`twin param dump` and `load`: the parameters of a node as a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.ros.joining import Joining
from twin.cli.ros.param.client import Hidden, NodeName, ParameterClient, Timeout, find_node
from twin.errors import BridgeError

if TYPE_CHECKING:
    import yaml


def dump(node: NodeName, hidden: Hidden = False, timeout: Timeout = 1.0, *, joining: Joining) -> None:
    """Print the parameters of a node as a parameter file."""
    from twin.bridge.parameters.files import KEY
    from twin.bridge.parameters.values import value_to_python

    with joining.open() as process:
        client = ParameterClient(process, find_node(process, node, hidden, timeout))
        names = client.names()
        values = [value_to_python(message) for message in client.get(names)] if names else []
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=True):
        if value is not None:  # declared without a value: a file cannot say that
            _insert(tree, name.split("."), value)
    typer.echo(_yaml({client.node: {KEY: tree}}))


def load(
    node: NodeName,
    file: Annotated[
        Path, typer.Argument(metavar="FILE", exists=True, dir_okay=False, help="Such as one of `dump`.")
    ],
    no_use_wildcard: Annotated[
        bool, typer.Option("--no-use-wildcard", help="Leave out what the file says for several nodes: '/**'.")
    ] = False,
    hidden: Hidden = False,
    timeout: Timeout = 1.0,
    *,
    joining: Joining,
) -> None:
    """Set the parameters of a node to those of a parameter file."""
    from twin.bridge.parameters.values import Parameter

    with joining.open() as process:
        client = ParameterClient(process, find_node(process, node, hidden, timeout))
        values = _values_for(file, client.node, not no_use_wildcard)
        messages = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        results = client.set(messages)
    for name, result in zip(values, results, strict=True):
        reason = f": {result.reason}" if result.reason else ""
        done = "successful" if result.successful else "failed"
        typer.echo(f"Set parameter {name} {done}{reason}", err=not result.successful)
    if not all(result.successful for result in results):
        raise typer.Exit(1)


def _values_for(file: Path, node: str, use_wildcard: bool) -> dict[str, Any]:
    """Return a file's values for a node.

    Raises:
        BridgeError: there are none.
    """
    from twin.bridge.parameters.files import read, values_for

    sections = tuple(section for section in read(file) if use_wildcard or not section.is_pattern)
    values = values_for(sections, node)
    if not values:
        names = ", ".join(section.node for section in sections) or "none"
        raise BridgeError(
            f"Param file {file} does not contain parameters for {node}, only for nodes: {names}"
        )
    return values


def _insert(tree: dict[str, Any], path: list[str], value: Any) -> None:
    """Put a value under its name's parts; a name that is also a part of others keeps its dots."""
    for index, part in enumerate(path[:-1]):
        inner = tree.setdefault(part, {})
        if not isinstance(inner, dict):
            tree[".".join(path[index:])] = value
            return
        tree = inner
    tree[path[-1]] = value


def _yaml(values: dict[str, Any]) -> str:
    """Return YAML that reads back as the same types: text that looks like a number to ROS is quoted."""
    import yaml

    from twin.bridge.parameters.files import scalar

    class Dumper(yaml.SafeDumper):
        """Quotes more than YAML needs."""

        def ignore_aliases(self, data: Any) -> bool:
            return True

    def text(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
        plain = dumper.represent_str(value)
        try:
            ambiguous = type(scalar(value)) is not str
        except BridgeError:
            ambiguous = True
        return dumper.represent_scalar(plain.tag, value, "'") if ambiguous else plain

    Dumper.add_representer(str, text)
    return yaml.dump(values, Dumper=Dumper, default_flow_style=False, allow_unicode=True)
