"""`/arm_controller`: follows joint trajectories (ros2_controllers' `joint_trajectory_controller`)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Any

import numpy as np

from twin.bridge.action_types import FollowJointTrajectory
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import JointTrajectory, JointTrajectoryPoint, new, ns
from twin.geometry import Array
from twin.manipulation.trajectory import Trajectory, concatenate
from twin.nodes.hardware import HardwareInterface

_SUCCESSFUL, _INVALID_GOAL, _INVALID_JOINTS, _GOAL_TOLERANCE_VIOLATED = 0, -1, -2, -5
_TOLERANCE = 0.005
"""As near to its goal as this a joint has arrived [rad or m]."""
_DERIVED_S = 1e-3
"""A velocity is the difference of positions over so long [s]."""
_PATIENCE_NS = 2_000_000_000
"""How long joints may take to arrive once the trajectory is over."""


class JointTrajectoryControllerNode:
    """Commands positions along the trajectory of a goal, then waits until the joints have arrived.

    A message on `arm_controller/joint_trajectory` takes the place of whatever is followed; its points may
    have velocities, and nobody hears how it ends.
    """

    def __init__(
        self,
        bus: Bus,
        hardware: HardwareInterface,
        joints: Sequence[str],
        *,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("arm_controller", namespace)
        self._hardware = hardware
        self._index = {joint: hardware.joint_names.index(joint) for joint in joints}
        ActionServer(
            self.node, FollowJointTrajectory, "arm_controller/follow_joint_trajectory", self._execute
        )
        self._messages = 0
        self._told: tuple[int, Trajectory | None] = (0, None)
        """When the last message came [ns], and what it said, unless a goal came after it."""
        self.node.create_subscription(
            JointTrajectory, "arm_controller/joint_trajectory", self._on_trajectory, 10
        )

    def _on_trajectory(self, message: JointTrajectory) -> None:
        names = list(message.joint_names)
        fault = self._fault(names, message.points)
        if fault is not None:
            self.node.get_logger().error(f"joint_trajectory refused: {fault.error_string}")
            return
        self._messages += 1
        trajectory = self._as_told(names, message.points)
        self._told = self.node.steady_ns, trajectory
        self.node.create_task(self._follow(self._messages, names, trajectory))

    def _as_told(self, names: list[str], points: Sequence[JointTrajectoryPoint]) -> Trajectory:
        """Return a trajectory through points, with no jump from that of the message before."""
        still = np.zeros(len(names))
        rows = [(0.0, *self._desired(names))]
        for point in points:
            time = ns(point.time_from_start) * 1e-9
            if time > rows[-1][0]:
                velocities = np.array(point.velocities, float) if len(point.velocities) else still
                rows.append((time, np.array(point.positions, float), velocities))
        if len(rows) == 1:
            rows[0] = (0.0, np.array(points[-1].positions, float), still)
        times, positions, velocities = (np.array(column) for column in zip(*rows, strict=True))
        return Trajectory(tuple(names), times, positions, velocities)

    def _desired(self, names: list[str]) -> tuple[Array, Array]:
        """Return positions and velocities that joints are to have now: as told, else as measured."""
        since, told = self._told
        if told is not None and told.joint_names == tuple(names):
            elapsed = (self.node.steady_ns - since) * 1e-9
            if elapsed <= told.duration + 1e-9:
                before = told.sample(elapsed - _DERIVED_S)
                here = told.sample(elapsed)
                return here, (here - before) / _DERIVED_S
        reading, index = self._hardware.read(), [self._index[name] for name in names]
        return reading.position[index], reading.velocity[index]

    def _follow(self, message: int, names: list[str], trajectory: Trajectory) -> Generator[None, None, None]:
        start = self.node.steady_ns
        while message == self._messages:
            elapsed = (self.node.steady_ns - start) * 1e-9
            self._command(names, trajectory.sample(elapsed))
            if elapsed >= trajectory.duration:
                return
            yield

    def _execute(self, goal: GoalHandle) -> Generator[None, None, Any]:
        names = list(goal.request.trajectory.joint_names)
        fault = self._fault(names, goal.request.trajectory.points)
        if fault is not None:
            goal.abort()
            return fault
        trajectory = self._with_start(names, goal.request.trajectory.points)
        self._messages += 1  # what a message said is over
        self._told = (0, None)
        mine, start = self._messages, self.node.steady_ns
        while (elapsed := (self.node.steady_ns - start) * 1e-9) < trajectory.duration:
            if goal.is_cancel_requested:
                goal.canceled()
                return _result(_SUCCESSFUL, "canceled")
            if mine != self._messages:
                goal.abort()
                return _result(_INVALID_GOAL, "another trajectory has taken its place")
            self._command(names, trajectory.sample(elapsed))
            yield
        self._command(names, trajectory.positions[-1])
        return (yield from self._settle(goal, names, trajectory))

    def _fault(self, names: list[str], points: Sequence[Any]) -> Any | None:
        """Return the result that refuses a goal which cannot be followed, else None."""
        unknown = [name for name in names if name not in self._index]
        if unknown:
            said = f"unknown joints {unknown}; this controller has {list(self._index)}"
            return _result(_INVALID_JOINTS, said)
        usable = all(
            len(p.positions) == len(names)
            and len(p.velocities) in (0, len(names))
            and np.isfinite([*p.positions, *p.velocities]).all()
            for p in points
        )
        if not (names and points and usable):
            said = (
                f"every point needs {len(names)} finite positions, as many finite velocities or none, "
                "and there must be a point"
            )
            return _result(_INVALID_GOAL, said)
        return None

    def _settle(
        self, goal: GoalHandle, names: list[str], trajectory: Trajectory
    ) -> Generator[None, None, Any]:
        deadline = self.node.steady_ns + _PATIENCE_NS
        while True:
            measured = self._hardware.read().position
            errors = {
                name: float(measured[self._index[name]] - target)
                for name, target in zip(names, trajectory.positions[-1], strict=True)
            }
            worst = max(errors, key=lambda name: abs(errors[name]))
            if abs(errors[worst]) <= _TOLERANCE:
                return _result(_SUCCESSFUL)
            if self.node.steady_ns > deadline:
                goal.abort()
                said = f"'{worst}' is {errors[worst]:+.4f} away from its goal, {_TOLERANCE} is allowed"
                return _result(_GOAL_TOLERANCE_VIOLATED, said)
            yield

    def _with_start(self, names: list[str], points: Sequence[Any]) -> Trajectory:
        """Prepend where the joints are now, as trajectories need not contain it."""
        measured = self._hardware.read().position
        times, positions = [0.0], [[float(measured[self._index[name]]) for name in names]]
        for point in points:
            time = ns(point.time_from_start) * 1e-9
            if time > times[-1]:
                times.append(time)
                positions.append([float(value) for value in point.positions])
        if len(times) == 1:
            positions[0] = [float(value) for value in points[-1].positions]
        return concatenate(names, times, positions)

    def _command(self, names: list[str], positions: Any) -> None:
        for name, value in zip(names, positions, strict=True):
            self._hardware.command(name, float(value))


def _result(code: int, text: str = "") -> Any:
    return new(FollowJointTrajectory.Result, error_code=code, error_string=text)
