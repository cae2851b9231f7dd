"""Formulas as text: `always[0, 60](clearance > 5 cm) and eventually(/odom.twist.twist.linear.x > 0.3)`.

From what binds least to what binds most:

    premise implies conclusion                    (or ->)
    this or that
    this and that
    this until that, this until[0, 9 s] that      and `unless`, which does not ask for the end
    not this, always[2 s, 60 s] this, eventually[0, 60) this, never this, finally this
    signal > 3, signal within [1 cm, 5 cm], state == 'driving', done, (any formula)

A signal is a name, `robot.name`, `name(arguments)`, or a field of a topic, `/topic.field[0]`. A bracket is in
seconds or has units; `]` includes the end, `)` does not; `inf` is never.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

from twin.errors import nearest
from twin.scenario.temporal.formula import (
    FOREVER,
    Always,
    And,
    Finally,
    Formula,
    Predicate,
    Until,
    Window,
    depth,
    eventually,
    implies,
    negation,
    never,
    one_of,
    unless,
)

Raw = float | str | bool
"""A value as it stands in the text: a number, a text with a unit, a word, true or false."""
Compare = Callable[[str, str, Raw], Formula]
"""Returns the predicate of a signal, a relation and a value; raises ValueError if they do not fit."""

DEEPEST = 40
"""So deeply may formulas be nested."""
NO_RANGE = "within takes the least value first, then the largest"
_UNARY = {"always": Always, "eventually": eventually, "never": never}
_BINARY = {"until": Until, "unless": unless}
KEYWORDS = ("not", "and", "or", "implies", "within", "finally", "true", "false", "inf", *_UNARY, *_BINARY)
_RELATIONS = (">=", "<=", "==", "!=", ">", "<")
_KEYWORD = "|".join(KEYWORDS)
_TOKEN = re.compile(
    rf"""\s*(?:
    (?P<keyword>(?:{_KEYWORD})\b(?![.:/]))
  | (?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?:\s*(?!(?:{_KEYWORD})\b)[A-Za-z°µ][\w/²³^]*)?)
  | (?P<signal>[\w./~-]+\.py:[\w.]+|[A-Za-z_][\w.]*:[\w.]+
      |/[A-Za-z_~][\w/]*(?:\.[A-Za-z_]\w*|\[\d+\])*
      |[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)?(?:\([^()]*\))?)
  | '(?P<single>[^']*)' | "(?P<double>[^"]*)"
  | (?P<symbol>->|>=|<=|==|!=|[-><()\[\],])
    )""",
    re.VERBOSE,
)


class _Token(NamedTuple):
    kind: str
    text: str
    at: int


def parse(text: str, compare: Compare) -> Formula:
    """Return the formula of a text.

    Raises:
        ValueError: It is none; says at which character, and what would be valid.
    """
    return _Parser(text, compare).whole()


class _Parser:
    def __init__(self, text: str, compare: Compare) -> None:
        self._text, self._compare = text, compare
        self._tokens = self._read()
        self._next = self._depth = 0

    def _read(self) -> list[_Token]:
        tokens, at, end = [], 0, len(self._text.rstrip())
        while at < end:
            match = _TOKEN.match(self._text, at)
            if match is None:
                at = end - len(self._text[at:end].lstrip())
                raise self._wrong(at, "what stands there begins no signal, number or operator")
            kind = str(match.lastgroup)
            quoted = kind in ("single", "double")
            tokens.append(_Token("word" if quoted else kind, match[kind], match.start(kind) - quoted))
            at = match.end()
        return [*tokens, _Token("end", "the end", end)]

    def whole(self) -> Formula:
        formula = self._implies()
        if self._token.kind != "end":
            raise self._expected("and, or, implies, until, unless or the end")
        if depth(formula) > 4 * DEEPEST:
            raise ValueError("is nested too deeply")
        return formula

    def _implies(self) -> Formula:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError("is nested too deeply")
        formula = self._or()
        if self._take("implies") or self._take("->"):
            formula = implies(formula, self._implies())
        self._depth -= 1
        return formula

    def _or(self) -> Formula:
        formulas = [self._and()]
        while self._take("or"):
            formulas.append(self._and())
        return formulas[0] if len(formulas) == 1 else one_of(*formulas)

    def _and(self) -> Formula:
        formulas = [self._until()]
        while self._take("and"):
            formulas.append(self._until())
        return formulas[0] if len(formulas) == 1 else And(tuple(formulas))

    def _until(self) -> Formula:
        first = self._unary()
        for word, make in _BINARY.items():
            if self._take(word):
                window = self._window()
                return make(first, self._unary(), window)
        return first

    def _unary(self) -> Formula:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError("is nested too deeply")
        try:
            if self._take("not"):
                return negation(self._unary())
            for word, make in _UNARY.items():
                if self._take(word):
                    window = self._window()
                    return make(self._unary(), window)
            if self._take("finally"):
                return Finally(self._unary())
            if self._take("("):
                formula = self._implies()
                self._need(")")
                return formula
            return self._predicate()
        finally:
            self._depth -= 1

    def _predicate(self) -> Formula:
        signal = self._token
        if signal.kind != "signal":
            raise self._expected("a signal, not, always, eventually, never, finally or (")
        self._next += 1
        if self._take("within"):
            self._need("[")
            low = self._raw()
            self._need(",")
            high = self._raw()
            self._need("]")
            both = (self._predicate_of(signal, ">=", low), self._predicate_of(signal, "<=", high))
            if is_empty(*both):
                raise self._wrong(signal.at, NO_RANGE)
            return And(both)
        for relation in _RELATIONS:
            if self._take(relation):
                return self._predicate_of(signal, relation, self._raw())
        if self._token.kind not in ("end", "keyword", "symbol"):
            self._next -= 1
            raise self._expected("an operator, or a signal and what it is compared with")
        return self._predicate_of(signal, "==", True)

    def _predicate_of(self, signal: _Token, relation: str, raw: Raw) -> Formula:
        try:
            return self._compare(" ".join(signal.text.split()), relation, raw)
        except ValueError as wrong:
            raise self._wrong(signal.at, str(wrong)) from None

    def _raw(self) -> Raw:
        token = self._token
        self._next += 1
        if token.text in ("true", "false") and token.kind == "keyword":
            return token.text == "true"
        if token.kind == "number":
            try:
                return float(token.text)
            except ValueError:
                return token.text
        if token.kind == "word" or (token.kind == "signal" and re.fullmatch(r"\w+", token.text)):
            return token.text
        self._next -= 1
        raise self._expected("a number, a 'text', true or false")

    def _window(self) -> Window:
        if not self._take("["):
            return Window()
        low = self._time()
        self._need(",")
        high = self._time()
        if self._take(")"):
            high -= high != FOREVER
        else:
            self._need("]")
        try:
            return Window(low, high)
        except ValueError as wrong:
            raise ValueError(f"a window {wrong}") from None

    def _time(self) -> int:
        if self._take("inf"):
            return FOREVER
        token = self._token
        if token.kind != "number":
            raise self._expected("a time, such as 2 s or 1 min, or inf")
        self._next += 1
        try:
            return nanoseconds(token.text)
        except ValueError as wrong:
            raise self._wrong(token.at, f"a time {wrong}") from None

    @property
    def _token(self) -> _Token:
        return self._tokens[self._next]

    def _take(self, text: str) -> bool:
        token = self._token
        if token.text != text or token.kind not in ("keyword", "symbol"):
            return False
        self._next += 1
        return True

    def _need(self, text: str) -> None:
        if not self._take(text):
            raise self._expected(text)

    def _expected(self, what: str) -> ValueError:
        token = self._token
        found = token.text if token.kind == "end" else f"'{token.text}'"
        hint = ""
        if token.kind == "signal" and token.text.isidentifier():
            words = nearest(token.text.lower(), KEYWORDS)
            hint = f"; {words.partition('?')[0]}?" if words.startswith("did you mean") else ""
        return self._wrong(token.at, f"{found} instead of {what}{hint}")

    def _wrong(self, at: int, message: str) -> ValueError:
        there = self._text[at : at + 20].strip()
        quoted = f" ('{there}')" if there else ""
        return ValueError(f"at character {at + 1}{quoted}: {message}")


def is_empty(low: Formula, high: Formula) -> bool:
    """Return whether no number fulfils both ends of a `within`."""
    ends = [end.limit for end in (low, high) if isinstance(end, Predicate) and isinstance(end.limit, float)]
    return len(ends) == 2 and ends[0] > ends[1]


def nanoseconds(raw: Raw) -> int:
    """Return a time as a file gives it, in seconds or with a unit; raises ValueError."""
    from twin.parameters.units import SECONDS

    with suppress(ValueError):
        raw = float(raw)
    return round(SECONDS.parse(raw) * 1e9)
