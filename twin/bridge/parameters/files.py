"""ROS 2 parameter files: node names, wildcards and `ros__parameters`.

Scalars are read as rcl_yaml_param_parser reads them (parse.c): `yes` and `on` are true, `1e-3` and `1.` are
doubles, what is in quotes is text. As in rclpy, values under a node's name go before those under wildcards;
among equals, the last one in the file counts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from twin.errors import BridgeError, Problem
from twin.files.reading import read_text

KEY = "ros__parameters"
_TRUE = {"Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}
_FALSE = {"N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}
_INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_DOUBLE = re.compile(
    r"[-+]?((\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|\.(inf|Inf|INF)|(inf|infinity|nan))|\.(nan|NaN|NAN)"
)
_INT64 = range(-(2**63), 2**63)
_DEEPEST, _MOST = 100, 100_000


@dataclass(frozen=True)
class Section:
    """The values under one node name."""

    node: str
    """Full name or pattern: '/amcl', '/**', '/*/amcl', '/robot/**'."""
    values: dict[str, Any]
    """Parameter name, parts separated by dots -> value."""

    @property
    def is_pattern(self) -> bool:
        """Whether it may be for several nodes."""
        return "*" in self.node

    def matches(self, full_name: str) -> bool:
        """Return whether the values are for a node: `*` is one name, `**` any number of them, also none.

        Source: rclcpp/parameter_map.cpp.
        """
        pattern = re.escape(self.node).replace(r"/\*\*", "(/.*)?").replace(r"\*", "[^/]+")
        return re.fullmatch(pattern, full_name) is not None


def values_for(sections: tuple[Section, ...], full_name: str) -> dict[str, Any]:
    """Return the values for a node, by parameter name."""
    found: dict[str, Any] = {}
    for pattern in (True, False):
        for section in sections:
            if section.is_pattern == pattern and section.matches(full_name):
                found |= section.values
    return found


def read(path: Path) -> tuple[Section, ...]:
    """Read a parameter file.

    Raises:
        BridgeError: it cannot be read, or is no parameter file; says in which line.
    """
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
        raise BridgeError(f"the parameter file {path} cannot be read: {reason}") from error
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        what = getattr(error, "problem", None) or "it is nested too deeply"
        raise BridgeError(Problem(f"no YAML: {what}", path, mark.line + 1 if mark else None)) from error
    if root is None:
        return ()
    return tuple(_Reader(path).sections(root, ""))


def scalar(text: str) -> Any:
    """Return a value as `-p name:=value` gives it: YAML, of which lists in [] are understood.

    Raises:
        BridgeError: no value of a parameter.
    """
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError:
        return text
    return "" if node is None else _Reader(None).value(node, 0)


class _Reader:
    """Walks through the nodes of one document."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._read = 0

    def sections(self, node: yaml.Node, name: str, depth: int = 0) -> Iterator[Section]:
        """Yield what is under node names, which may be nested: `robot: {amcl: {ros__parameters: ...}}`."""
        for key, value in self._items(node, name or "the file", depth):
            if key == KEY:
                if not name:
                    raise self._fault(
                        node, f"{KEY} is below no node name; valid: a name, or /** for all nodes"
                    )
                if any("*" in part and part not in ("*", "**") for part in name.split("/")):
                    raise self._fault(node, f"{name}: * stands for one whole name, ** for any number of them")
                yield Section(name, dict(self._parameters(value, "", depth)))
            else:
                below = f"{name}/{key.strip('/')}" if name else f"/{key.strip('/')}"
                yield from self.sections(value, below, depth + 1)

    def _parameters(self, node: yaml.Node, prefix: str, depth: int) -> Iterator[tuple[str, Any]]:
        for key, value in self._items(node, prefix or KEY, depth):
            name = f"{prefix}.{key}" if prefix else key
            if isinstance(value, yaml.MappingNode):
                yield from self._parameters(value, name, depth + 1)
            else:
                yield name, self.value(value, depth)

    def value(self, node: yaml.Node, depth: int) -> Any:
        """Return a scalar or a list of scalars of one type."""
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        if not isinstance(node, yaml.SequenceNode) or not all(
            isinstance(n, yaml.ScalarNode) for n in node.value
        ):
            raise self._fault(node, "a parameter is a scalar or a list of scalars")
        values = [self._scalar(item) for item in node.value]
        if len({type(value) for value in values}) > 1:
            raise self._fault(node, "a list holds values of one type: 1.0 instead of 1 makes a double")
        return values

    def _scalar(self, node: yaml.ScalarNode) -> Any:
        text = node.value
        tagged = node.end_mark.index - node.start_mark.index > len(text)
        if node.style in ("'", '"', "|", ">") or (tagged and node.tag.endswith(":str")):
            return text
        if text in _TRUE or text in _FALSE:
            return text in _TRUE
        if _INTEGER.fullmatch(text):
            digits = text.lstrip("+-")
            base = 16 if digits[:2].lower() == "0x" else 8 if digits[0] == "0" and len(digits) > 1 else 10
            number = int(digits, base) * (-1 if text.startswith("-") else 1)
            if number not in _INT64:
                raise self._fault(node, f"the integer {text} does not fit into 64 bits")
            return number
        if _DOUBLE.fullmatch(text):
            return float(re.sub(r"\.(?=[inIN])", "", text))
        if text == "" or node.tag.endswith(":null"):
            raise self._fault(node, "there is no value")
        return text

    def _items(self, node: yaml.Node, where: str, depth: int) -> Iterator[tuple[str, yaml.Node]]:
        self._read += 1  # aliases make much of a short text
        if depth > _DEEPEST or self._read > _MOST:
            raise self._fault(node, f"it is nested deeper than {_DEEPEST}, or has more than {_MOST} mappings")
        if not isinstance(node, yaml.MappingNode):
            raise self._fault(
                node, f"{where} is no mapping; valid: node name, below it {KEY}, below it name: value"
            )
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise self._fault(key, "a name is text")
            yield key.value, value

    def _fault(self, node: yaml.Node, message: str) -> BridgeError:
        line = node.start_mark.line + 1 if self._path is not None else None
        return BridgeError(Problem(message, self._path, line))
