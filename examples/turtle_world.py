"""The turtle's world without ROS: a square sheet, turtles that drive on it, and what their pens draw.

Numbers and rules are those of turtlesim (ros_tutorials, turtle.cpp and turtle_frame.cpp): 500 × 500 pixels of
which 45 are a metre, steps of 16 ms, a command that lasts for 1 s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

PIXELS, METER = 500, 45
SIZE = (PIXELS - 1) / METER
"""Side of the sheet [m], 11.0888889; the origin is at the lower left."""
STEP_NS = 16_000_000
COMMAND_NS = 1_000_000_000
"""How long a turtle goes on without a new command [ns]."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Pen:
    """Colour (0-255) and width [pixels] of a line; `off` draws none."""

    r: int = 0xB3
    g: int = 0xB8
    b: int = 0xFF
    width: int = 3
    off: bool = False


@dataclass(frozen=True)
class Stroke:
    """A line that was drawn."""

    start: Point
    end: Point
    pen: Pen


class Sheet:
    """What was drawn, as pixels and as strokes."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Start with an empty sheet."""
        self.strokes: list[Stroke] = []
        self._pixels = np.full((PIXELS, PIXELS, 3), -1, np.int16)

    def draw(self, start: Point, end: Point, pen: Pen) -> None:
        """Draw a line, unless the pen is off."""
        if pen.off or start == end:
            return
        self.strokes.append(Stroke(start, end, pen))
        count = max(2, math.ceil(math.dist(start, end) * METER) + 1)
        low, high = (pen.width - 1) // 2, pen.width // 2
        for x, y in np.linspace(start, end, count):
            row, column = _pixel((x, y))
            rows = slice(max(0, row - low), row + high + 1)
            self._pixels[rows, max(0, column - low) : column + high + 1] = pen.r, pen.g, pen.b

    def color(self, at: Point) -> tuple[int, int, int] | None:
        """Return the colour at a point; None where nothing was drawn."""
        r, g, b = self._pixels[_pixel(at)].tolist()
        return None if r < 0 else (r, g, b)


@dataclass
class Turtle:
    """One turtle: where it is, and how it moves."""

    sheet: Sheet
    x: float = SIZE / 2.0
    """[m]."""
    y: float = SIZE / 2.0
    theta: float = 0.0
    """[rad], -pi to pi after a step."""
    pen: Pen = Pen()
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Forward and to the left [m/s], turning left [rad/s]."""
    _until_ns: int = field(default=0, repr=False)

    def command(self, vx: float, vy: float, wz: float, now_ns: int) -> None:
        """Drive so, for a second."""
        self.velocity = (vx, vy, wz)
        self._until_ns = now_ns + COMMAND_NS

    def teleport(self, x: float, y: float, theta: float) -> None:
        """Be at a pose; the pen draws the way."""
        self._move_to(x, y)
        self.theta = theta

    def teleport_relative(self, linear: float, angular: float) -> None:
        """Turn [rad], then go forward [m]; the pen draws the way."""
        self.theta += angular
        self._move_to(self.x + linear * math.cos(self.theta), self.y + linear * math.sin(self.theta))

    def step(self, now_ns: int) -> Point | None:
        """Move on by one step; return where it would have been if a wall was in the way."""
        if now_ns > self._until_ns:
            self.velocity = (0.0, 0.0, 0.0)
        (vx, vy, wz), dt = self.velocity, STEP_NS * 1e-9
        self.theta = wrapped(self.theta + wz * dt)
        c, s = math.cos(self.theta), math.sin(self.theta)
        wanted = self.x + (c * vx - s * vy) * dt, self.y + (s * vx + c * vy) * dt
        inside = _clamped(wanted[0]), _clamped(wanted[1])
        self._move_to(*inside)
        return None if inside == wanted else wanted

    def _move_to(self, x: float, y: float) -> None:
        self.sheet.draw((self.x, self.y), (x, y), self.pen)
        self.x, self.y = x, y


def wrapped(angle: float) -> float:
    """Return an angle [rad] between -pi and pi."""
    return angle - math.tau * math.floor((angle + math.pi) / math.tau)


def _clamped(value: float) -> float:
    return min(max(value, 0.0), SIZE)


def _pixel(at: Point) -> tuple[int, int]:
    """Return row and column, row 0 at the top."""
    return round((SIZE - _clamped(at[1])) * METER), round(_clamped(at[0]) * METER)
