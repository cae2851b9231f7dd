"""What is known of two robots over the last seconds: all that the rules for causes look at."""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.geometry import Pose2
from twin.live.divergence.flow import FlowReport
from twin.live.divergence.motion import Ratio, Stretch
from twin.live.divergence.scans import ScanMatch
from twin.live.divergence.things import Place


@dataclass(frozen=True, kw_only=True)
class ScanEvidence:
    """Of the scans of the last second; medians."""

    explained: float
    shorter: float
    longer: float
    returned: float
    """Share of rays in which something returned."""
    expected: float
    """Share of rays in which something was expected to."""
    residual: float = 0.0
    """Of the rays that are explained [m]."""
    offset: float = 0.0
    """By so much farther than expected rays end in general [m]."""
    localised_s: float = math.inf
    """For how long scans have shown what they should, but for single things [s]."""
    frozen: bool = False
    """The same scan comes again and again while the robot moves."""
    unreadable: bool = False
    """No ray has a reading."""
    broke_s: float | None = None
    """How long ago scans stopped, from one to the next, to be explained, and were not since [s]."""


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A pose that changed more than a robot can move."""

    age_s: float
    distance: float
    """[m]"""
    turn: float
    """[rad]"""
    to_start: bool = False
    """Whether it went where odometry begins."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A scan against what the model expects from where localisation says that the robot is."""

    match: ScanMatch
    pose: Pose2
    """Of the base in the map, as localisation says."""
    on_map: bool
    """Whether the map knows what is there."""


@dataclass(frozen=True, kw_only=True)
class Lost:
    """Localisation is wrong."""

    for_s: float
    """[s]"""
    fit: Fit
    """The latest."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Of one robot, now; None: nothing tells."""

    odometry: FlowReport | None = None
    scans: FlowReport | None = None
    clock_bound_s: float = 0.0
    """The robot's clock is known so well [s]."""
    invalid: int = 0
    """Messages of the last seconds with numbers that are none."""
    publishers: int | None = None
    """Of odometry."""
    alternating: float = 0.0
    """Share of the odometry of the last seconds that contradicts what came just before."""
    odometry_jump: Jump | None = None
    localisation_jump: Jump | None = None
    lost: Lost | None = None
    pose_was_set: bool = False
    """Somebody told localisation lately where the robot is."""
    scan: ScanEvidence | None = None
    more: Place | None = None
    """Something that is not expected."""
    less: Place | None = None
    """Something expected that is not there."""
    distances: Ratio | None = None
    """What localisation tells of odometry's distances, over what it does with the virtual robot's."""
    turns: Ratio | None = None
    """What the gyroscope, or localisation, tells of odometry's turns, the same way."""
    slipped: tuple[Stretch, ...] = ()
    """Distances of the last seconds that are odd [m]."""
    twisted: tuple[Stretch, ...] = ()
    """Turns of the last seconds that are odd [rad]."""
    turned_standing: float = 0.0
    """How far the gyroscope says that the robot turned lately while its wheels stood [rad]."""
    response: float | None = None
    """How far the wheels go, as a share of how far the virtual robot's do by the same commands."""
    latency_s: float | None = None
    """How much later [s]."""
    position: float | None = None
    """How far the robots are apart [m]."""
    yaw: float | None = None
    """[rad]"""
    nis: float | None = None
    """Mean of the latest normalised innovations squared."""
    nis_bound: float | None = None
    """It is not larger by chance."""
