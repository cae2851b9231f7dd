"""Wheels, motors, encoders, odometry and velocity commands that are wrong."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from twin.bridge.conversions import twist_from_planar
from twin.experiments.mutants.catalogue import edits, installs, rewrites
from twin.experiments.mutants.mutant import Site
from twin.models.specs import DriveSpec
from twin.sim.robot import RobotHandle


@installs
def mirrored_wheel(site: Site) -> None:
    """The motors of the right wheels turn the wrong way."""
    for robot, drive in site.drives():
        _rewire(site, robot, {joint: (joint, -1.0) for joint in drive.right_joints})


@installs
def swapped_wheels(site: Site) -> None:
    """The cables of the left and the right motors are swapped."""
    for robot, drive in site.drives():
        pairs = list(zip(drive.left_joints, drive.right_joints, strict=False))
        _rewire(site, robot, {one: (other, 1.0) for a, b in pairs for one, other in ((a, b), (b, a))})


@installs
def mirrored_encoder(site: Site) -> None:
    """The encoder of a right wheel counts backwards."""
    for robot, drive in site.drives():
        robot.hardware.misread(drive.right_joints[0], -1.0)


@installs
def wheel_radius_off(site: Site) -> None:
    """The robot takes its wheels to be 5 % larger than they are."""
    _respecify(site, lambda drive: replace(drive, wheel_radius=1.05 * drive.wheel_radius))


@installs
def track_off(site: Site) -> None:
    """The robot takes its wheels to be 10 % farther apart than they are."""
    _respecify(site, lambda drive: replace(drive, wheel_separation=1.1 * drive.wheel_separation))


@installs
def lost_brake(site: Site) -> None:
    """The drive hardly brakes: commands get slower by no more than 0.15 m/s²."""
    speed = 0.0

    def coasting(message: Any) -> Any:
        nonlocal speed
        wanted = message.linear.x
        slowest = abs(speed) - 0.15 * 0.02  # of the time between commands: a tick
        if abs(wanted) < slowest:
            wanted = slowest if speed > 0.0 else -slowest
        speed = wanted
        return twist_from_planar(speed, message.angular.z)

    site.rewrite("cmd_vel", coasting)


@rewrites("cmd_vel")
def clipped_speed(message: Any) -> Any:
    """The drive takes no command above 0.1 m/s."""
    return twist_from_planar(min(max(message.linear.x, -0.1), 0.1), message.angular.z)


@rewrites("cmd_vel")
def doubled_commands(message: Any) -> Any:
    """The drive does twice what it is told."""
    return twist_from_planar(2.0 * message.linear.x, 2.0 * message.angular.z)


@edits
def late_commands(data: dict[str, Any]) -> None:
    """Commands reach the motors 0.4 s late."""
    for robot in data["robots"]:
        robot["command_latency"] = "0.4 s"


@installs
def late_odometry(site: Site) -> None:
    """Odometry comes 0.5 s late, with stamps as if it were fresh."""
    _stale_odometry(site, 25)


@installs
def frozen_odometry(site: Site) -> None:
    """Odometry says that the robot stands where it started."""
    _stale_odometry(site, None)


def _stale_odometry(site: Site, late: int | None) -> None:
    """Let odometry and its transform say what they said so many messages ago; None: in the first one."""

    def stale(kept: deque[Any], message: Any) -> Any:
        if late is not None or not kept:
            kept.append(message)
        return kept[0]

    def stale_odom(message: Any) -> Any:
        old = stale(messages, message)
        return replace(message, pose=old.pose, twist=old.twist)

    messages, transforms = deque[Any](maxlen=late), deque[Any](maxlen=late)
    site.rewrite("odom", stale_odom)
    site.rewrite("tf", lambda m: with_transforms(m, stale(transforms, m)), node="diff_drive_controller")


def with_transforms(message: Any, old: Any) -> Any:
    """Return a TFMessage that has its own stamps and the transforms of another."""
    pairs = zip(message.transforms, old.transforms, strict=True)
    return replace(message, transforms=[replace(new, transform=old.transform) for new, old in pairs])


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
