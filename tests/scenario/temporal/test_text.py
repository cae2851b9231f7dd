"""The text of formulas: what binds to what, windows and values."""

from __future__ import annotations

import pytest

from twin.scenario.temporal import (
    FOREVER,
    Always,
    And,
    Finally,
    Formula,
    Monitor,
    Not,
    Predicate,
    Until,
    Window,
    eventually,
    implies,
    never,
    one_of,
    unless,
)
from twin.scenario.temporal.text import DEEPEST, Raw, parse

S = 1_000_000_000
P, Q, R = (Predicate(name, "==", True) for name in "pqr")


def compare(signal: str, relation: str, raw: Raw) -> Formula:
    return Predicate(signal, relation, raw)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("p", P),
        ("p or q and r", one_of(P, And((Q, R)))),
        ("(p or q) and r", And((one_of(P, Q), R))),
        ("p and q and r", And((P, Q, R))),
        ("p implies q implies r", implies(P, implies(Q, R))),
        ("p or q -> r", implies(one_of(P, Q), R)),
        ("not p and q", And((Not(P), Q))),
        ("not not p", P),
        ("always p and q", And((Always(P), Q))),
        ("always eventually p", Always(eventually(P))),
        ("finally not p", Finally(Not(P))),
        ("never[1, 2] p", never(P, Window(S, 2 * S))),
        ("always[500 ms, 1 min](p)", Always(P, Window(S // 2, 60 * S))),
        ("eventually[0, 2) p", eventually(P, Window(0, 2 * S - 1))),
        ("always[3, inf] p", Always(P, Window(3 * S, FOREVER))),
        ("always[3, inf) p", Always(P, Window(3 * S, FOREVER))),
        ("p until q and r", And((Until(P, Q), R))),
        ("always p until[1, 2] q", Until(Always(P), Q, Window(S, 2 * S))),
        ("p unless[1, 2] q", unless(P, Q, Window(S, 2 * S))),
        ("x >= -1.5e3", Predicate("x", ">=", -1500.0)),
        ("x>3 cm", Predicate("x", ">", "3 cm")),
        ("x > 3 m/s and p", And((Predicate("x", ">", "3 m/s"), P))),
        ("x > 3 or p", one_of(Predicate("x", ">", 3.0), P)),
        ("x within [1 m, 2]", And((Predicate("x", ">=", "1 m"), Predicate("x", "<=", 2.0)))),
        ("p != true", Predicate("p", "!=", True)),
        ("state == 'not done'", Predicate("state", "==", "not done")),
        ('state == "it\'s"', Predicate("state", "==", "it's")),
        ("state == done", Predicate("state", "==", "done")),
        ("a.speed < 1", Predicate("a.speed", "<", 1.0)),
        ("to( 1 m,2 ) < 1", Predicate("to( 1 m,2 )", "<", 1.0)),
        ("/a/b.c[0].d > 1", Predicate("/a/b.c[0].d", ">", 1.0)),
        ("../my file.py:A > 1", None),
        ("../my_file.py:A > 1", Predicate("../my_file.py:A", ">", 1.0)),
        ("package.module:Class.Inner > 1", Predicate("package.module:Class.Inner", ">", 1.0)),
        ("notable", Predicate("notable", "==", True)),
    ],
)
def test_what_a_text_means(text: str, formula: Formula | None) -> None:
    if formula is None:
        with pytest.raises(ValueError, match="at character"):
            parse(text, compare)
    else:
        assert parse(text, compare) == formula


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "at character 1: the end instead of a signal"),
        ("p q", r"at character 1 \('p q'\): 'p' instead of an operator"),
        ("p and", "the end instead of a signal"),
        ("p > ", "the end instead of a number, a 'text', true or false"),
        ("p)", r"'\)' instead of and, or, implies, until, unless or the end"),
        ("always[p, 3] q", "'p' instead of a time, such as 2 s or 1 min, or inf"),
        ("always[1 kg, 3] q", "a time must have a unit of time"),
        ("always[1, 3, 4] q", r"',' instead of \]"),
        ("x within 3", r"instead of \["),
        ("p & q", r"at character 3 \('& q'\): what stands there begins no signal, number or operator"),
        ("(" * (DEEPEST + 1) + "p" + ")" * (DEEPEST + 1), "is nested too deeply"),
        ("not " * 2 * DEEPEST + "p", "is nested too deeply"),
    ],
)
def test_what_is_none(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse(text, compare)


def test_unless_asks_for_the_first_from_the_beginning() -> None:
    first, then = Predicate("x", "<", 1.0), Predicate("y", ">", 0.0)
    for x, holds in (((2.0, 0.0, 0.0), False), ((0.0, 0.0, 0.0), True), ((0.0, 0.0, 2.0), True)):
        monitor = Monitor(unless(first, then, Window(1, 1)))
        for t, value in enumerate(x):
            monitor.take("x", t, value)
            monitor.take("y", t, 0.0)
        monitor.finish()
        assert monitor.verdict is holds
