"""A YAML file as plain data that remembers the line of every value, and overrides of single values."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from pydantic_core import to_json

from twin.errors import Problem, TwinError
from twin.files.reading import absence, read_text
from twin.parameters.bounds import LARGEST, SMALLEST

Loc = tuple[str | int, ...]
"""Keys and indices from the root of a file to a value."""

_MAX_NODES = 100_000
"""More values than any file we read has; stops a file whose aliases multiply without end."""
_DIGITS = 20
"""Of the longest whole number: a seed of 64 bits."""


class _CoreLoader(yaml.SafeLoader):
    """PyYAML's composer with the scalar rules of YAML 1.2's core schema."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012  (PyYAML's own attribute)


for _tag, _pattern in (
    ("null", r"~|null|Null|NULL|"),
    ("bool", r"true|True|TRUE|false|False|FALSE"),
    ("int", r"[-+]?[0-9]+|0x[0-9a-fA-F]+|0o[0-7]+"),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"),
):
    _CoreLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(rf"(?:{_pattern})\Z"), None)


class _FastLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """The same by libyaml, whose faults are told in fewer words."""

    yaml_implicit_resolvers = _CoreLoader.yaml_implicit_resolvers


@dataclass
class Document:
    """Plain data of a file, where each value came from, and what is wrong with the YAML itself."""

    file: Path
    data: Any = None
    lines: dict[Loc, int] = field(default_factory=dict)
    overrides: dict[Loc, str] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    outsized: list[Problem] = field(default_factory=list)
    """Numbers that are too large or too small to compute with; the data has 0 instead."""

    def alias(self, loc: Loc, original: Loc) -> None:
        """Let everything below `loc` come from where everything below `original` came from."""
        origins: tuple[dict[Loc, Any], ...] = (self.lines, self.overrides)
        for origin in origins:
            for place in [place for place in origin if place[: len(original)] == original]:
                origin[(*loc, *place[len(original) :])] = origin[place]

    def problem(self, loc: Loc, message: str) -> Problem:
        """Place a message: at the override that set the value, else at the innermost known line."""
        for end in range(len(loc), -1, -1):
            if loc[:end] in self.overrides:
                return Problem(f"override {self.overrides[loc[:end]]}: {message}")
            if loc[:end] in self.lines:
                return Problem(message, self.file, self.lines[loc[:end]])
        return Problem(message, self.file, 1)


def _scalar(document: Document, node: yaml.ScalarNode, loc: Loc) -> Any:
    kind = node.tag.rpartition(":")[2]
    if kind == "null":
        return None
    if kind == "bool":
        return node.value.lower() == "true"
    if kind == "int":
        if len(node.value.lstrip("+-0xo")) <= _DIGITS:
            return int(node.value, 10 if node.value[:2] not in ("0x", "0o") else 0)
        valid = f"at most {_DIGITS} digits"
    elif kind == "float":
        value = float(node.value)
        if value == 0.0 or SMALLEST <= abs(value) <= LARGEST:
            return value
        valid = f"0, or a number from {SMALLEST:g} to {LARGEST:g} in size"
    else:
        return node.value
    name = ".".join(map(str, loc)) or "the value"
    given = node.value if len(node.value) <= 40 else node.value[:37] + "..."
    document.outsized.append(document.problem(loc, f"{name}: must be {valid}, not {given}"))
    return 0


def _construct(document: Document, node: yaml.Node, loc: Loc, above: tuple[int, ...]) -> Any:
    """Turn a composed node into plain data, noting lines, duplicate keys and endless aliases."""
    document.lines.setdefault(loc, node.start_mark.line + 1)
    if id(node) in above or len(document.lines) > _MAX_NODES:
        message = "alias contains itself or grows without end; write the value out"
        document.problems.append(document.problem(loc, message))
        return None
    if isinstance(node, yaml.ScalarNode):
        return _scalar(document, node, loc)
    above = (*above, id(node))
    if isinstance(node, yaml.SequenceNode):
        return [_construct(document, item, (*loc, i), above) for i, item in enumerate(node.value)]
    data: dict[str, Any] = {}
    for key_node, value_node in node.value:
        key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
        line = key_node.start_mark.line + 1
        if key is None:
            document.problems.append(Problem("a key must be text", document.file, line))
        elif key in data:
            first = document.lines[(*loc, key)]
            message = f"duplicate key '{key}'{within(loc)}, first given in line {first}; keep one of them"
            document.problems.append(Problem(message, document.file, line))
        else:
            document.lines[(*loc, key)] = line
            data[key] = _construct(document, value_node, (*loc, key), above)
    return data


