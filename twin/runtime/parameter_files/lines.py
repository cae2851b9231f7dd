"""Where in a parameter file a value stands."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import yaml

from twin.bridge.parameters import files
from twin.files.reading import read_text


def lines_of(path: Path) -> dict[tuple[str, str], int]:
    """Return the line of every value: (node, parameter) -> line."""
    root = yaml.compose(read_text(path), Loader=yaml.SafeLoader)
    return dict(_walk(root, "", None)) if root is not None else {}


def _walk(node: yaml.Node, name: str, parameter: str | None) -> Iterator[tuple[tuple[str, str], int]]:
    if not isinstance(node, yaml.MappingNode):
        return
    for key, value in node.value:
        text = str(key.value)
        if parameter is None and text == files.KEY:
            yield from _walk(value, name, "")
        elif parameter is None:
            yield from _walk(value, f"{name}/{text.strip('/')}", None)
        else:
            full = f"{parameter}.{text}" if parameter else text
            yield (name, full), key.start_mark.line + 1
            yield from _walk(value, name, full)
