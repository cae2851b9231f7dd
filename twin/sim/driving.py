"""Where a robot really goes when its wheels turn as commanded: simulator truth against ideal kinematics."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from twin.controllers.diff_drive import DiffDriveConfig, DiffDriveController
from twin.convert.conversion import Conversion
from twin.errors import SimulationError
from twin.geometry import Array, Pose2, wrap_angle
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene
from twin.sim.world import World

LONGEST_S = 300.0
"""Of a manoeuvre; a robot that takes longer is not driven."""
LINEAR, ANGULAR = 0.5, 1.0
"""Cruising [m/s] and turning speed [rad/s], if the drive allows as much."""
CONTROL_PERIOD_S = 0.02
WHEEL_SHARE = 0.9
"""Of the wheels' own speed limit, at most; a motor at its limit has nothing left to correct with."""
SETTLE_S = 1.0
"""To come to rest before and after each manoeuvre."""
_STATE = mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL | mujoco.mjtState.mjSTATE_ACT
_ROBOT = "robot"


@dataclass(frozen=True, kw_only=True)
class Driven:
    """A manoeuvre: what the wheel commands mean, and what became of them. Both start at the origin."""

    ideal: Pose2
    """Integral of the wheel commands over the kinematics of a unicycle."""
    true: Pose2
    """Of the simulator."""
    ideal_angle: float
    """Turned, not wrapped [rad]."""
    true_angle: float
    """Turned, not wrapped [rad]."""
    path: Array
    """True positions at each control tick between the ramps, shape (n, 2) [m]."""

    @property
    def distance_error(self) -> float:
        """How far from the ideal place the robot ended [m]."""
        return self.ideal.distance(self.true)

    @property
    def angle_error(self) -> float:
        """By how much it turned too far, in the direction of the turn [rad]."""
        return math.copysign(1.0, self.ideal_angle) * (self.true_angle - self.ideal_angle)


