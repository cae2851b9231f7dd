"""Reads .msg, .srv and .action text; every fault of a text is told at once, with its line.

The grammar is that of rosidl_adapter's parser. ROS 1's `Header`, `time` and `duration` mean the types that
took their place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.interfaces import Nodetype

from twin.bridge.types.literals import (
    BASE_TYPES,
    MOST_NUMBERS,
    MOST_OBJECTS,
    STRINGS,
    Many,
    Value,
    parse_list,
    parse_scalar,
    without_comment,
)
from twin.errors import BridgeError, Problem, nearest

_ROS_1 = {"time": "builtin_interfaces/msg/Time", "duration": "builtin_interfaces/msg/Duration"}
_PACKAGE = re.compile(r"(?!.*__)(?!.*_$)[a-z][a-z0-9_]*")
MESSAGE = re.compile(r"[A-Za-z][A-Za-z0-9]*")
_CONSTANT = re.compile(r"[A-Z]([A-Z0-9_]?[A-Z0-9]+)*")
_TYPE = re.compile(r"(?P<base>[^\s\[\]<=]+)(?P<bound><=(?P<length>[^\[\]]*))?(?P<many>\[(?P<size>[^\]]*)\])?")
_SEPARATOR = re.compile(r"---\s*(#.*)?")
SECTIONS = {"msg": 1, "srv": 2, "action": 3}


class Reference(NamedTuple):
    """A message type that a field names."""

    typename: str
    line: int
    written: str


@dataclass
class Structure:
    """One section of a definition: what becomes a message class."""

    constants: list[tuple[str, str, Any]] = field(default_factory=list)
    """(name, base type, value)"""
    fields: list[tuple[str, Any]] = field(default_factory=list)
    """(name, description in rosbags' form)"""
    defaults: dict[str, Value] = field(default_factory=dict)
    references: list[Reference] = field(default_factory=list)


@dataclass(frozen=True)
class Definition:
    """The text of an interface and where it comes from."""

    typename: str
    text: str
    file: Path | None = None
    """None for a text that a program gave."""

    @property
    def where(self) -> str:
        """For messages: the file, or that there is none."""
        return str(self.file) if self.file else "a definition without a file"

    def problem(self, message: str, line: int) -> Problem:
        """Return a fault in a line (1-based)."""
        if self.file:
            return Problem(message, self.file, line)
        return Problem(f"the definition of {self.typename}, line {line}: {message}")

    def read(self) -> tuple[tuple[Structure, ...], list[Problem]]:
        """Return the sections, as far as they can be read, and every fault of the text."""
        return _Parser(self).parse()

    def parse(self) -> tuple[Structure, ...]:
        """Return the sections.

        Raises:
            BridgeError: every fault of the text, with its line.
        """
        sections, problems = self.read()
        if problems:
            raise BridgeError(problems)
        return sections


class _Parser:
    def __init__(self, definition: Definition) -> None:
        self._definition = definition
        self._package, self._kind, _ = definition.typename.split("/")
        self._problems: list[Problem] = []
        self._sections = [Structure()]
        self._line = 0

    def parse(self) -> tuple[tuple[Structure, ...], list[Problem]]:
        for number, raw in enumerate(self._definition.text.splitlines(), start=1):
            self._line = number
            if _SEPARATOR.fullmatch(raw.rstrip()) and self._kind != "msg":
                self._sections.append(Structure())
                continue
            line = without_comment(raw.replace("\t", " ").lstrip("\ufeff")).strip()
            if line:
                try:
                    self._read(line)
                except ValueError as fault:
                    self._problems.append(self._definition.problem(str(fault), self._line))
        self._count_sections()
        return tuple(self._sections), self._problems

    def _count_sections(self) -> None:
        found, valid = len(self._sections), SECTIONS[self._kind]
        if found != valid:
            names = "request --- response" if valid == 2 else "goal --- result --- feedback"
            message = (
                f"{found} sections; valid for .{self._kind}: {valid}, with lines of --- between: {names}"
            )
            self._problems.append(self._definition.problem(message, max(self._line, 1)))

    def _read(self, line: str) -> None:
        written, _, rest = line.partition(" ")
        rest = rest.strip()
        if not rest:
            raise ValueError(
                f"{line!r} is neither a field nor a constant; valid: 'type name' or 'type NAME=value'"
            )
        constant = re.fullmatch(r"(\w+)\s*=\s*(.*)", rest)
        if constant:
            self._read_constant(written, *constant.groups())
            return
        name, _, default = rest.partition(" ")
        self._read_field(written, name, default.strip())

    def _read_constant(self, written: str, name: str, literal: str) -> None:
        base, length, many, _ = self._split(written)
        if base not in BASE_TYPES or length or many:
            raise ValueError(f"a constant cannot be a {written}; valid: {', '.join(BASE_TYPES)}")
        self._check_new(name)
        if not _CONSTANT.fullmatch(name):
            raise ValueError(
                f"{name!r} is no name of a constant; valid: capitals, digits, single underscores"
            )
        value = parse_scalar(base, literal)
        self._sections[-1].constants.append((name, base, value))

    def _read_field(self, written: str, name: str, default: str) -> None:
        section = self._sections[-1]
        if not _PACKAGE.fullmatch(name):
            raise ValueError(
                f"{name!r} is no name of a field; valid: small letters, digits and single underscores, "
                f"a letter first{_suggestion(name)}"
            )
        self._check_new(name)
        base, length, many, size = self._split(written)
        if base in BASE_TYPES:
            element: Any = (Nodetype.BASE, (base, length))
        else:
            element = (Nodetype.NAME, self._message(base, written))
        most = MOST_NUMBERS if base in BASE_TYPES and base not in STRINGS else MOST_OBJECTS
        if many == "array" and size > most:
            raise ValueError(f"{written!r} is too long; valid: at most {most} elements")
        node = Nodetype.ARRAY if many == "array" else Nodetype.SEQUENCE
        section.fields.append((name, (node, (element, size)) if many else element))
        if not default:
            return
        if base not in BASE_TYPES:
            raise ValueError(f"{name!r} is a {written} and cannot have a default")
        section.defaults[name] = (
            parse_list(base, default, length, many, size) if many else parse_scalar(base, default, length)
        )

    def _check_new(self, name: str) -> None:
        section = self._sections[-1]
        if name in dict(section.fields) or name in [constant[0] for constant in section.constants]:
            raise ValueError(f"{name!r} is there twice")

    def _split(self, written: str) -> tuple[str, int, Many, int]:
        """Return base type, bound of a string, kind and size of an array."""
        match = _TYPE.fullmatch(written)
        if match is None:
            raise ValueError(
                f"{written!r} is no type; valid: such as int32, string<=10, float64[3], pkg/Name[<=5]"
            )
        length = 0
        if match["bound"]:
            if match["base"] not in ("string", "wstring"):
                raise ValueError(f"{written!r}: only string and wstring have a bound before the brackets")
            length = _positive(match["length"], written)
        size = match["size"]
        if not size:
            return match["base"], length, "" if match["many"] is None else "sequence", 0
        bounded = size.startswith("<=")
        many: Many = "bounded" if bounded else "array"
        return match["base"], length, many, _positive(size[2:] if bounded else size, written)

    def _message(self, base: str, written: str) -> str:
        package, _, name = base.rpartition("/")
        package = package.removesuffix("/msg")
        file = self._definition.file
        if base in _ROS_1:
            typename = _ROS_1[base]
        elif base == "Header" and not (file and file.with_name("Header.msg").exists()):
            typename = "std_msgs/msg/Header"
        elif not MESSAGE.fullmatch(name) or (package and not _PACKAGE.fullmatch(package)):
            raise ValueError(f"{written!r} is no type; {nearest(base, BASE_TYPES)}, package/Name")
        else:
            typename = f"{package or self._package}/msg/{name}"
        self._sections[-1].references.append(Reference(typename, self._line, base))
        return typename


def _positive(text: str, written: str) -> int:
    if not re.fullmatch(r"0*[1-9][0-9]{0,17}", text):
        raise ValueError(f"{written!r} has the bound {text!r}; valid: a whole number from 1")
    return int(text)


def _suggestion(name: str) -> str:
    better = re.sub(r"_+", "_", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()).strip("_")
    return f", such as {better!r}" if _PACKAGE.fullmatch(better) else ""
