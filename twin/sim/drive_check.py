"""Does a robot go where its drive's numbers say? Manoeuvres, each with an error and the bar it must keep."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from twin.controllers.drive_config import analytic_track_ratio, drive_config
from twin.convert import convert
from twin.convert.conversion import Conversion
from twin.errors import ModelError, Problem, SimulationError
from twin.geometry import Array
from twin.models.checks.drive import VALID_DRIVES, guess_drive, lack_of_drive
from twin.models.description import RobotDescription
from twin.models.dynamics import STANDARD_GRAVITY
from twin.models.specs import DriveSpec
from twin.sim.driving import Driven, ProvingGround
from twin.sim.physics import Physics

STRAIGHT_BAR_M = 0.005
"""On 5 m, and on less: most of it comes up when the robot starts and stops."""
SPIN_BAR_DEG = 0.3
"""On 360 degrees."""
CIRCLE_BAR_PERCENT, UNEQUAL_CIRCLE_BAR_PERCENT = 0.5, 2.5
ALIKE = 0.01
"""Loads count as equal if the track ratio by them differs by no more than this, relatively."""
SKID_LATERAL = 0.1
"""Towards the centre of a skid steer's circles [m/s²]: faster, it leans on its outer wheels and turns tighter
than its calibration at rest says (sp1s at 0.5 m/s² by 1.5 %)."""
HOLD_BAR_M = 0.005
"""In 10 s on the slope."""
SLOPE_DEG = 5.0
HEADINGS = (("uphill", 0.0), ("across", math.pi / 2.0), ("downhill", math.pi))
RADII = (0.5, 2.0)
"""Of circles, each driven to the left and to the right; at least the effective track [m]."""
LEAST_ARC = math.radians(30.0)
"""Turned by, from which on a circle has a radius."""
CALIBRATIONS, CALIBRATED_DEG = 4, 5.0
"""A skid steer is calibrated by one spin, and by more while one turned by so much too far or too little."""
PLAUSIBLE_CALIBRATION = (0.5, 2.0)
"""Measured over analytic track ratio; a robot beyond does not turn like a skid steer at all."""

_CALIBRATED: dict[bytes, float | None] = {}
"""What came of the turns of this process, by the robot and the time step: a start costs a third less."""
_MOST_CALIBRATED = 16

_Result = TypeVar("_Result")


@dataclass(frozen=True, kw_only=True)
class Manoeuvre:
    """One line of the table."""

    name: str
    error: float | None
    """None: the physics diverged."""
    bar: float | None
    """None: not asked of this robot."""
    unit: str
    words: str
    """What the robot does, as `drives 4.33 m of 5 m`."""

    @property
    def passed(self) -> bool:
        """Tell whether the error keeps the bar; True without a bar."""
        return self.bar is None or (self.error is not None and self.error <= self.bar)


@dataclass(frozen=True, kw_only=True)
class DriveReport:
    """How truly a robot drives."""

    drive: DriveSpec
    track_ratio: float
    """Effective over geometric track, measured by one spin if it is a skid steer; else 1."""
    analytic_track_ratio: float
    """By least friction power with the robot's own loads on its wheels."""
    equal_load_track_ratio: float
    """The same with equal loads: 1 + (a/b)² for four wheels."""
    manoeuvres: tuple[Manoeuvre, ...]

    @property
    def passed(self) -> bool:
        """Tell whether all bars are kept."""
        return all(manoeuvre.passed for manoeuvre in self.manoeuvres)


def check_drive(description: RobotDescription, *, timestep: float = 0.002) -> DriveReport:
    """Drive a robot over all manoeuvres; without a drive plugin its drive is guessed by its wheels.

    Args:
        description: The robot.
        timestep: [s]

    Raises:
        ModelError: It has no drive, nor wheels on both sides.
        ConversionError: It cannot be converted.
    """
    return _check(description, timestep, _manoeuvres)


def drive_self_check(description: RobotDescription) -> dict[str, Any] | None:
    """Drive 1 m and turn once, for a report in JSON; None for a robot without a drive plugin.

    Returns:
        `passed`, `straight_1_m_error` [m], `spin_360_error` [deg], null if the physics diverged, rounded; and
        `words` on what missed its bar.

    Raises:
        ConversionError: The robot cannot be converted.
    """
    if description.drive is None:
        return None
    report = _check(description, 0.002, _quick)
    straight, spin = report.manoeuvres[0].error, report.manoeuvres[-1].error
    return {
        "passed": report.passed,
        "straight_1_m_error": None if straight is None else round(straight, 6),
        "spin_360_error": None if spin is None else round(spin, 4),
        "words": [item.words for item in report.manoeuvres if not item.passed],
    }


