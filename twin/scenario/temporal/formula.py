"""Formulas: predicates over signals, and what is said of them over time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from twin.scenario.temporal.margins import TINIEST

FOREVER = 1 << 62
"""An end that never comes [ns]."""

Value = float | bool | str
Relation = Literal[">", ">=", "<", "<=", "==", "!="]


@dataclass(frozen=True)
class Predicate:
    """A signal compared with a value; a number that is none (NaN) satisfies no comparison."""

    signal: str
    """As the formula's text names it."""
    relation: Relation
    limit: Value
    """In SI."""

    def margin(self, value: Value) -> float:
        """Return how far a value is from making it otherwise: the distance to the limit, never 0.

        Texts and truth values have no distance: what is equal, or is not, is so by infinity.
        """
        limit, relation = self.limit, self.relation
        if isinstance(limit, (str, bool)) or isinstance(value, str):
            return math.inf if (value == limit) == (relation == "==") else -math.inf
        if value == limit:  # also where both are infinite
            return TINIEST if "=" in relation and relation != "!=" else -TINIEST
        if relation in (">", ">="):
            size = value - limit
        elif relation in ("<", "<="):
            size = limit - value
        else:
            size = abs(value - limit) * (-1.0 if relation == "==" else 1.0)
        return -math.inf if size != size else size


@dataclass(frozen=True)
class Window:
    """From when to when after a moment, both ends included [ns]."""

    low: int = 0
    high: int = FOREVER

    def __post_init__(self) -> None:
        if not 0 <= self.low <= self.high:
            raise ValueError("must begin at 0 or later, and not end before it begins")


@dataclass(frozen=True)
class Not:
    """The formula does not hold."""

    formula: Formula


@dataclass(frozen=True)
class And:
    """All of them hold."""

    formulas: tuple[Formula, ...]


@dataclass(frozen=True)
class Always:
    """The formula holds at every moment of the window."""

    formula: Formula
    window: Window = Window()


@dataclass(frozen=True)
class Until:
    """`then` holds at a moment of the window, and `first` from now to just before it."""

    first: Formula
    then: Formula
    window: Window = Window()


@dataclass(frozen=True)
class Finally:
    """The formula holds at the end, and so for ever: eventually always."""

    formula: Formula


Formula = Predicate | Not | And | Always | Until | Finally


def negation(formula: Formula) -> Formula:
    """Return the opposite, without a double negation."""
    return formula.formula if isinstance(formula, Not) else Not(formula)


def one_of(*formulas: Formula) -> Formula:
    """Return that at least one holds."""
    return Not(And(tuple(map(negation, formulas))))


def implies(premise: Formula, conclusion: Formula) -> Formula:
    """Return that the second holds wherever the first does."""
    return one_of(negation(premise), conclusion)


def eventually(formula: Formula, window: Window = Window()) -> Formula:
    """Return that it holds at some moment of the window."""
    return Not(Always(negation(formula), window))


def never(formula: Formula, window: Window = Window()) -> Formula:
    """Return that it holds at no moment of the window."""
    return Always(negation(formula), window)


def unless(first: Formula, then: Formula, window: Window = Window()) -> Formula:
    """Return the weak until: `first` until `then`, or to the end of the window if that never comes."""
    return one_of(Until(first, then, window), Always(first, Window(0, window.high)))


def parts(formula: Formula) -> tuple[Formula, ...]:
    """Return what a formula is made of."""
    match formula:
        case Predicate():
            return ()
        case And(formulas):
            return formulas
        case Until(first, then):
            return first, then
        case Not(inner) | Always(inner) | Finally(inner):
            return (inner,)


def predicates(formula: Formula) -> Iterator[Predicate]:
    """Yield its predicates, from left to right."""
    if isinstance(formula, Predicate):
        yield formula
    for part in parts(formula):
        yield from predicates(part)


def begins_ns(formula: Formula) -> int:
    """Return the earliest moment that it looks at [ns]."""
    if isinstance(formula, Predicate):
        return 0
    if isinstance(formula, Until):
        return min(begins_ns(formula.first), formula.window.low + begins_ns(formula.then))
    own = formula.window.low if isinstance(formula, Always) else 0
    return own + min(map(begins_ns, parts(formula)))


def depth(formula: Formula) -> int:
    """Return how deeply it is nested."""
    return 1 + max(map(depth, parts(formula)), default=0)
