"""Fields of topics as signals: `/odom.twist.twist.linear.x`, `/scan.ranges[0]`, `min(/scan.ranges)`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from twin.errors import ScenarioError, nearest
from twin.scenario.temporal.formula import Value

if TYPE_CHECKING:
    from twin.bridge.types.fields import Field

_STEP = re.compile(r"\.([A-Za-z_]\w*)|\[(\d+)\]")
_NUMBERS = re.compile(r"u?int\d+|float\d+|byte|char|octet")

AGGREGATES: Mapping[str, Callable[[Any], float]] = {
    "min": lambda values: float(np.fmin.reduce(values)),
    "max": lambda values: float(np.fmax.reduce(values)),
    "mean": lambda values: float(np.mean(values)),
    "norm": lambda values: float(np.linalg.norm(values)),
    "length": len,
}
"""Numbers of a whole array, or of a vector's fields; `min` and `max` leave out what is no number."""


class TopicReader(NamedTuple):
    """Reads a field from the messages of a topic."""

    topic: str
    msgtype: str
    kind: type
    """What its values are: `float`, `bool` or `str`."""
    read: Callable[[Any], Value | None]
    """Takes a message; returns None if it has no such element."""


@dataclass(frozen=True)
class TopicField:
    """A field of the messages on a topic."""

    topic: str
    steps: tuple[str | int, ...]
    """Names of fields, and indices."""
    aggregate: str = ""
    """What is made of an array: a key of `AGGREGATES`, or nothing."""

    @classmethod
    def parse(cls, text: str) -> TopicField:
        """Return the field of a text; raises ValueError."""
        function, _, inner = text.rpartition("(")
        path = inner.removesuffix(")").strip() if function else text
        if function and function not in AGGREGATES:
            raise ValueError(f"there is no function '{function}' of a topic; {nearest(function, AGGREGATES)}")
        topic, _, rest = path.partition(".")
        rest = f".{rest}" if rest else ""
        found = list(_STEP.finditer(rest))
        if not found or "".join(match[0] for match in found) != rest or not path.startswith("/"):
            raise ValueError(
                f"'{path}' must name a field of a topic: /odom.twist.twist.linear.x, /scan.ranges[0]"
            )
        return cls(topic, tuple(match[1] or int(match[2]) for match in found), function)

    def __str__(self) -> str:
        path = self.topic + "".join(
            f".{step}" if isinstance(step, str) else f"[{step}]" for step in self.steps
        )
        return f"{self.aggregate}({path})" if self.aggregate else path

    def reader(self, msgtype: str) -> TopicReader:
        """Return what reads it from messages of a type.

        Raises:
            ScenarioError: The type has no such field, or nothing of one value.
        """
        from twin.bridge.types.fields import fields_of  # with all types: files are read without

        attributes: list[str | int] = []
        field: Field | None = None
        inside, single = msgtype, True
        for step in self.steps:
            if isinstance(step, int):
                if single or field is None:
                    raise self._wrong(f"'{field.name if field else self.topic}' is no array")
                single = True
                attributes.append(step)
                continue
            if not single:
                raise self._wrong(
                    f"'{field.name if field else ''}' is an array: write [0] for its first element"
                )
            fields = {one.name: one for one in fields_of(inside)} if inside else {}
            if step not in fields:
                said = nearest(step, fields) if fields else "it is a value, without fields"
                raise self._wrong(f"{inside or 'it'} has no field '{step}'; {said}")
            field = fields[step]
            inside, single = field.message, not field.many
            attributes.append(field.attribute)
        assert field is not None
        inner = fields_of(inside) if inside else ()
        return TopicReader(self.topic, msgtype, *self._finished(field, inner, single, tuple(attributes)))

    def _finished(
        self, field: Field, inner: tuple[Field, ...], single: bool, attributes: tuple[str | int, ...]
    ) -> tuple[type, Callable[[Any], Value | None]]:
        if self.aggregate:
            parts = [one for one in inner if _is_number(one)] if single else []
            if not parts and (single or not (_is_number(field) or self.aggregate == "length")):
                raise self._wrong(f"{self.aggregate}() is for arrays of numbers, not {field.typename}")
            of_parts = tuple(part.attribute for part in parts)
            return float, _Aggregate(attributes, AGGREGATES[self.aggregate], of_parts)
        if inner or not single:
            names = ", ".join(one.name for one in inner) if single else ""
            valid = f"valid: {names}" if names else f"write [0], or {', '.join(AGGREGATES)} around it"
            raise self._wrong(f"'{field.name}' is {field.typename}, not one value; {valid}")
        kind = str if field.base in ("string", "wstring") else bool if field.base == "bool" else float
        return kind, _Element(attributes, np.float32 if field.base == "float32" else kind)

    def _wrong(self, message: str) -> ScenarioError:
        return ScenarioError(f"{self}: {message}")


def _is_number(field: Field) -> bool:
    return _NUMBERS.fullmatch(field.base) is not None


def _reached(message: Any, path: tuple[str | int, ...]) -> Any:
    for step in path:
        message = message[step] if isinstance(step, int) else getattr(message, step)
    return message


class _Element:
    """Reads one value."""

    def __init__(self, path: tuple[str | int, ...], kind: Any) -> None:
        self._path, self._kind = path, kind

    def __call__(self, message: Any) -> Value | None:
        try:
            value = self._kind(_reached(message, self._path))
        except IndexError:
            return None
        return float(value) if isinstance(value, np.float32) else value


class _Aggregate:
    """Reads an array, or the numbers of a vector, and makes one value of them."""

    def __init__(
        self, path: tuple[str | int, ...], function: Callable[[Any], float], parts: tuple[str, ...]
    ) -> None:
        self._path, self._function, self._parts = path, function, parts

    def __call__(self, message: Any) -> Value | None:
        try:
            values = _reached(message, self._path)
        except IndexError:
            return None
        if self._parts:
            values = [getattr(values, part) for part in self._parts]
        if len(values) == 0 and self._function is not len:
            return None
        return float(self._function(values))
