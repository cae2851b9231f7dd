"""Verdicts and margins of 1000 random formulas are those of metric-temporal-logic 0.1.4.

It means the same by piecewise constant signals that keep their last value, except for two things: its windows
do not include their end, and its until adds `or then never holds` to the weak one, which changes margins
though not verdicts. So windows end half a step later here, and for margins an until is spelled out.
"""

from __future__ import annotations

import random
from typing import Any

import mtl
import pytest

from tests.scenario.temporal.random_formulas import Trace, random_formula, random_trace
from tests.scenario.temporal.test_monitor import online
from twin.scenario.temporal import FOREVER, Always, And, Finally, Formula, Not, Predicate, Until

LENGTH = 6
ATOMS: dict[Predicate, Any] = {}


def translated(formula: Formula, *, spelled_out: bool) -> Any:
    """Return a formula as mtl's."""

    def of(part: Formula) -> Any:
        match part:
            case Predicate():
                return ATOMS.setdefault(part, mtl.ast.AtomicPred(f"p{len(ATOMS)}"))
            case Not(inner):
                return ~of(inner)
            case And(formulas):
                first, *rest = map(of, formulas)
                for one in rest:
                    first &= one
                return first
            case Always(inner, window):
                return of(inner).always(lo=window.low, hi=end(window.high))
            case Finally(inner):
                return of(inner).always().eventually()
            case Until(first, then, window):
                one, other, low = of(first), of(then), window.low
                if spelled_out:
                    return any_of(
                        other.eventually(lo=k, hi=k + 0.5) & (one.always(lo=0, hi=k) if k else mtl.TOP)
                        for k in range(low, min(window.high, max(low, LENGTH)) + 1)
                    )
                found = other.eventually(lo=low, hi=end(window.high))
                found &= one.until(other).eventually(lo=low, hi=low + 0.5)
                return found & one.always(lo=0, hi=low) if low else found
        raise AssertionError(part)

    def end(high: int) -> float:
        return float("inf") if high == FOREVER else high + 0.5

    def any_of(formulas: Any) -> Any:
        found = mtl.BOT
        for one in formulas:
            found |= one
        return found

    return of(formula)


def data(trace: Trace) -> dict[str, list[tuple[int, float]]]:
    """Return the margins of all predicates over time."""
    return {
        atom.id: [(t, predicate.margin(value)) for t, value in trace[predicate.signal]]
        for predicate, atom in ATOMS.items()
    }


@pytest.mark.parametrize("seed", range(4))
def test_verdicts_and_margins_of_1000_formulas(seed: int) -> None:
    rng = random.Random(100 + seed)
    for _ in range(250):
        formula = random_formula(rng, rng.choice((1, 2, 2, 2, 3)), longest=3)
        trace = random_trace(rng, LENGTH)
        ATOMS.clear()
        whole, own_until = (translated(formula, spelled_out=out) for out in (True, False))
        values = data(trace)
        margin = online(formula, trace, rng)[0].finish()
        assert margin is not None
        assert margin.size == pytest.approx(whole(values, time=0, quantitative=True), abs=1e-300), (
            formula,
            trace,
        )
        booleans = {name: [(t, v > 0) for t, v in one] for name, one in values.items()}
        assert margin.holds is own_until(booleans, time=0, quantitative=False), (formula, trace)
