"""How far a formula is from being otherwise: a number, and the moment and the predicate it comes from."""

from __future__ import annotations

import math
from collections.abc import Iterable
from operator import itemgetter
from typing import NamedTuple

TINIEST = math.ulp(0.0)
"""A margin is never 0: what just holds has this one, what just does not its negative."""


class Margin(NamedTuple):
    """The robustness of a formula: by how much what it looks at may be off; positive if it holds."""

    size: float
    """In the unit of its predicate; infinite where nothing can be measured, as of texts."""
    at_ns: int
    """When the value was measured that it comes from: the worst moment [ns]."""
    predicate: int
    """Whose value it was: index in `Monitor.predicates`."""
    value: float | bool | str = False
    """That value."""

    @property
    def holds(self) -> bool:
        """Whether the formula holds."""
        return self.size > 0.0

    @property
    def number(self) -> float | None:
        """The size as a verdict has it; None where nothing can be measured."""
        return None if math.isinf(self.size) else 0.0 if abs(self.size) == TINIEST else self.size

    def __neg__(self) -> Margin:
        return Margin(-self.size, self.at_ns, self.predicate, self.value)


SIZE = itemgetter(0)
"""Returns a margin's size."""


def lowest(margins: Iterable[Margin]) -> Margin:
    """Return the smallest one, the first of equal ones."""
    return min(margins, key=SIZE)


UNKNOWN = (Margin(-math.inf, 0, -1), Margin(math.inf, 0, -1))
"""Between which a margin lies of which nothing is known."""