@lru_cache(maxsize=16)
def _compose(text: str) -> yaml.Node | None:
    """Return the nodes of a text, which nobody changes: of two equal runs the second reads nothing."""
    try:
        return yaml.compose(text, _FastLoader)
    except yaml.YAMLError:
        return yaml.compose(text, _CoreLoader)


def _yaml_message(fault: yaml.YAMLError) -> str:
    """Return PyYAML's complaint as one sentence."""
    parts = [getattr(fault, "context", None), getattr(fault, "problem", None)]
    return f"invalid YAML: {', '.join(part for part in parts if part) or fault}"


def read(path: Path, error: type[TwinError]) -> Document:
    """Read a file; faults of the YAML itself are raised as `error`."""
    document = Document(path)
    try:
        node = _compose(read_text(path))
    except OSError as fault:
        hint = absence(path) or f"cannot read the file: {fault.strerror}"
        raise error(Problem(hint, path)) from None
    except RecursionError:
        raise error(Problem("nested too deeply; no file of ours has a hundred levels", path)) from None
    except UnicodeDecodeError as fault:
        message = f"not UTF-8 text: byte {fault.start} is {fault.object[fault.start]:#x}"
        raise error(Problem(message, path)) from None
    except yaml.YAMLError as fault:
        mark = getattr(fault, "problem_mark", None)
        raise error(Problem(_yaml_message(fault), path, None if mark is None else mark.line + 1)) from None
    if node is None:
        raise error(Problem("the file is empty", path, 1))
    document.data = _construct(document, node, (), ())
    document.lines[()] = 1
    return document


def _from_here(value: Any) -> Any:
    """Return an override with the files that it names as seen from the current folder, where it was typed."""
    if isinstance(value, dict):
        return {_from_here(key): _from_here(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_from_here(item) for item in value]
    if not isinstance(value, str):
        return value
    file, colon, name = value.rpartition(":") if ".py:" in value else (value, "", "")
    is_path = ("/" in file or "." in file) and os.path.isfile(file)
    return f"{os.path.abspath(file)}{colon}{name}" if is_path else value


def apply_override(document: Document, dotted: str, text: str) -> None:
    """Set one value; whether its keys exist is the schema's business, indices must exist here."""
    name = f"{dotted}={text}"
    try:
        node = _compose(text)
    except yaml.YAMLError as fault:
        document.problems.append(Problem(f"override {name}: {_yaml_message(fault)}"))
        return
    keys: list[str | int] = []
    target: Any = document.data
    parts = dotted.split(".")
    for i, part in enumerate(parts):
        last = i == len(parts) - 1
        if isinstance(target, list):
            if not part.isdecimal() or int(part) >= len(target):
                valid = f"indices 0 to {len(target) - 1}" if target else "none, the list is empty"
                message = f"override {name}: no item '{part}'{within(tuple(keys))}; valid: {valid}"
                document.problems.append(Problem(message))
                return
            keys.append(int(part))
        elif isinstance(target, dict):
            keys.append(part)
        else:
            here = ".".join(map(str, keys)) or "the file"
            message = f"override {name}: {here} is {shown(target)} and has no key '{part}'"
            document.problems.append(Problem(message))
            return
        if last:
            document.overrides[tuple(keys)] = name
            given = Document(document.file)
            target[keys[-1]] = None if node is None else _from_here(_construct(given, node, tuple(keys), ()))
            document.problems += [Problem(f"override {name}: {p.message}") for p in given.problems]
            document.outsized += [Problem(f"override {name}: {p.message}") for p in given.outsized]
        else:
            if isinstance(target, dict) and target.get(part) is None:
                target[part] = {}
                document.overrides[tuple(keys)] = name
            target = target[keys[-1]]


def as_text(value: Any) -> str:
    """Return YAML for an override that is read back as the value: as it stands in a file, if that will do.

    >>> as_text("2 m"), as_text("no: 1"), as_text([0.5, "a"])
    ('2 m', '"no: 1"', '[0.5,"a"]')
    """
    if isinstance(value, str):
        try:
            node = _compose(value)
        except yaml.YAMLError:
            node = None
        if isinstance(node, yaml.ScalarNode) and (node.tag, node.value) == ("tag:yaml.org,2002:str", value):
            return value
    return to_json(value).decode()


def within(loc: Loc) -> str:
    """Return the tail of a message that says where in the file."""
    return f" in {'.'.join(map(str, loc))}" if loc else ""


def shown(value: object) -> str:
    """Return a value as a message shows it: short."""
    text = repr(value) if isinstance(value, str) else to_json(value).decode()
    return text if len(text) <= 60 else text[:57] + "..."