def calibrated_track_ratio(conversion: Conversion, *, timestep: float) -> float | None:
    """Return effective over geometric track of a skid steer by one simulated turn, as on a real robot.

    None for other robots, for those that cannot drive, and for those that do not turn like a skid steer.
    """
    drive = conversion.description.drive
    if drive is None or drive.kind == "diff_drive" or conversion.root_joint is None:
        return None
    if conversion.spec.meshes:  # their files may change
        return _calibrated(conversion, drive, timestep)
    bare = replace(conversion.description, sensors=(), lines=None)
    turned = pickle.dumps((bare, conversion.spec.to_xml(), timestep))
    if turned not in _CALIBRATED:
        if len(_CALIBRATED) >= _MOST_CALIBRATED:
            _CALIBRATED.clear()
        _CALIBRATED[turned] = _calibrated(conversion, drive, timestep)
    return _CALIBRATED[turned]


def _calibrated(conversion: Conversion, drive: DriveSpec, timestep: float) -> float | None:
    ratio = analytic_track_ratio(drive, conversion.description)
    for _ in range(CALIBRATIONS):
        config = drive_config(drive, conversion.description, calibrated_ratio=ratio)
        try:
            turn = ProvingGround(conversion, config, physics=Physics(timestep=timestep)).spin(2.0 * math.pi)
        except SimulationError:
            return None
        low, high = PLAUSIBLE_CALIBRATION
        if not low < turn.true_angle / turn.ideal_angle < high:
            return None
        ratio *= turn.ideal_angle / turn.true_angle
        if abs(math.degrees(turn.angle_error)) < CALIBRATED_DEG:
            break
    return ratio


def _check(
    description: RobotDescription,
    timestep: float,
    manoeuvres: Callable[[ProvingGround, RobotDescription], Iterator[Manoeuvre]],
) -> DriveReport:
    drive = description.drive or guess_drive(description)
    if drive is None:
        why, line = lack_of_drive(description)
        message = f"robot '{description.name}' has no drive to check: {why}; {VALID_DRIVES}"
        raise ModelError(Problem(message, description.source, line or None))
    description = replace(description, drive=drive)
    conversion = convert(description, timestep=timestep)
    measured = calibrated_track_ratio(conversion, timestep=timestep)
    config = drive_config(drive, description, calibrated_ratio=measured)
    try:
        ground = ProvingGround(conversion, config, physics=Physics(timestep=timestep))
        lines = tuple(manoeuvres(ground, description))
    except SimulationError as fault:
        words = f"cannot even stand: {fault}"
        lines = (Manoeuvre(name="stand still", error=None, bar=HOLD_BAR_M, unit="m", words=words),)
    return DriveReport(
        drive=drive,
        track_ratio=config.wheel_separation_multiplier,
        analytic_track_ratio=analytic_track_ratio(drive, description),
        equal_load_track_ratio=analytic_track_ratio(drive, description, equal_loads=True),
        manoeuvres=lines,
    )


def _quick(ground: ProvingGround, description: RobotDescription) -> Iterator[Manoeuvre]:
    yield _straight(ground, 1.0)
    yield _spin(ground, 1)


def _manoeuvres(ground: ProvingGround, description: RobotDescription) -> Iterator[Manoeuvre]:
    yield _straight(ground, 5.0)
    yield _straight(ground, -5.0)
    yield _spin(ground, 1)
    yield _spin(ground, -1)
    drive = description.drive
    assert drive is not None
    lateral = math.inf if drive.kind == "diff_drive" else SKID_LATERAL
    bar = _circle_bar(drive, description)
    for least in RADII:
        radius = max(least, round(ground.track, 1))
        yield _circle(ground, radius, lateral, bar)
        yield _circle(ground, -radius, lateral, bar)
    for name, heading in HEADINGS:
        yield _hold(ground, drive, description.mass, name, heading)


