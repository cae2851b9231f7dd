"""Bounds of parameters, as annotated-types has them: pydantic understands them, and needs not be imported."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from annotated_types import Ge, Gt, Interval, Le, Lt

Positive = Gt(0)
NotNegative = Ge(0)
Negative = Lt(0)
NotPositive = Le(0)
Fraction = Interval(ge=0, le=1)
"""From 0 to 1."""

LARGEST, SMALLEST = 1e15, 1e-100
"""Of all numbers: beyond are none of the physical world, and squares and ratios leave the floats."""


@dataclass(frozen=True)
class Bounds:
    """Between what a number must lie; None: on that side it is open."""

    low: Gt | Ge | None = None
    high: Lt | Le | None = None

    @classmethod
    def of(cls, metadata: Iterable[object]) -> Bounds:
        """Return the bounds among the metadata of an annotation; later ones go before earlier ones."""
        low: Gt | Ge | None = None
        high: Lt | Le | None = None
        for one in metadata:
            for part in one if isinstance(one, Interval) else (one,):
                if isinstance(part, Gt | Ge):
                    low = part
                elif isinstance(part, Lt | Le):
                    high = part
        return cls(low, high)

    @property
    def least(self) -> float | None:
        """The lower edge, valid itself or not."""
        return _edge(self.low)

    @property
    def most(self) -> float | None:
        """The upper edge, valid itself or not."""
        return _edge(self.high)

    @property
    def said(self) -> str:
        """What is valid, such as 'greater than 0 and at most 1000'; '' without bounds."""
        words = {Gt: "greater than", Ge: "at least", Lt: "less than", Le: "at most"}
        ends = [one for one in (self.low, self.high) if one is not None]
        return " and ".join(f"{words[type(end)]} {_edge(end):.12g}" for end in ends)

    def hold(self, value: float) -> bool:
        """Return whether a number lies between them; NaN never does."""
        low, high = self.low, self.high
        above = low is None or (value > low.gt if isinstance(low, Gt) else value >= low.ge)  # type: ignore[operator]
        below = high is None or (value < high.lt if isinstance(high, Lt) else value <= high.le)  # type: ignore[operator]
        return bool(above and below)


def _edge(end: Gt | Ge | Lt | Le | None) -> float | None:
    match end:
        case Gt(edge) | Ge(edge) | Lt(edge) | Le(edge):
            return edge  # type: ignore[return-value]
    return None
