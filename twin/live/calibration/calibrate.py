"""What a bag of a physical robot says of a scenario's robot: estimates, a patch, and what that is worth."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass
from itertools import product
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import RecordingError, ScenarioError, nearest
from twin.geometry import Array, Pose2, matrix_from_quat_wxyz, wrap_angle, wrap_angles
from twin.live.calibration.dead_reckoning import DELAY, MOUNT, Increments, Wheels, compose, inverse
from twin.live.calibration.drive_fit import DriveFit, fit_drive
from twin.live.calibration.estimates import Estimate, of_drive, of_grip, of_gyro, of_motors
from twin.live.calibration.expected_scan import ExpectedScan
from twin.live.calibration.gyro_fit import GyroFit, fit_gyro
from twin.live.calibration.latency import fit_latency
from twin.live.calibration.prediction import HARDWARE, Predicted, hardware_alone, predict
from twin.live.calibration.recorded import SCAN, read, topics_of
from twin.live.calibration.scan_pose import ScanPose, first_pose, locate
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses
from twin.nodes.diff_drive_controller import DiffDriveControllerNode
from twin.runtime.open_run import OpenRun
from twin.runtime.stacks.robot import RobotStack
from twin.scenario.faults import FaultEntry
from twin.scenario.schema import Scenario, of_document
from twin.sensors.lidar import Lidar
from twin.strict_yaml import Document

TRAINED = 2.0 / 3.0
"""Of the bag; what comes later is held out."""
LEAST_S = 15.0
"""Of a bag; a third of it is held out."""
HORIZON_S = 5.0
"""How far ahead is predicted on what is held out."""
_LEAD_S = 2.0
"""A prediction gets going for so long before it counts."""
_MOST_SCANS = 600
_OFFSETS = (0.0, -0.3, 0.3)
_TURNS = (0.0, -0.25, 0.25)
_DOUBT = 2.0
"""A robot whose odometry goes on from an earlier drive is where the scenario starts it only if that fits so
much better: seen from the other side, rooms look alike."""
_LEAST_SHARE, _WORST_SIGMA_M = 0.5, 0.1
"""Of a scan that fits the scenario's world."""
_COMPARED_SCANS = 60
_OWN_S = 20.0
"""How much of the rest of the bag the scenario's own robot is measured with."""
_PATCHED = ("wheel_radius", "track", "latency")


@dataclass(frozen=True, kw_only=True)
class Divergence:
    """A difference of the robot and what its scenario predicts, over `HORIZON_S`, on what is held out."""

    name: str
    unit: str
    before: float
    """With the scenario as it is."""
    after: float
    """With the patch."""


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The result."""

    robot: str
    seconds: tuple[float, float]
    """How much of the bag was used, and how much held out [s]."""
    estimates: tuple[Estimate, ...]
    patch: tuple[dict[str, Any], ...]
    """The faults that the scenario should have instead of its own of these kinds."""
    scenario: Scenario
    """With the patch."""
    divergences: tuple[Divergence, ...]
    notices: tuple[str, ...]
    """What a user should know, one sentence each."""


def calibrate(scenario: Scenario, bag: Path, robot: str | None = None, called: str = "") -> Calibration:
    """Return what a bag tells.

    Args:
        scenario: Of the robot: its file, its world, where it starts.
        bag: Recorded beside the robot, which drove around in that world.
        robot: Which of the scenario's robots; None: the only one.
        called: What the bag is in messages; empty: its path.

    Raises:
        RecordingError: The bag cannot be used.
        ScenarioError: The scenario's robot cannot be calibrated.
    """
    with _believed(scenario, robot) as model:
        return _Evidence(scenario, model, bag, called or str(bag)).calibration()


def needed_topics(scenario: Scenario, robot: str | None = None) -> dict[str, str]:
    """Return the topics of which `calibrate` needs the messages, by what they are, as `topics_of`.

    Raises:
        ScenarioError: The scenario's robot cannot be calibrated.
    """
    with _believed(scenario, robot) as model:
        return model.topics


@dataclass(frozen=True, kw_only=True)
class _Model:
    """The scenario's robot as it is believed to be."""

    opened: OpenRun
    stack: RobotStack
    drive: DiffDriveControllerNode
    lidar: Lidar

    @property
    def topics(self) -> dict[str, str]:
        """Of the physical robot, by what they are."""
        return topics_of(self.stack.context.namespace, self.lidar.spec.topic)


