"""What keys mean, in the two layouts that ROS users know, without a terminal and without clocks.

Keys, speeds and steps are those of teleop_twist_keyboard 2.4 and turtlebot3_teleop 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple


class Command(NamedTuple):
    """Velocity of the base in its own frame [m/s, rad/s]."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0


STILL = Command()


class Layout(StrEnum):
    """Which keys drive."""

    TWIST = "twist"
    TURTLEBOT3 = "turtlebot3"


_MOVES = {
    "i": (1, 0, 0, 0), "o": (1, 0, 0, -1), "j": (0, 0, 0, 1), "l": (0, 0, 0, -1), "u": (1, 0, 0, 1),
    ",": (-1, 0, 0, 0), ".": (-1, 0, 0, 1), "m": (-1, 0, 0, -1),
    "O": (1, -1, 0, 0), "I": (1, 0, 0, 0), "J": (0, 1, 0, 0), "L": (0, -1, 0, 0), "U": (1, 1, 0, 0),
    "<": (-1, 0, 0, 0), ">": (-1, -1, 0, 0), "M": (-1, 1, 0, 0), "t": (0, 0, 1, 0), "b": (0, 0, -1, 0),
}  # fmt: skip
"""Signs of x, y, z, yaw."""
_SCALES = {
    "q": (1.1, 1.1),
    "z": (0.9, 0.9),
    "w": (1.1, 1.0),
    "x": (0.9, 1.0),
    "e": (1.0, 1.1),
    "c": (1.0, 0.9),
}
"""Of the speeds of driving and turning."""
_STEPS = {"w": (0.01, 0.0), "x": (-0.01, 0.0), "a": (0.0, 0.1), "d": (0.0, -0.1)}
"""To the velocities of driving and turning [m/s, rad/s]."""
_ARROWS = {
    Layout.TWIST: dict(zip("ABCD", "i,lj", strict=True)),
    Layout.TURTLEBOT3: dict(zip("ABCD", "wxda", strict=True)),
}

HELP = {
    Layout.TWIST: """\
   u    i    o      drive, turn, both; with shift sideways
   j    k    l      t, b: up, down; any other key: stop
   m    ,    .
q/z faster, slower; w/x only driving; e/c only turning, by 10 % each""",
    Layout.TURTLEBOT3: """\
        w           w/x: 0.01 m/s more, less
   a    s    d      a/d: 0.1 rad/s to the left, to the right
        x           space, s: stop""",
}


@dataclass(frozen=True, kw_only=True)
class TeleopConfig:
    """How keys drive."""

    layout: Layout = Layout.TWIST
    speed: float = 0.5
    """Of driving [m/s]: what a key gives, or in turtlebot3's layout the most that keys add up to."""
    turn: float = 1.0
    """Of turning, in the same way [rad/s]."""
    dead_man: float = 0.7
    """Without a key for so long it stops [s]: a keyboard repeats a key that is held after up to 0.66 s.
    0: only a key stops it, as in the originals."""


class Keys:
    """Goes by one key after the other; every `now_ns` is by a clock that is never set [ns]."""

    def __init__(self, config: TeleopConfig) -> None:
        self.config = config
        self.speed, self.turn = config.speed, config.turn
        """What keys give, or add up to, now [m/s, rad/s]."""
        self._command = STILL
        self._pressed_ns = 0

    def press(self, key: str, now_ns: int) -> None:
        """Take a character; arrows are 'arrow A' (up) … 'arrow D' (left), by the end of their sequences."""
        before = self.command(now_ns)  # what has run out stays so
        if key.startswith("arrow "):
            key = _ARROWS[self.config.layout].get(key[-1], " ")
        if self.config.layout is Layout.TURTLEBOT3:
            self._step(key, before)
        elif key in _SCALES:
            faster, quicker = _SCALES[key]
            self.speed, self.turn = faster * self.speed, quicker * self.turn
            x, y, z, yaw = before
            self._command = Command(faster * x, faster * y, faster * z, quicker * yaw)
        else:
            x, y, z, yaw = _MOVES.get(key, (0, 0, 0, 0))
            self._command = Command(x * self.speed, y * self.speed, z * self.speed, yaw * self.turn)
        self._pressed_ns = now_ns

    def command(self, now_ns: int) -> Command:
        """Return what is asked for now."""
        limit = self.config.dead_man
        if limit and now_ns - self._pressed_ns > limit * 1e9:
            self._command = STILL
        return self._command

    def _step(self, key: str, before: Command) -> None:
        if key not in _STEPS:
            self._command = STILL
            return
        x, yaw = before.x + _STEPS[key][0], before.yaw + _STEPS[key][1]
        self._command = Command(
            x=round(max(-self.speed, min(self.speed, x)), 9),
            yaw=round(max(-self.turn, min(self.turn, yaw)), 9),
        )
