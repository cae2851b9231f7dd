"""Wheels, motors, encoders, odometry and velocity commands that are wrong."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from twin.bridge.conversions import twist_from_planar
from twin.experiments.mutants.mutant import Mutant, Site
from twin.models.specs import DriveSpec
from twin.sim.robot import RobotHandle


class MirroredWheel(Mutant):
    """The motors of the right wheels turn the wrong way."""

    def install(self, site: Site) -> None:
        """Reverse the commands."""
        for robot, drive in site.drives():
            _rewire(site, robot, {joint: (joint, -1.0) for joint in drive.right_joints})


class SwappedWheels(Mutant):
    """The cables of the left and the right motors are swapped."""

    def install(self, site: Site) -> None:
        """Command the other side."""
        for robot, drive in site.drives():
            pairs = list(zip(drive.left_joints, drive.right_joints, strict=False))
            _rewire(site, robot, {one: (other, 1.0) for a, b in pairs for one, other in ((a, b), (b, a))})


class MirroredEncoder(Mutant):
    """The encoder of a right wheel counts backwards."""

    def install(self, site: Site) -> None:
        """Misread one."""
        for robot, drive in site.drives():
            robot.hardware.misread(drive.right_joints[0], -1.0)


class WheelRadiusOff(Mutant):
    """The robot takes its wheels to be 5 % larger than they are."""

    def install(self, site: Site) -> None:
        """Change what the nodes know."""
        _respecify(site, lambda drive: replace(drive, wheel_radius=1.05 * drive.wheel_radius))


class TrackOff(Mutant):
    """The robot takes its wheels to be 10 % farther apart than they are."""

    def install(self, site: Site) -> None:
        """Change what the nodes know."""
        _respecify(site, lambda drive: replace(drive, wheel_separation=1.1 * drive.wheel_separation))


class LostBrake(Mutant):
    """The drive hardly brakes: commands get slower by no more than 0.15 m/s²."""

    def install(self, site: Site) -> None:
        """Hold speeds up, by the time between commands of one tick."""
        speed = 0.0

        def coasting(message: Any) -> Any:
            nonlocal speed
            wanted = message.linear.x
            slowest = abs(speed) - 0.15 * 0.02
            if abs(wanted) < slowest:
                wanted = slowest if speed > 0.0 else -slowest
            speed = wanted
            return twist_from_planar(speed, message.angular.z)

        site.rewrite("cmd_vel", coasting)


class ClippedSpeed(Mutant):
    """The drive takes no command above 0.1 m/s."""

    def install(self, site: Site) -> None:
        """Clip."""
        site.rewrite("cmd_vel", lambda m: twist_from_planar(min(max(m.linear.x, -0.1), 0.1), m.angular.z))


class DoubledCommands(Mutant):
    """The drive does twice what it is told."""

    def install(self, site: Site) -> None:
        """Double."""
        site.rewrite("cmd_vel", lambda m: twist_from_planar(2.0 * m.linear.x, 2.0 * m.angular.z))


class LateCommands(Mutant):
    """Commands reach the motors 0.4 s late."""

    def edit(self, data: dict[str, Any]) -> None:
        """Change the latency of all robots."""
        for robot in data["robots"]:
            robot["command_latency"] = "0.4 s"


class LateOdometry(Mutant):
    """Odometry comes 0.5 s late, with stamps as if it were fresh."""

    def install(self, site: Site) -> None:
        """Give each message the pose of 25 messages before."""
        poses: deque[Any] = deque(maxlen=25)

        def late(message: Any) -> Any:
            poses.append((message.pose, message.twist))
            return replace(message, pose=poses[0][0], twist=poses[0][1])

        site.rewrite("odom", late)
        transforms: deque[Any] = deque(maxlen=25)

        def late_tf(message: Any) -> Any:
            transforms.append([each.transform for each in message.transforms])
            pairs = zip(message.transforms, transforms[0], strict=True)
            return replace(message, transforms=[replace(each, transform=old) for each, old in pairs])

        site.rewrite("tf", late_tf, node="diff_drive_controller")


class FrozenOdometry(Mutant):
    """Odometry says that the robot stands where it started."""

    def install(self, site: Site) -> None:
        """Keep the first pose."""
        first: list[Any] = []

        def frozen(message: Any) -> Any:
            first.append(message) if not first else None
            return replace(message, pose=first[0].pose, twist=first[0].twist)

        site.rewrite("odom", frozen)
        transforms: list[Any] = []

        def frozen_tf(message: Any) -> Any:
            transforms.append(message) if not transforms else None
            pairs = zip(message.transforms, transforms[0].transforms, strict=True)
            return replace(message, transforms=[replace(new, transform=old.transform) for new, old in pairs])

        site.rewrite("tf", frozen_tf, node="diff_drive_controller")


def _rewire(site: Site, robot: RobotHandle, wires: Mapping[str, tuple[str, float]]) -> None:
    """Let a joint's command be another one's, times a factor."""
    command = robot.hardware.command

    def wired(joint: str, value: float) -> None:
        other, factor = wires.get(joint, (joint, 1.0))
        command(other, factor * value)

    site.patch(robot.hardware, "command", wired)


def _respecify(site: Site, change: Callable[[DriveSpec], DriveSpec]) -> None:
    """Change what the robots' nodes know of their drives; the drives stay what they are."""
    for robot, drive in site.drives():
        robot.description = replace(robot.description, drive=change(drive))
