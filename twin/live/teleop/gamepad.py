"""A gamepad by Linux's joystick interface (its joystick-api.rst): events of 8 bytes."""

from __future__ import annotations

import os
import struct
from pathlib import Path

from twin.errors import TwinError
from twin.live.teleop.keys import STILL, Command

_EVENT = struct.Struct("=IhBB")
"""Time [ms], value, kind, number."""
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_TURN, _DRIVE = 0, 1
"""Axes of the left stick: to the right and towards oneself are positive."""
_DEAD_MAN = 4
"""The left shoulder button."""
_DEAD_ZONE = 0.1


class Gamepad:
    """Drives by the left stick while the left shoulder button is held."""

    def __init__(self, path: Path) -> None:
        """Open a device.

        Raises:
            TwinError: It cannot be read.
        """
        self.path = path
        try:
            self._fd: int | None = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as fault:
            raise TwinError(f"{path}: no gamepad can be read there: {fault.strerror}") from None
        self._axes: dict[int, float] = {}
        self._buttons: dict[int, bool] = {}

    @staticmethod
    def first() -> Path | None:
        """Return the first device; None: there is none."""
        return min(Path("/dev/input").glob("js[0-9]*"), default=None)

    def command(self, speed: float, turn: float) -> Command | None:
        """Take in what was moved since, and return what it asks for; None: the button is not held.

        Args:
            speed: At the stick's end [m/s].
            turn: At the stick's end [rad/s].
        """
        self._read()
        if not self._buttons.get(_DEAD_MAN):
            return None
        drive, side = self._axes.get(_DRIVE, 0.0), self._axes.get(_TURN, 0.0)
        x = 0.0 if abs(drive) < _DEAD_ZONE else -drive * speed
        yaw = 0.0 if abs(side) < _DEAD_ZONE else -side * turn
        return STILL if x == yaw == 0.0 else Command(x=x, yaw=yaw)

    def close(self) -> None:
        """Leave the device. Harmless when repeated."""
        if self._fd is not None:
            os.close(self._fd)
        self._fd = None
        self._buttons.clear()

    def _read(self) -> None:
        while self._fd is not None:
            try:
                told = os.read(self._fd, _EVENT.size * 64)
            except BlockingIOError:
                return
            except OSError:
                told = b""
            if not told:  # it was unplugged: nobody holds the button
                self.close()
                return
            for _, value, kind, number in _EVENT.iter_unpack(told[: len(told) // 8 * 8]):
                if kind & ~_INITIAL == _AXIS:
                    self._axes[number] = value / 32767.0
                elif kind & ~_INITIAL == _BUTTON:
                    self._buttons[number] = bool(value)
