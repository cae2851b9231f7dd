"""Margins of 1000 random formulas are those of rtamt 0.4.10, sampled and in dense time.

It needs an environment of its own: `make oracle` makes it and names its python in TWIN_STL_ORACLE. Two things
are other: sampled, its traces end, and windows with them, so they are given their last value for as long as a
formula looks; in dense time its until wants the first formula also when the second one comes, so there are
none, but windows and values at any time.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
from pathlib import Path

import pytest

from tests.scenario.temporal.random_formulas import Trace, random_formula, random_trace
from tests.scenario.temporal.test_monitor import online
from twin.scenario.temporal import FOREVER, Always, And, Finally, Formula, Not, Predicate, Until
from twin.scenario.temporal.formula import parts

PYTHON = os.environ.get("TWIN_STL_ORACLE", "")
pytestmark = pytest.mark.skipif(
    not Path(PYTHON or "-").exists(), reason="TWIN_STL_ORACLE names no python; make oracle"
)

LENGTH, STEP = 12, 3
LONG = LENGTH * STEP + 4
"""Of windows without an end: what is longer than a trace is as good."""


def spelled(formula: Formula) -> str:
    """Return a formula as rtamt reads it."""
    match formula:
        case Predicate(signal, relation, limit):
            return f"({signal} {relation} {limit})"
        case Not(inner):
            return f"(not {spelled(inner)})"
        case And(formulas):
            return f"({' and '.join(map(spelled, formulas))})"
        case Always(inner, window):
            return f"(always{_window(window.low, window.high)} {spelled(inner)})"
        case Finally(inner):
            return f"(always[{LONG}, {LONG}] {spelled(inner)})"
        case Until(first, then, window):
            return f"({spelled(first)} until{_window(window.low, window.high)} {spelled(then)})"


def _window(low: int, high: int) -> str:
    return f"[{low}, {LONG if high == FOREVER else high}]"


def _has_until(formula: Formula) -> bool:
    return isinstance(formula, Until) or any(map(_has_until, parts(formula)))


def _answers(questions: list[dict[str, object]]) -> list[float]:
    peer = subprocess.run(
        [PYTHON, str(Path(__file__).with_name("rtamt_peer.py"))],
        input="\n".join(map(json.dumps, questions)),
        capture_output=True,
        text=True,
        check=True,
        env={key: value for key, value in os.environ.items() if not key.startswith("PYTHON")},
    )
    return [float(json.loads(line)) for line in peer.stdout.splitlines()]


def _margin(formula: Formula, trace: Trace, rng: random.Random) -> float:
    margin = online(formula, trace, rng)[0].finish()
    assert margin is not None
    return margin.size


def test_1000_formulas_over_samples() -> None:
    rng = random.Random(7)
    cases = [(random_formula(rng, 3), random_trace(rng, LENGTH)) for _ in range(1000)]
    padding = range(LENGTH, 4 * LONG)
    questions = [
        {
            "time": "discrete",
            "formula": spelled(formula),
            "trace": {
                name: [*values, *((t, values[-1][1]) for t in padding)] for name, values in trace.items()
            },
        }
        for formula, trace in cases
    ]
    for (formula, trace), answer in zip(cases, _answers(questions), strict=True):
        assert _margin(formula, trace, rng) == pytest.approx(answer, abs=1e-300), (formula, trace)


def test_1000_formulas_in_dense_time() -> None:
    rng = random.Random(8)
    cases = []
    while len(cases) < 1000:
        formula, trace = random_formula(rng, 3), random_trace(rng, LENGTH, STEP, regular=False)
        if not _has_until(formula):
            cases.append(
                (formula, {name: [(0, values[0][1]), *values[1:]] for name, values in trace.items()})
            )
    questions = [
        {
            "time": "dense",
            "formula": spelled(formula),
            "trace": {n: [*v, (4 * LONG, v[-1][1])] for n, v in trace.items()},
        }
        for formula, trace in cases
    ]
    for (formula, trace), answer in zip(cases, _answers(questions), strict=True):
        assert _margin(formula, trace, rng) == pytest.approx(answer, abs=1e-300), (formula, trace)
