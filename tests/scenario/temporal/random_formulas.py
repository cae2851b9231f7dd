"""Random signals and formulas, and what they mean by the letter of docs/checks.md."""

from __future__ import annotations

import random
from collections.abc import Mapping
from functools import cache

from twin.scenario.temporal import (
    FOREVER,
    Always,
    And,
    Finally,
    Formula,
    Not,
    Predicate,
    Until,
    Window,
    eventually,
    one_of,
)

Trace = Mapping[str, list[tuple[int, float]]]
"""By signal: values, each from its time on [ns]."""


def random_formula(rng: random.Random, depth: int, step: int = 1, longest: int = 5) -> Formula:
    """Return a formula whose windows are multiples of `step`."""
    if depth == 0:
        relation = rng.choice([">", ">=", "<", "<="])
        return Predicate(rng.choice("xyz"), relation, float(rng.randint(-3, 3)))  # type: ignore[arg-type]
    inner = [random_formula(rng, rng.randrange(depth), step, longest) for _ in range(2)]
    low = rng.randrange(longest)
    high = FOREVER if rng.random() < 0.25 else (low + rng.randrange(longest)) * step
    window = Window(low * step, high)
    makers = (
        lambda: Not(inner[0]),
        lambda: And(tuple(inner)),
        lambda: one_of(*inner),
        lambda: Always(inner[0], window),
        lambda: eventually(inner[0], window),
        lambda: Until(inner[0], inner[1], window),
        lambda: Finally(inner[0]),
    )
    return rng.choice(makers)()


def random_trace(rng: random.Random, length: int, step: int = 1, *, regular: bool = True) -> Trace:
    """Return signals of small whole numbers, so that margins are often equal, and often 0."""
    moments = range(length)
    trace = {}
    for name in "xyz":
        taken = moments if regular else sorted({rng.randrange(length) for _ in moments})
        trace[name] = [(i * step, float(rng.randint(-4, 4))) for i in taken]
    return trace


def by_definition(formula: Formula, trace: Trace, end: int) -> tuple[float, bool]:
    """Return margin (0 is 0) and verdict at the start, moment by moment; all is the same from `end` on."""

    @cache
    def at(part: Formula, t: int) -> tuple[float, bool]:
        t = min(t, end)
        match part:
            case Predicate(signal, relation, limit):
                values = trace[signal]
                value = next((v for since, v in reversed(values) if since <= t), values[0][1])
                size = value - limit if relation[0] == ">" else limit - value
                return size, size > 0 or (size == 0 and "=" in relation)
            case Not(inner):
                size, holds = at(inner, t)
                return -size, not holds
            case And(formulas):
                return min(at(one, t) for one in formulas)
            case Always(inner, window):
                return min(at(inner, s) for s in moments(t, window))
            case Finally(inner):
                return at(inner, end)
            case Until(first, then, window):
                best = (-float("inf"), False)
                for s in moments(t, window):
                    before = [at(first, r) for r in range(t, min(s, end + 1))]
                    best = max(best, min([at(then, s), *before]))
                return best
        raise AssertionError(part)

    def moments(t: int, window: Window) -> range:
        # Of what is beyond the end, once is enough, but an until may still need `first` up to there.
        low = min(t + window.low, end + 1)
        return range(low, min(t + window.high, max(low, end + 1)) + 1)

    return at(formula, 0)