class ProvingGround:
    """A flat floor, alone with one robot; every manoeuvre starts from the same state of rest."""

    def __init__(
        self, conversion: Conversion, drive: DiffDriveConfig, *, physics: Physics | None = None
    ) -> None:
        """Put the robot on the floor and let it come to rest.

        Args:
            conversion: The robot, with a free base.
            drive: Kinematics by which velocities become wheel commands.
            physics: None takes the defaults.

        Raises:
            ValueError: The robot has no drive.
            SimulationError: The physics diverged.
        """
        spec = conversion.description.drive
        if spec is None:
            raise ValueError(f"robot '{conversion.description.name}' has no drive")
        self.drive = drive
        self._sides = (spec.left_joints, spec.right_joints)
        without_sensors = replace(conversion.description, sensors=())  # their rates are nothing to a drive
        alone = replace(conversion, description=without_sensors)
        placement = RobotPlacement(name=_ROBOT, conversion=alone, pose=Pose2(0.0, 0.0, 0.0))
        self._world = World.compose(Scene(name="proving_ground"), [placement], physics)
        self._robot = self._world.robots[_ROBOT]
        self._base = self._robot.body(_base_frame(conversion))
        self._steps = round(CONTROL_PERIOD_S * 1e9) // self._world.timestep_ns
        self._wait(SETTLE_S)
        model, data = self._world.model, self._world.data
        self._rest = np.zeros(mujoco.mj_stateSize(model, int(_STATE)))
        mujoco.mj_getState(model, data, self._rest, int(_STATE))

    @property
    def track(self) -> float:
        """Effective wheel separation [m]."""
        return self.drive.wheel_separation * self.drive.wheel_separation_multiplier

    def straight(self, distance: float) -> Driven:
        """Drive `distance` [m], backwards if it is negative."""
        speed = min(LINEAR, self.drive.linear.max_velocity)
        return self._drive(math.copysign(speed, distance), 0.0, abs(distance) / speed)

    def spin(self, angle: float) -> Driven:
        """Turn by `angle` [rad] on the spot."""
        speed = min(ANGULAR, self.drive.angular.max_velocity)
        return self._drive(0.0, math.copysign(speed, angle), abs(angle) / speed)

    def circle(self, radius: float, *, lateral: float = math.inf) -> Driven:
        """Drive once around a circle, to the right if the radius [m] is negative.

        `lateral`: acceleration towards the centre that is not exceeded [m/s²].
        """
        gentle = math.sqrt(lateral * abs(radius))
        linear = min(LINEAR, self.drive.linear.max_velocity, gentle)
        angular = min(linear / abs(radius), self.drive.angular.max_velocity, ANGULAR)
        w = math.copysign(angular, radius)
        return self._drive(w * radius, w, 2.0 * math.pi / angular)

    def hold(self, slope: float, heading: float, seconds: float) -> float:
        """Stand still on a slope.

        Args:
            slope: [rad]
            heading: 0 faces uphill, π/2 across with the hill's top on the right [rad].
            seconds: Simulated time.

        Returns:
            How far the base moved, once it had settled into its tyres [m].
        """
        gravity = self._world.physics.gravity
        along = gravity * math.sin(slope)
        self._restore()
        option = self._world.model.opt
        option.gravity = [-along * math.cos(heading), along * math.sin(heading), -gravity * math.cos(slope)]
        try:
            start = self._world.pose(self._base).xyz
            self._wait(seconds)
            return float(np.linalg.norm((self._world.pose(self._base).xyz - start)[:2]))
        finally:
            option.gravity = [0.0, 0.0, -gravity]

    def _drive(self, v: float, w: float, seconds: float) -> Driven:
        """Command a velocity for some time, then a stop, through the drive's limits.

        Where the wheels cannot turn so fast, the same way is driven more slowly.
        """
        fastest = (abs(v) + abs(w) * self.track / 2.0) / self.drive.wheel_radius
        share = min(1.0, WHEEL_SHARE * self.drive.max_wheel_velocity / fastest)
        v, w, seconds = v * share, w * share, seconds / share
        if seconds > LONGEST_S:
            pace = f"at {v:.3g} m/s, {w:.3g} rad/s"
            raise SimulationError(f"it is too slow: it would take {seconds:.0f} s, {pace}")
        self._restore()
        controller = DiffDriveController(self.drive)
        period = CONTROL_PERIOD_S
        ticks = max(1, round(seconds / period))
        v, w = v * seconds / (ticks * period), w * seconds / (ticks * period)
        start = last = self._pose()
        ideal, ideal_angle, true_angle = Pose2(0.0, 0.0, 0.0), 0.0, 0.0
        path = []
        tail = ticks + math.ceil(self._stopping_time(v, w) / period)
        for tick in range(tail + round(SETTLE_S / period)):
            controller.set_command(*((v, w) if tick < ticks else (0.0, 0.0)))
            wheels = controller.update(period)
            self._command(wheels.left, wheels.right)
            self._world.step(self._steps)
            turn = (wheels.right - wheels.left) * self.drive.wheel_radius / self.track * period
            ideal_angle += turn
            ideal = ideal @ _arc((wheels.left + wheels.right) * self.drive.wheel_radius / 2.0 * period, turn)
            now = self._pose()
            true_angle += wrap_angle(now.yaw - last.yaw)
            last = now
            if tail - ticks <= tick < ticks:
                path.append((now.x, now.y))
        return Driven(
            ideal=ideal,
            true=start.inverse() @ last,
            ideal_angle=ideal_angle,
            true_angle=true_angle,
            path=start.inverse().apply(np.array(path).reshape(-1, 2)),
        )

    def _stopping_time(self, v: float, w: float) -> float:
        limits = self.drive
        return max(abs(v) / limits.linear.max_acceleration, abs(w) / limits.angular.max_acceleration)

    def _command(self, left: float, right: float) -> None:
        for joints, speed in zip(self._sides, (left, right), strict=True):
            for joint in joints:
                self._robot.hardware.command(joint, speed)
        self._robot.hardware.apply()

    def _wait(self, seconds: float) -> None:
        for _ in range(round(seconds / CONTROL_PERIOD_S)):
            self._command(0.0, 0.0)
            self._world.step(self._steps)

    def _restore(self) -> None:
        mujoco.mj_setState(self._world.model, self._world.data, self._rest, int(_STATE))
        mujoco.mj_forward(self._world.model, self._world.data)
        self._robot.hardware.reset()

    def _pose(self) -> Pose2:
        return self._world.pose(self._base).to_pose2()


def _base_frame(conversion: Conversion) -> str:
    """Return the link that drives: the plugin's base frame, if it exists."""
    description = conversion.description
    frame = description.drive.base_frame if description.drive else ""
    return frame if frame in description.links else description.root


def _arc(distance: float, angle: float) -> Pose2:
    """Return the motion along an arc [m, rad] with the x axis as its first tangent."""
    half = angle / 2.0
    chord = distance * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    return Pose2(chord * math.cos(half), chord * math.sin(half), angle)
