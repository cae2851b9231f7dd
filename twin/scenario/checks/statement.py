"""What a file says of signals: a text, or a mapping, that means a formula."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, GetJsonSchemaHandler, PrivateAttr, ValidationInfo, model_validator
from pydantic_core import CoreSchema

from twin.scenario.signals.reference import Reference
from twin.scenario.temporal import And, Formula, one_of
from twin.scenario.temporal.text import NO_RANGE, Raw, is_empty, parse
from twin.strict_yaml import Fault, Faults, StrictModel

_RELATIONS = {
    "above": ">",
    "at_least": ">=",
    "below": "<",
    "at_most": "<=",
    "equals": "==",
    "differs_from": "!=",
}
_Scalar = float | bool | str


class _OrText:
    """Marks what may also be a text alone, for the JSON schema."""

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [handler(core), {"type": "string"}]}


class FormulaModel(StrictModel):
    """What means a formula; where a text alone will do, it is the key `that`."""

    takes_text: ClassVar[bool] = False
    _folder: Path = PrivateAttr(default=Path())
    """Of the file: where the paths of a user's signals start."""
    _execute: bool = PrivateAttr(default=False)

    @model_validator(mode="before")
    @classmethod
    def _text_alone(cls, data: Any) -> Any:
        return {"that": data} if isinstance(data, str) and cls.takes_text else data

    @model_validator(mode="after")
    def _means_something(self, info: ValidationInfo) -> FormulaModel:
        context = info.context or {}
        self._folder, self._execute = context.get("folder", Path()), bool(context.get("execute"))
        self.formula()
        return self

    @abstractmethod
    def formula(self) -> Formula:
        """Return what it means; raises Faults."""

    @abstractmethod
    def words(self) -> str:
        """Return it as a short text."""

    def reference(self, signal: str) -> Reference:
        """Return what a name of a signal means here."""
        return Reference(signal, self._folder, self._execute)

    def compared(self, signal: str, relation: str, raw: Raw) -> Formula:
        """Return the comparison of a signal with a value of the file; raises ValueError."""
        return self.reference(signal).predicate(relation, raw)

    def parsed(self, key: str, text: str) -> Formula:
        """Return the formula of the text below a key; raises Faults."""
        try:
            return parse(text, self.compared)
        except ValueError as wrong:
            raise Faults([Fault((key,), str(wrong))]) from None


class Statement(FormulaModel):
    """What holds at a moment: a signal compared with values, several such, or a formula as text."""

    takes_text = True

    signal: str | None = None
    """Name of a signal, or a field of a topic: `clearance`, `/odom.twist.twist.linear.x`."""
    above: _Scalar | None = None
    """It is greater."""
    at_least: _Scalar | None = None
    """It is greater, or equal."""
    below: _Scalar | None = None
    """It is less."""
    at_most: _Scalar | None = None
    """It is less, or equal."""
    within: Annotated[Sequence[_Scalar], Field(min_length=2, max_length=2)] | None = None
    """It lies between two values, or is one of them."""
    equals: _Scalar | None = None
    """It is this number, text, `true` or `false`."""
    differs_from: _Scalar | None = None
    """It is something else."""
    that: str | None = None
    """A formula as text, instead of `signal`: `speed < 1 m/s or clearance > 50 cm`."""
    all: Annotated[Sequence[StatementOrText], Field(min_length=1)] | None = None
    """Statements that hold together, instead of `signal`."""
    any: Annotated[Sequence[StatementOrText], Field(min_length=1)] | None = None
    """Statements of which at least one holds, instead of `signal`."""

    @property
    def _comparisons(self) -> list[tuple[str, str, _Scalar]]:
        """Key, relation and value of each comparison."""
        pairs = [(key, relation, getattr(self, key)) for key, relation in _RELATIONS.items()]
        pairs += [("within", *pair) for pair in zip((">=", "<="), self.within or (), strict=False)]
        return [pair for pair in pairs if pair[2] is not None]

    def formula(self) -> Formula:
        """Return what it means; raises Faults."""
        given = [key for key in ("signal", "that", "all", "any") if getattr(self, key) is not None]
        if len(given) != 1:
            raise Faults([Fault((), "must have exactly one of the keys signal, that, all, any")])
        if self.signal is not None:
            return self._of_signal(self.signal)
        if self._comparisons:
            raise Faults([Fault((key,), f"{key} needs a signal") for key, *_ in self._comparisons])
        if self.that is not None:
            return self.parsed("that", self.that)
        parts = tuple(part.formula() for part in self.all or self.any or ())
        return And(parts) if self.all else one_of(*parts)

    def _of_signal(self, signal: str) -> Formula:
        found, faults = [], []
        try:
            self.reference(signal).check()
        except ValueError as wrong:
            raise Faults([Fault(("signal",), f"signal: {wrong}")]) from None
        for key, relation, raw in self._comparisons or [("signal", "==", True)]:
            try:
                found.append(self.compared(signal, relation, raw))
            except ValueError as wrong:
                faults.append(Fault((key,), f"{key}: {wrong}"))
        if faults:
            raise Faults(dict.fromkeys(faults))
        if self.within is not None and is_empty(*found[-2:]):
            raise Faults([Fault(("within",), NO_RANGE)])
        return found[0] if len(found) == 1 else And(tuple(found))

    def words(self) -> str:
        """Return it as a formula's text."""
        if self.signal is not None:
            parts = [f"{self.signal} {relation} {_word(raw)}" for _, relation, raw in self._comparisons]
            return " and ".join(parts) or self.signal
        if self.that is not None:
            return " ".join(self.that.split())
        return (" and " if self.all else " or ").join(part.words() for part in self.all or self.any or ())


StatementOrText = Annotated[Statement, _OrText()]
Statement.model_rebuild()  # as it contains itself, and others derive from it elsewhere


def _word(value: _Scalar) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)