def _straight(ground: ProvingGround, distance: float) -> Manoeuvre:
    backwards = "" if distance > 0.0 else " backwards"
    length = abs(distance)

    def judge(driven: Driven) -> tuple[float, str]:
        x, y = driven.true.x * math.copysign(1.0, distance), driven.true.y
        aside = f" and {abs(y):.3g} m aside" if abs(y) > STRAIGHT_BAR_M else ""
        return driven.distance_error, f"drives {x:.4g} m of {length:g} m{backwards}{aside}"

    name = f"straight {length:g} m{backwards}"
    return _judged(name, lambda: ground.straight(distance), judge, STRAIGHT_BAR_M, "m")


def _spin(ground: ProvingGround, side: int) -> Manoeuvre:
    def judge(driven: Driven) -> tuple[float, str]:
        turned = math.degrees(driven.true_angle) * side
        return abs(math.degrees(driven.angle_error)), f"turns {turned:.4g} of 360 degrees"

    name = f"spin 360 degrees {'left' if side > 0 else 'right'}"
    return _judged(name, lambda: ground.spin(side * 2.0 * math.pi), judge, SPIN_BAR_DEG, "deg")


def _circle_bar(drive: DriveSpec, description: RobotDescription) -> float:
    """Return the bar of circles [%]: one factor for the track fits four wheels with equal loads only."""
    if drive.kind == "diff_drive":
        return CIRCLE_BAR_PERCENT
    four = len(drive.left_joints) + len(drive.right_joints) == 4
    equal = analytic_track_ratio(drive, description, equal_loads=True)
    alike = abs(analytic_track_ratio(drive, description) / equal - 1.0) < ALIKE
    return CIRCLE_BAR_PERCENT if four and alike else UNEQUAL_CIRCLE_BAR_PERCENT


def _circle(ground: ProvingGround, radius: float, lateral: float, bar: float) -> Manoeuvre:
    def judge(driven: Driven) -> tuple[float, str]:
        turned = math.copysign(1.0, radius) * driven.true_angle
        share = abs(driven.angle_error) / (2.0 * math.pi)
        if abs(turned) < LEAST_ARC:  # nearly straight, of no certain radius
            return 100.0 * share, f"turns by {math.degrees(turned):.4g} of 360 degrees"
        found = fitted_radius(driven.path)
        words = f"drives a radius of {found:.4g} m, turning by {math.degrees(turned):.4g} of 360 degrees"
        return 100.0 * max(share, abs(found / abs(radius) - 1.0)), words

    name = f"circle of {abs(radius):g} m {'left' if radius > 0 else 'right'}"
    return _judged(name, lambda: ground.circle(radius, lateral=lateral), judge, bar, "%")


def _hold(ground: ProvingGround, drive: DriveSpec, mass: float, name: str, heading: float) -> Manoeuvre:
    wheels = len(drive.left_joints) + len(drive.right_joints)
    slope = math.radians(SLOPE_DEG)
    needed = mass * STANDARD_GRAVITY * math.sin(slope) * abs(math.cos(heading)) * drive.wheel_radius / wheels
    torque = drive.max_wheel_torque or math.inf

    def judge(moved: float) -> tuple[float, str]:
        weak = f": its motors give {torque:.3g} of {needed:.3g} Nm a wheel" if torque < needed else ""
        return moved, f"moves {1e3 * moved:.3g} mm in 10 s{weak}"

    bar = HOLD_BAR_M if torque >= needed else None
    title = f"stand {SLOPE_DEG:g} degrees {name}"
    return _judged(title, lambda: ground.hold(slope, heading, 10.0), judge, bar, "m")


def _judged(
    name: str,
    drive: Callable[[], _Result],
    judge: Callable[[_Result], tuple[float, str]],
    bar: float | None,
    unit: str,
) -> Manoeuvre:
    error: float | None
    try:
        error, words = judge(drive())
    except SimulationError as fault:
        error, words = None, str(fault)
    return Manoeuvre(name=name, error=error, bar=bar, unit=unit, words=words)


def fitted_radius(path: Array) -> float:
    """Return the radius of the circle through points, shape (n, 2) [m], by least squares (Kåsa 1976)."""
    columns = np.column_stack([2.0 * path, np.ones(len(path))])
    x, y, rest = np.linalg.lstsq(columns, np.sum(path**2, axis=1), rcond=None)[0]
    return float(math.sqrt(max(rest + x * x + y * y, 0.0)))
