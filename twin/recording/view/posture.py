"""Where the joints of a robot stand, as one number per degree of freedom: what sliders and `--joint` set.

Limits, Center, Randomize and Zero are those of joint_state_publisher_gui (ROS, joint_state_publisher 2.4).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.errors import ModelError, nearest
from twin.geometry import Array, quat_wxyz_from_rpy
from twin.models.description import Joint, JointType, RobotDescription
from twin.models.kinematics import joint_positions

Preset = Literal["center", "random", "zero"]
PRESETS: tuple[Preset, ...] = ("center", "random", "zero")
REACH_M = 1.0
"""Range of the sliders of planar and floating joints, which have no limits, to either side."""

_PARTS: Mapping[str, tuple[str, ...]] = {
    "planar": ("x", "y", "yaw"),
    "floating": ("x", "y", "z", "roll", "pitch", "yaw"),
}


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """One number that can be set."""

    name: str
    """The joint's name; of a planar or floating joint with a part, such as `base_joint/yaw`."""
    type: JointType
    unit: Literal["rad", "m"]
    lower: float
    """[rad] or [m]"""
    upper: float
    """[rad] or [m]"""
    limited: bool
    """Whether the file's limits say so; else values beyond are fine, and the bounds are those of a slider."""

    @property
    def middle(self) -> float:
        """Of the range; zero without limits."""
        return (self.lower + self.upper) / 2.0

    @property
    def zero(self) -> float:
        """Zero if the joint can be there, else the middle of its range."""
        return 0.0 if self.lower <= 0.0 <= self.upper else self.middle


def coordinates(description: RobotDescription) -> tuple[Coordinate, ...]:
    """Return what can be set, in file order: no fixed joints, no followers of others."""
    free = (joint for joint in description.joints.values() if joint.type != "fixed" and joint.mimic is None)
    return tuple(coordinate for joint in free for coordinate in _of_joint(joint))


def _of_joint(joint: Joint) -> Iterator[Coordinate]:
    limit = joint.limit
    for part in _PARTS.get(joint.type, ("",)):
        is_length = part in ("x", "y", "z") or joint.type == "prismatic"
        reach = REACH_M if is_length else math.pi
        limited = not part and joint.type != "continuous" and None not in (limit.lower, limit.upper)
        yield Coordinate(
            name=f"{joint.name}/{part}" if part else joint.name,
            type=joint.type,
            unit="m" if is_length else "rad",
            lower=limit.lower if limited and limit.lower is not None else -reach,
            upper=limit.upper if limited and limit.upper is not None else reach,
            limited=limited,
        )


class Posture:
    """The values of all coordinates of a robot; starts at zero where the limits allow it."""

    def __init__(self, description: RobotDescription) -> None:
        """Take the coordinates from a description."""
        self._description = description
        self._coordinates = {coordinate.name: coordinate for coordinate in coordinates(description)}
        self._values = {name: coordinate.zero for name, coordinate in self._coordinates.items()}

    @property
    def values(self) -> Mapping[str, float]:
        """By the name of the coordinate [rad or m]."""
        return dict(self._values)

    @property
    def positions(self) -> dict[str, Array]:
        """Of every joint, followers too, as `twin.models.kinematics.joint_positions` returns them."""
        given = {
            joint.name: self._position(joint)
            for joint in self._description.joints.values()
            if joint.type != "fixed" and joint.mimic is None
        }
        return joint_positions(self._description, given)

    @property
    def followers(self) -> dict[str, float]:
        """Position of every joint that follows another [rad or m]."""
        joints, every = self._description.joints, self.positions
        return {name: float(every[name][0]) for name, joint in joints.items() if joint.mimic is not None}

    def set(self, values: Mapping[str, float]) -> None:
        """Set some coordinates; on an error none.

        Args:
            values: By the name of the coordinate [rad or m].

        Raises:
            ModelError: Of every name that cannot be set and every value that is out of range.
        """
        faults = [fault for name, value in values.items() if (fault := self._fault(name, value))]
        if faults:
            raise ModelError("; ".join(faults))
        self._values.update((name, float(value)) for name, value in values.items())

    def preset(self, preset: Preset, rng: np.random.Generator) -> None:
        """Set all coordinates: to the middle of their ranges, anywhere in them, or to zero."""
        for name, coordinate in self._coordinates.items():
            if preset == "random":
                self._values[name] = float(rng.uniform(coordinate.lower, coordinate.upper))
            else:
                self._values[name] = coordinate.middle if preset == "center" else coordinate.zero

    def keep(self, other: Posture) -> None:
        """Take over the values of another posture, as far as the names exist and the limits allow it."""
        known = {name: value for name, value in other.values.items() if self._fault(name, value) is None}
        self._values.update(known)

    def _position(self, joint: Joint) -> Array:
        if joint.type not in _PARTS:
            return np.array([self._values[joint.name]])
        values = np.array([self._values[f"{joint.name}/{part}"] for part in _PARTS[joint.type]])
        if joint.type == "planar":
            return values
        return np.concatenate((values[:3], quat_wxyz_from_rpy(*values[3:])))

    def _fault(self, name: str, value: float) -> str | None:
        coordinate = self._coordinates.get(name)
        if coordinate is None:
            joint = self._description.joints.get(name)
            if joint is not None and joint.mimic is not None:
                return f"joint '{name}' follows '{joint.mimic.joint}', set that one"
            if joint is not None and joint.type == "fixed":
                return f"joint '{name}' is fixed; {nearest(name, self._coordinates)}"
            return f"no joint '{name}' to set: {nearest(name, self._coordinates)}"
        if not math.isfinite(value):
            return f"joint '{name}': {value} is not a finite number; give one in {coordinate.unit}"
        if coordinate.limited and not coordinate.lower <= value <= coordinate.upper:
            bounds = f"[{coordinate.lower:g}, {coordinate.upper:g}] {coordinate.unit}"
            return f"joint '{name}': {value:g} is outside of its limits {bounds}"
        return None
