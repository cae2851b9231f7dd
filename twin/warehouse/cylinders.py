"""Groups of upright cylinders in arena files: what benchmarks of obstacle avoidance are built of."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated

from pydantic import Field

from twin.strict_yaml import Fault, StrictModel
from twin.warehouse.arena_types import Colour, Interval, Length, Point


class CylindersEntry(StrictModel):
    """Cylinders of one size that stand upright; they may touch each other."""

    centres: Annotated[tuple[Point, ...], Field(min_length=1)]
    radius: Length
    height: Length = 1.0
    colour: Colour = "grey"

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point [m] is inside one of them."""
        return min(math.dist((x, y), centre) for centre in self.centres) <= self.radius


def outside(groups: Mapping[str, CylindersEntry], hall_x: Interval, hall_y: Interval) -> Iterator[Fault]:
    """Yield a fault for each cylinder that is not wholly in the hall."""
    for name, group in groups.items():
        r = group.radius
        for index, (x, y) in enumerate(group.centres):
            if not (hall_x[0] + r <= x <= hall_x[1] - r and hall_y[0] + r <= y <= hall_y[1] - r):
                text = f"a cylinder of '{name}' at ({x:g}, {y:g}) reaches out of the hall"
                extent = f"x {hall_x[0]:g} to {hall_x[1]:g}, y {hall_y[0]:g} to {hall_y[1]:g}"
                yield Fault(("cylinders", name, "centres", index), f"{text} ({extent})")
