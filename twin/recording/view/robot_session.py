"""One robot that is being looked at: its posture, what is wrong with its file, and what to tell the page."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.models.checks.diagnostic import Diagnostic
from twin.models.description import RobotDescription
from twin.recording.view.posture import Posture, Preset, coordinates

if TYPE_CHECKING:
    from twin.recording.view.robot_view import RobotView

SEED = 0
"""Of the random postures: the same ones in the same order each time."""


class RobotSession:
    """The state behind the page; every method may be called from any thread."""

    def __init__(
        self,
        description: RobotDescription,
        posture: Posture,
        draw: Callable[[RobotDescription, Posture], RobotView],
    ) -> None:
        """Draw the robot and show its first posture.

        Args:
            description: The robot.
            posture: Where its joints stand at first.
            draw: Makes the screen for a robot.
        """
        self._lock = threading.Lock()
        self._draw = draw
        self._rng = np.random.Generator(np.random.Philox(SEED))
        self._diagnostics: tuple[Diagnostic, ...] | None = None
        self._robot_revision = 0
        self._revision = 0
        self._show(description, posture)

    def set(self, values: Mapping[str, float]) -> dict[str, Any]:
        """Move some joints; returns `values()`, raises ModelError for what cannot be set."""
        with self._lock:
            self._posture.set(values)
            return self._moved()

    def preset(self, preset: Preset) -> dict[str, Any]:
        """Move all joints; returns `values()`."""
        with self._lock:
            self._posture.preset(preset, self._rng)
            return self._moved()

    def replace(self, description: RobotDescription, diagnostics: Sequence[Diagnostic]) -> None:
        """Show another version of the robot, in the same posture as far as that exists."""
        with self._lock:
            posture = Posture(description)
            posture.keep(self._posture)
            self._diagnostics = tuple(diagnostics)
            self._screen.close()
            self._show(description, posture)

    def diagnose(self, diagnostics: Sequence[Diagnostic]) -> None:
        """Tell what was found in the file; with errors the robot stays as it was."""
        with self._lock:
            self._diagnostics = tuple(diagnostics)
            self._robot_revision += 1
            self._revision += 1

    def close(self) -> None:
        """Close the screen; nothing can be moved any more."""
        with self._lock:
            self._screen.close()

    def values(self) -> dict[str, Any]:
        """Return where everything stands, as JSON: `revision`, `robot_revision`, `values`, `followers`."""
        with self._lock:
            return self._values()

    def state(self) -> dict[str, Any]:
        """Return everything the page shows, as JSON."""
        with self._lock:
            return {
                **self._values(),
                "robot": self._description.name,
                "file": str(self._description.source),
                "coordinates": [
                    {**asdict(item), "zero": item.zero} for item in coordinates(self._description)
                ],
                "mimics": self._mimics(),
                "diagnostics": None if self._diagnostics is None else list(map(_json, self._diagnostics)),
            }

    def _show(self, description: RobotDescription, posture: Posture) -> None:
        self._description = description
        self._posture = posture
        self._screen = self._draw(description, posture)
        self._robot_revision += 1
        self._moved()

    def _moved(self) -> dict[str, Any]:
        self._revision += 1
        self._screen.move(self._posture)
        return self._values()

    def _values(self) -> dict[str, Any]:
        return {
            "revision": self._revision,
            "robot_revision": self._robot_revision,
            "values": self._posture.values,
            "followers": self._posture.followers,
        }

    def _mimics(self) -> list[dict[str, Any]]:
        return [
            {
                "name": joint.name,
                "type": joint.type,
                "unit": "m" if joint.type == "prismatic" else "rad",
                "lower": joint.limit.lower,
                "upper": joint.limit.upper,
                **asdict(joint.mimic),
            }
            for joint in self._description.joints.values()
            if joint.mimic is not None
        ]


def _json(diagnostic: Diagnostic) -> dict[str, Any]:
    return {**asdict(diagnostic), "file": str(diagnostic.file)}
