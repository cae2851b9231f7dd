"""What a file calls a signal, and what it may be compared with."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import cast

from twin.errors import PluginError, nearest
from twin.parameters.bounds import LARGEST
from twin.parameters.units import UNITS, Unit
from twin.scenario.observation import CheckContext
from twin.scenario.signals import SIGNALS, Signal
from twin.scenario.signals.topics import TopicField
from twin.scenario.temporal.formula import Predicate, Relation, Value
from twin.scenario.temporal.text import Raw

_NAMED = re.compile(r"(?:(?P<robot>[A-Za-z]\w*)\.)?(?P<name>[A-Za-z_]\w*)(?:\((?P<arguments>[^()]*)\))?")
_BY_UNIT = {name: unit for unit in UNITS.values() for name, _ in unit.factors}
_ORDERED = (">", ">=", "<", "<=")


@dataclass(frozen=True)
class Reference:
    """A signal as a file names it: of the simulator's truth, a user's own, or a field of a topic."""

    text: str
    folder: Path = Path()
    """Of the file, where paths of a user's own start."""
    execute: bool = False
    """Whether a user's own may be executed, so that its unit is known."""

    @cached_property
    def field(self) -> TopicField | None:
        """The topic's field, if it is one."""
        is_topic = self.text.startswith("/") or "(/" in self.text.replace(" ", "")
        return TopicField.parse(self.text) if is_topic else None

    @cached_property
    def _named(self) -> Mapping[str, str | None]:
        """Robot, name and arguments."""
        if ":" in self.text:
            return {"robot": None, "name": self.text, "arguments": None}
        match = _NAMED.fullmatch(self.text)
        if match is None:
            raise ValueError(
                f"'{self.text}' is no signal: a name, name(arguments), robot.name, or a topic's field"
            )
        return match.groupdict()

    @cached_property
    def _class(self) -> type[Signal] | None:
        """The class; None of a user's that is not to be executed."""
        name = str(self._named["name"])
        if ":" not in name and name not in SIGNALS.names():
            raise ValueError(f"there is no signal '{name}'; {nearest(name, SIGNALS.names())}")
        try:
            plugin = SIGNALS.find(name, self.folder)
            return plugin.load() if plugin.ships or self.execute else None
        except PluginError as wrong:
            raise ValueError("; ".join(problem.message for problem in wrong.problems)) from None

    @property
    def robot(self) -> str | None:
        """The robot that it names."""
        return None if self.field else self._named["robot"]

    @property
    def unit(self) -> str:
        """The SI unit of its values, as far as it is known."""
        return "" if self.field or self._class is None else self._class.unit

    def check(self) -> None:
        """Raise ValueError if it is nothing."""
        if not self.field:
            self._arguments()

    def _arguments(self) -> list[float | str]:
        """Return the arguments in SI; raises ValueError."""
        cls, given = self._class, self._named["arguments"]
        if cls is None:
            return []
        texts = [text.strip() for text in given.split(",")] if given and given.strip() else []
        if len(texts) != len(cls.takes):
            wants = ", ".join(name for name, _ in cls.takes)
            name = self._named["name"]
            raise ValueError(
                f"{name} takes {f'({wants})' if wants else 'no arguments'}, not ({', '.join(texts)})"
            )
        values: list[float | str] = []
        for (name, unit), text in zip(cls.takes, texts, strict=True):
            try:
                values.append(text if unit is None else unit.parse(_number(text)))
            except ValueError as wrong:
                raise ValueError(f"{name} of {self._named['name']} {wrong}, not '{text}'") from None
        return values

    def predicate(self, relation: str, raw: Raw) -> Predicate:
        """Return the comparison with a value as a file has it; raises ValueError if they do not fit."""
        self.check()
        kind = None if self.field or self._class is None else self._class.kind
        limit = self._limit(kind, raw, ordered=relation in _ORDERED)
        if relation in _ORDERED and not isinstance(limit, float):
            raise ValueError(f"{self.text} {relation} needs a number, not {raw!r}")
        return Predicate(self.text, cast(Relation, relation), limit)

    def _limit(self, kind: type | None, raw: Raw, *, ordered: bool) -> Value:
        if kind is str:
            if not isinstance(raw, str) or ordered:
                raise ValueError(
                    f"{self.text} is a text: compare it by == or != with a 'text', not with {raw!r}"
                )
            return raw
        if kind is bool or (kind is None and isinstance(raw, bool)):
            if not isinstance(raw, bool) or ordered:
                raise ValueError(f"{self.text} is true or false: compare it by == or !=, not with {raw!r}")
            return raw
        if isinstance(raw, bool):
            raise ValueError(f"{self.text} is a number; compare it: {self.text} > 0")
        raw = _number(raw)
        unit: Unit | None
        if kind is None:  # of a topic, or unknown yet
            unit = _BY_UNIT.get(str(raw).lstrip("+-0123456789.eE ")) if isinstance(raw, str) else None
            if isinstance(raw, str) and (unit is None or not re.match(r"[-+.\d]", raw)):
                if ordered:
                    raise ValueError(f"{self.text} needs a number to be compared with, not {raw!r}")
                return raw
        else:
            unit = UNITS.get(self.unit)
        if unit is None:
            if isinstance(raw, str):
                raise ValueError(
                    f"{self.text} is a number without a unit, it cannot be compared with {raw!r}"
                )
            if abs(raw) > LARGEST:
                raise ValueError(f"the limit of {self.text} must be at most {LARGEST:g} in size")
            return raw
        try:
            return unit.parse(raw)
        except ValueError as wrong:
            raise ValueError(f"the limit of {self.text} {wrong}, not {raw!r}") from None

    def make(self, robot: str | None, context: CheckContext) -> Signal:
        """Return the signal, fresh, of the robot that it names or else that one.

        Raises:
            ScenarioError: It does not exist in this run.
            PluginError: It is a user's, and wrong.
        """
        plugin = SIGNALS.find(str(self._named["name"]), self.folder)
        executed = Reference(self.text, self.folder, execute=True)
        return plugin.create(self.robot or robot, executed._arguments(), context)


def _number(raw: Raw) -> float | str:
    """Return what is a number as one."""
    try:
        return float(raw)
    except ValueError:
        return str(raw)