@contextmanager
def _believed(scenario: Scenario, robot: str | None) -> Iterator[_Model]:
    name = _chosen(scenario, robot)
    opened = OpenRun(
        hardware_alone(scenario.model_copy(update={"faults": ()})), record=False, layout=HARDWARE
    )
    try:
        stack = opened.run.parts.stacks[name]
        lidars = [each for each in stack.handle.sensors if isinstance(each, Lidar)]
        if stack.drive is None:
            raise ScenarioError(f"robot '{name}' has no differential drive; no other can be calibrated")
        if not lidars:
            raise ScenarioError(f"robot '{name}' has no lidar by which its way could be measured")
        yield _Model(opened=opened, stack=stack, drive=stack.drive, lidar=lidars[0])
    finally:
        opened.close()


def _chosen(scenario: Scenario, robot: str | None) -> str:
    names = [each.id for each in scenario.robots]
    if robot is None and len(names) > 1:
        raise ScenarioError(f"scenario '{scenario.name}' has several robots; name one: {', '.join(names)}")
    if robot is not None and robot not in names:
        raise ScenarioError(f"scenario '{scenario.name}' has no robot '{robot}'; {nearest(robot, names)}")
    return robot or names[0]


class _Evidence:
    """A bag, and where in the scenario's world its scans were made."""

    def __init__(self, scenario: Scenario, model: _Model, bag: Path, called: str) -> None:
        self.scenario, self.stack, self.bag = scenario, model.stack, called
        stack, run = model.stack, model.opened.run
        self.config = model.drive.config
        self.period = run.parts.control_period_ns * 1e-9
        self.recorded = read(
            bag,
            model.topics,
            self.config.left_joints,
            self.config.right_joints,
            odom_frame=stack.frames.odom,
            called=called,
        )
        # A controller that is late, as its odometry usually is, has heard of more.
        self.commands = self.recorded.commands - [self.recorded.link.usual, 0.0, 0.0]
        self._check(model.lidar)
        self.expected = ExpectedScan(run.world, stack.handle, model.lidar)
        self.axle = _axle(stack.handle.description)
        self.time, self.ranges = self._scans()
        self.end = float(self.recorded.wheels.time[-1])
        self.split = float(self.recorded.wheels.time[0]) + TRAINED * (
            self.end - float(self.recorded.wheels.time[0])
        )
        self.track = model.drive.controller.track
        self.start = np.array([1.0, 0.0, 1.0, 0.0, 0.0, *(self.axle.inverse() @ self.expected.mount), 0.0])
        self.notices = list(self.recorded.notices)
        self.places = self._places()

    def _check(self, lidar: Lidar) -> None:
        wheels, scans, spec = self.recorded.wheels, self.recorded.scans, lidar.spec
        seconds = float(wheels.time[-1] - wheels.time[0])
        if seconds < LEAST_S:
            raise RecordingError(
                f"{self.bag}: holds {seconds:.1f} s of the wheels; at least {LEAST_S:g} s are needed"
            )
        if scans is None:
            topic = topics_of(self.stack.context.namespace, spec.topic)[SCAN]
            raise RecordingError(f"{self.bag}: has no scans on {topic} to measure the robot's way by")
        step = (spec.angle_max - spec.angle_min) / max(1, spec.samples - 1)
        first, given, count = scans.angles
        if (
            count != spec.samples
            or abs(first - spec.angle_min) > step / 2.0
            or abs(given - step) > 0.01 * step
        ):
            raise RecordingError(
                f"{self.bag}: its scans have {count} rays from {first:.3f} rad, those of '{self.stack.name}' "
                f"{spec.samples} from {spec.angle_min:.3f} rad: is it another robot's bag?"
            )

    def _scans(self) -> tuple[Array, Array]:
        scans, wheels = self.recorded.scans, self.recorded.wheels
        assert scans is not None
        inside = np.flatnonzero((scans.time >= wheels.time[0]) & (scans.time <= wheels.time[-1]))
        inside = inside[:: max(1, -(-len(inside) // _MOST_SCANS))]
        return scans.time[inside], scans.ranges[inside]

    def _places(self) -> list[ScanPose | None]:
        """Return where each scan was made; None where it does not fit."""
        increments = Increments(self.recorded.wheels, self.time, self.config.drive.wheel_radius, self.track)
        motions = increments.lidar(self.start)
        found: list[ScanPose | None] = [self._first_place()]
        if found[0] is None:
            raise RecordingError(
                f"{self.bag}: its first scan does not fit what '{self.stack.name}' sees where the scenario "
                f"'{self.scenario.name}' starts it; give its start with --set robots.0.pose"
            )
        guess = found[0].pose
        for ranges, motion in zip(self.ranges[1:], motions, strict=True):
            guess = guess @ Pose2(*motion.tolist())
            place = _fitting(locate(ranges, self.expected, guess))
            guess = guess if place is None else place.pose
            found.append(place)
        lost = found.count(None)
        if lost > 0.3 * len(found):
            raise RecordingError(
                f"{self.bag}: {lost} of {len(found)} scans do not fit the world of '{self.scenario.name}'"
            )
        if lost:
            self.notices.append(
                f"{lost} of {len(found)} scans do not fit the scenario's world and were left out"
            )
        return found

    def _first_place(self) -> ScanPose | None:
        """Return where the first scan was made; the robot may have driven before."""
        start, recorded = self.stack.context.start, self.recorded
        T_map_odom = start if recorded.T_map_odom is None else recorded.T_map_odom
        found = []
        for guess, doubt in ((T_map_odom @ recorded.began, 1.0), (start, _DOUBT)):
            near = guess @ self.expected.mount
            starts = [near @ Pose2(x, y, yaw) for x, y, yaw in product(_OFFSETS, _OFFSETS, _TURNS)]
            place = _fitting(first_pose(self.ranges[0], self.expected, starts))
            if place is not None:
                found.append((doubt * place.misfit, place))
        return min(found, key=itemgetter(0))[1] if found else None

    def calibration(self) -> Calibration:
        """Estimate, patch, compare."""
        known = [(t, place) for t, place in zip(self.time, self.places, strict=True) if place is not None]
        time = np.array([t for t, _ in known])
        poses = np.array([place.pose for _, place in known])
        covariances = np.array([place.covariance for _, place in known])
        trained = time <= self.split
        increments = Increments(
            self.recorded.wheels, time[trained], self.config.drive.wheel_radius, self.track
        )
        try:
            drive = fit_drive(increments, poses[trained], covariances[trained], self.start, self.track)
        except ValueError as fault:
            raise RecordingError(f"{self.bag}: the drive cannot be calibrated: {fault}") from None
        if drive.left_out:
            self.notices.append(
                f"in {drive.left_out} of {len(increments.seconds)} steps wheels and scans disagree: left out"
            )
        bases = compose(poses, inverse(drive.values[MOUNT]))
        held_out = time > self.split
        way = np.column_stack([time - drive.values[DELAY], bases])
        reference = way[held_out]
        estimates = [
            *of_drive(drive, self.config.drive.wheel_radius, self.track, self.start),
            *of_gyro(self._gyro(time[trained], poses[trained], covariances[trained])),
            of_grip(self.recorded.odometry, drive.left_out),
        ]
        # How the model's own robot moves, with these wheels, of which its motors know nothing.
        with_wheels = self._patched(tuple(self._patch(estimates)))
        own = self._predict(with_wheels, way[trained & (time > self.split - _OWN_S)]).wheels
        left, right = _wheel_factors({each.name: each for each in estimates})
        motors = Wheels(time=own.time, left=own.left / left, right=own.right / right)
        estimates += of_motors(fit_latency(motors, self.recorded.wheels), self._doubt())
        patch = tuple(self._patch(estimates))
        patched = self._patched(patch)
        before, after = (self._predict(each, reference) for each in (self.scenario, patched))
        ranges = self.ranges[[place is not None for place in self.places]][held_out]
        start = float(self.recorded.wheels.time[0])
        return Calibration(
            robot=self.stack.name,
            seconds=(self.split - start, self.end - self.split),
            estimates=tuple(estimates),
            patch=patch,
            scenario=patched,
            divergences=self._divergences(reference, ranges, drive, before, after),
            notices=tuple(self.notices),
        )

    def _gyro(self, time: Array, poses: Array, covariances: Array) -> GyroFit | None:
        gyro, description = self.recorded.gyro, self.stack.handle.description
        sensor = next((each for each in description.sensors if each.kind == "imu"), None)
        if sensor is None or len(gyro) < 2:
            return None
        _, quat = link_poses(description)[sensor.link]
        about_z = matrix_from_quat_wxyz(quat)[2] @ gyro[:, 1:].T
        return fit_gyro(gyro[:, 0], about_z, time, np.unwrap(poses[:, 2]), covariances[:, 2, 2])

    def _doubt(self) -> float:
        """Return what one cannot tell of a latency as nobody knows in which tick commands were heard [s]."""
        changes = np.flatnonzero(np.any(np.diff(self.commands[:, 1:], axis=0) != 0.0, axis=1)) + 1
        phase = np.mod(self.commands[changes, 0] - self.recorded.odometry[0, 0], self.period)
        near = np.minimum(phase, self.period - phase) < self.recorded.link.jitter / 2.0
        return self.period * float(near.mean()) if len(near) else 0.0

    def _is_replaced(self, entry: FaultEntry) -> bool:
        """Return whether a fault is what is estimated here, from the start of the run to its end."""
        given = entry.given
        robot = given.get("robot") in (None, self.stack.name)
        timed = any(given.get(key) is not None for key in ("at", "when", "duration"))
        return entry.kind in _PATCHED and robot and not timed

    def _patch(self, estimates: Sequence[Estimate]) -> Iterator[dict[str, Any]]:
        """Yield the faults that say in what the robot is otherwise than its file."""
        of = {each.name: each for each in estimates}
        robot = {"robot": self.stack.name} if len(self.scenario.robots) > 1 else {}
        left, right = _wheel_factors(of)
        if left != right:
            sides = (left, self.config.left_joints), (right, self.config.right_joints)
            for factor, joint in ((factor, joint) for factor, joints in sides for joint in joints):
                yield {"wheel_radius": {"factor": factor, "joint": joint, **robot}}
        elif left != 1.0:
            yield {"wheel_radius": {"factor": left, **robot}}
        if of["track"].differs:
            yield {"track": {"factor": _rounded(of["track"].factor), **robot}}
        late = of.get("latency")
        periods = round(late.value / self.period) if late is not None and late.observable else 0
        if periods > 0:
            yield {"latency": {"time": f"{periods * self.period * 1e3:g} ms", **robot}}

    def _patched(self, patch: Sequence[dict[str, Any]]) -> Scenario:
        source = self.scenario.source
        data = deepcopy(dict(source.data))
        given = data.get("faults") or []
        kept = [
            fault
            for fault, entry in zip(given, self.scenario.faults, strict=True)
            if not self._is_replaced(entry)
        ]
        data["faults"] = [*kept, *map(deepcopy, patch)]
        if not data["faults"]:
            del data["faults"]
        return of_document(Document(source.file, data))

    def _predict(self, scenario: Scenario, reference: Array) -> Predicted:
        recorded = self.recorded
        ticks = recorded.odometry[:, 0]
        first = max(ticks[0], reference[0, 0] - _LEAD_S)
        start = float(ticks[np.searchsorted(ticks, first, side="right") - 1])
        # Put there in the very ticks whose poses these are.
        spacing = self.period * round(HORIZON_S / self.period)
        lead = self.period * np.floor((reference[0, 0] - start) / self.period + 1e-6)
        times = np.arange(start + lead, reference[-1, 0] - HORIZON_S / 2.0, spacing).tolist()
        places = [(t, Pose2(*_at(reference, t).tolist()) @ self.axle.inverse()) for t in times]
        places.insert(0, (start, places[0][1]))
        return predict(scenario, self.stack.name, self.commands, start, float(reference[-1, 0]), places)

    def _divergences(
        self, reference: Array, ranges: Array, drive: DriveFit, before: Predicted, after: Predicted
    ) -> tuple[Divergence, ...]:
        recorded, mount = self.recorded, Pose2(*drive.values[MOUNT].tolist())
        axle = np.array(self.axle)
        stride = max(1, len(reference) // _COMPARED_SCANS)

        def of(drawn: Predicted) -> tuple[float, ...]:
            base = np.column_stack([drawn.base[:, 0], compose(drawn.base[:, 1:], axle)])
            there = np.array([_at(base, t) for t in reference[:, 0]])
            wrong = compose(inverse(reference[:, 1:]), there)
            yaw = wrap_angles(wrong[:, 2])
            scans = []
            for seen, place in zip(ranges[::stride], there[::stride], strict=True):
                view = self.expected(Pose2(*place.tolist()) @ mount).ranges
                both = np.isfinite(seen) & np.isfinite(view)
                scans.append(np.median(np.abs(seen - view)[both]) if both.any() else np.nan)
            odometry = recorded.odometry
            odometry = odometry[(odometry[:, 0] >= reference[0, 0]) & (odometry[:, 0] <= reference[-1, 0])]
            speeds = [
                odometry[:, i] - np.interp(odometry[:, 0], drawn.odometry[:, 0], drawn.odometry[:, i])
                for i in (1, 2)
            ]
            return (
                _rms(np.hypot(wrong[:, 0], wrong[:, 1])),
                np.degrees(_rms(yaw)),
                float(np.nanmean(scans)),
                _rms(speeds[0]),
                _rms(speeds[1]),
            )

        names = (
            ("position", "m"),
            ("yaw", "deg"),
            ("scan", "m"),
            ("odometry speed", "m/s"),
            ("odometry turn", "rad/s"),
        )
        return tuple(
            Divergence(name=name, unit=unit, before=one, after=other)
            for (name, unit), one, other in zip(names, of(before), of(after), strict=True)
        )


def _axle(description: RobotDescription) -> Pose2:
    """Return the middle of the driven wheels in the frame of the robot's root: odometry is about its way."""
    drive, poses = description.drive, link_poses(description)
    assert drive is not None
    wheels = [
        poses[description.joints[joint].child].xyz for joint in (*drive.left_joints, *drive.right_joints)
    ]
    x, y, _ = np.mean(wheels, axis=0).tolist()
    return Pose2(x, y, 0.0)


def _fitting(place: ScanPose | None) -> ScanPose | None:
    fits = place is not None and place.share >= _LEAST_SHARE and place.sigma <= _WORST_SIGMA_M
    return place if fits else None


def _at(rows: Array, time: float) -> Array:
    """Return the pose at a time [s] in between, of rows of time, x, y, yaw; shape (3,)."""
    after = int(np.clip(np.searchsorted(rows[:, 0], time), 1, len(rows) - 1))
    before, one, other = rows[after - 1, 0], rows[after - 1, 1:], rows[after, 1:]
    share = (time - before) / (rows[after, 0] - before)
    step = other - one
    step[2] = wrap_angle(float(step[2]))
    return np.asarray(one + share * step)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _wheel_factors(of: Mapping[str, Estimate]) -> tuple[float, float]:
    """Return how large wheels of the left and of the right are, of what is believed, for motors that obey.

    What is not surely otherwise is as believed, or both are alike.
    """
    if not of["wheel_radius"].observable:
        return 1.0, 1.0
    exact = Estimate(name="", unit="1", value=1.0, half_width=0.0)
    factors, widths = [], []
    for side in ("left", "right"):
        wheel, count = of[f"wheel_radius_{side}"], of.get(f"encoder_{side}", exact)
        count = count if count.observable else exact
        factors.append(wheel.factor * count.value)
        widths.append(math.hypot(wheel.half_width / wheel.value, count.half_width))
    width, mean = math.hypot(*widths), sum(factors) / 2.0
    if abs(factors[0] - factors[1]) > width:
        return _rounded(factors[0]), _rounded(factors[1])
    both = _rounded(mean) if abs(mean - 1.0) > width / 2.0 else 1.0
    return both, both


def _rounded(factor: float) -> float:
    return round(float(factor), 5)
