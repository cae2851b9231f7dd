"""Factors that several put on one quantity."""

from __future__ import annotations

import math


class Factors(dict[object, float]):
    """A factor of each who has one; without any, `product` is exactly 1."""

    def put(self, who: object, factor: float | None) -> None:
        """Set somebody's factor; None: they have none."""
        if factor is None:
            self.pop(who, None)
        else:
            self[who] = factor

    @property
    def product(self) -> float:
        """Of all factors."""
        return math.prod(self.values(), start=1.0)
