"""What a sweep varies, as it is written on a command line: `KEY=VALUES`, and seeds."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal

from twin.errors import ScenarioError
from twin.scenario import seeds

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_UNIT = r"\s*(?P<unit>[A-Za-z%°µ][^\s,:]*)?"
_STEPS = re.compile(rf"(?P<first>{_NUMBER}):(?P<last>{_NUMBER}):(?P<step>{_NUMBER}){_UNIT}")
_INTERVAL = re.compile(rf"(?P<low>{_NUMBER})\.\.(?P<high>{_NUMBER}){_UNIT}")
_MOST = 1_000_000
"""Values of an axis, seeds, runs in all."""
_DIGITS = 6
"""Of values that are drawn: so many fit a command line that is to be read and typed again."""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One key of the scenario, and the values that it takes: a list, or an interval that is sampled."""

    key: str
    """Dotted, as of `twin run --set`."""
    values: tuple[str, ...] = ()
    """YAML texts."""
    low: float = 0.0
    high: float = 0.0
    """Bounds of an interval, whose `values` are empty."""
    unit: str = ""
    """Behind each number of the interval."""


def parse_axis(word: str) -> Axis:
    """Read `KEY=VALUES`: `1,2,3`, `0.1:0.5:0.1` (with its end), `0.1..0.5`; units stand behind.

    Raises:
        ScenarioError: It is none of these.
    """
    key, equals, text = word.partition("=")
    if not equals or not key:
        raise ScenarioError(f"--set {word}: must be KEY=VALUES, such as --set robots.0.pose.x=0,0.5,1")
    if key == "seed":
        raise ScenarioError(f"--set {word}: seeds are swept with --seeds, such as --seeds 0:100")
    found = _INTERVAL.fullmatch(text.strip())
    if found:
        low, high = float(found["low"]), float(found["high"])
        if not low < high:
            raise ScenarioError(f"--set {word}: the interval must begin with its lower end")
        return Axis(key=key, low=low, high=high, unit=found["unit"] or "")
    values = [value for part in _split(text) for value in _steps(word, part)]
    twice = sorted({value for value in values if values.count(value) > 1}) if len(values) < 1000 else []
    if twice:
        raise ScenarioError(f"--set {word}: the value {twice[0]} is there twice")
    return Axis(key=key, values=tuple(values))


def _split(text: str) -> list[str]:
    """Split at commas that are neither in brackets nor in quotes."""
    parts, depth, quote = [""], 0, ""
    for character in text:
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        else:
            depth += (character in "[{") - (character in "]}")
        if character == "," and not quote and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return [part.strip() for part in parts]


def _steps(word: str, part: str) -> list[str]:
    """Return the values of `first:last:step`, or the one value that a part is."""
    found = _STEPS.fullmatch(part)
    if found is None:
        if not part:
            raise ScenarioError(f"--set {word}: a value is missing; separate values by single commas")
        return [part]
    first, last, step = (Decimal(found[name]) for name in ("first", "last", "step"))
    if step == 0 or (last - first) / step < 0:
        raise ScenarioError(f"--set {word}: the step must lead from {first} to {last}")
    count = int((last - first) / step) + 1
    if count > _MOST:
        raise ScenarioError(f"--set {word}: {count} values; at most {_MOST} are swept")
    unit = f" {found['unit']}" if found["unit"] else ""
    return [f"{(first + index * step).normalize():f}{unit}" for index in range(count)]


def parse_seeds(text: str) -> tuple[int, ...]:
    """Read `--seeds`; raises ScenarioError."""
    try:
        return seeds.parse_seeds(text, _MOST)
    except ValueError as wrong:
        raise ScenarioError(f"--seeds {text}: {wrong}") from None


def points(axes: Sequence[Axis], samples: int | None) -> tuple[dict[str, str], ...]:
    """Return the overrides of every point: each combination of the lists, each with every sample.

    Intervals are sampled together by one Latin hypercube (McKay, Beckman & Conover 1979), the same in every
    sweep: of n samples, each n-th of each interval holds one.

    Args:
        axes: In the order of the columns.
        samples: How many to draw of the intervals.

    Raises:
        ScenarioError: A key is there twice; intervals without a number of samples, or that without them.
    """
    keys = [axis.key for axis in axes]
    for key in keys:
        if keys.count(key) > 1:
            raise ScenarioError(f"--set {key}: is there twice; write all its values into one, {key}=1,2,3")
    intervals = [axis for axis in axes if not axis.values]
    if intervals and samples is None:
        axis = intervals[0]
        word = f"{axis.key}={axis.low:g}..{axis.high:g}"
        raise ScenarioError(f"--set {word}: an interval is sampled; say how often, with --sample 100")
    if samples is not None and not intervals:
        raise ScenarioError("--sample draws from intervals; give one, such as --set KEY=0.1..0.5")
    grid = [[(axis.key, value) for value in axis.values] for axis in axes if axis.values]
    count = math.prod(map(len, grid)) * (samples or 1)
    if count > _MOST:
        raise ScenarioError(f"{count} combinations of values; at most {_MOST} are swept")
    drawn = list(_hypercube(intervals, samples or 0)) if intervals else [{}]
    combined = (dict(chosen) | sample for chosen in itertools.product(*grid) for sample in drawn)
    return tuple({key: point[key] for key in keys} for point in combined)


def _hypercube(axes: Sequence[Axis], samples: int) -> Iterator[dict[str, str]]:
    import numpy as np
    from scipy.stats import qmc

    unit = qmc.LatinHypercube(len(axes), rng=np.random.Generator(np.random.Philox(0))).random(samples)
    for row in qmc.scale(unit, [axis.low for axis in axes], [axis.high for axis in axes]):
        yield {
            axis.key: f"{value:.{_DIGITS}g}{f' {axis.unit}' if axis.unit else ''}"
            for axis, value in zip(axes, row, strict=True)
        }


def number(text: str) -> tuple[float, str] | None:
    """Return the number and the unit of a value, None if it is no number."""
    found = re.fullmatch(rf"(?P<number>{_NUMBER}){_UNIT}", text.strip())
    return None if found is None else (float(found["number"]), found["unit"] or "")
