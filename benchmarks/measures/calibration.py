"""How often the intervals of `twin calibrate` cover the truth, and what its patch is worth, bag by bag.

`python -m benchmarks.measures.calibration 100` drives a robot with wheels, track and latency that its model
does not know through a small room, as many times, each time with other commands and noise, in one process.
A second number is the first seed, 1 if there is none.
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.msgs import Odometry, Twist, new
from twin.geometry import Pose2, wrap_angle, yaw_from_quat_wxyz
from twin.live.calibration.calibrate import Calibration, calibrate
from twin.live.calibration.prediction import HARDWARE, hardware_alone
from twin.live.device_clock import DeviceClock
from twin.live.perturbations import perturbed
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario, load
from twin.sensors.imu import Imu
from twin.sensors.lidar import Lidar

ROOM = """
name: room
seed: 1
duration: 60 s
world:
  obstacles:
    - {name: north, size: [6, 0.1, 0.6], pose: {x: 0, y: 2.5}}
    - {name: south, size: [6, 0.1, 0.6], pose: {x: 0, y: -2.5}}
    - {name: east, size: [0.1, 5, 0.6], pose: {x: 3, y: 0}}
    - {name: west, size: [0.1, 5, 0.6], pose: {x: -3, y: 0}}
    - {name: crate, size: [0.5, 0.7, 0.5], pose: {x: 2.2, y: 1.6, yaw: 25 deg}}
    - {name: box, size: [0.8, 0.3, 0.5], pose: {x: -2.0, y: -1.8, yaw: -40 deg}}
robots: [{model: diff_bot}]
mission: {type: idle}
checks: [{no_collision: }]
"""
PLANTED = "wheel_radius=0.97,track=1.02,latency=80ms"
START_NS = 1_700_000_000_000_000_000


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What the bag does not tell; nobody but who judges an estimate may look."""

    counted: dict[str, float]
    """How far each encoder says that its wheel turned, of how far it did."""
    lidar: tuple[float, float, float]
    """Its pose in the frame of the axle, as the robot stands [m, rad]."""
    gyro_bias: float
    """[rad/s]"""


class Driver:
    """Commands that excite all there is to calibrate, drawn from a seed; it stays where it began."""

    def __init__(self, bus: Bus, seed: int, seconds: float, moves: tuple[bool, bool] = (True, True)) -> None:
        self._rng, self._seconds, self._moves = np.random.default_rng(seed), seconds, moves
        self._node = bus.create_node("driver")
        self._publisher = self._node.create_publisher(Twist, "/cmd_vel", 10)
        self._place, self._command, self._until = Pose2(0.0, 0.0, 0.0), (0.0, 0.0), 0.0
        self._node.create_subscription(Odometry, "/odom", self._on_odometry, 10)
        self._node.create_timer(60_000_000, self._drive)

    def _on_odometry(self, message: Odometry) -> None:
        place = message.pose.pose
        q = place.orientation
        self._place = Pose2(place.position.x, place.position.y, yaw_from_quat_wxyz((q.w, q.x, q.y, q.z)))

    def _drive(self) -> None:
        now = (self._node.now_ns - START_NS) * 1e-9
        if now >= self._until:
            self._until, self._command = now + self._rng.uniform(0.4, 1.6), self._draw()
        is_on = 1.0 <= now <= self._seconds - 1.0
        message = new(Twist)
        message.linear.x, message.angular.z = self._command if is_on else (0.0, 0.0)
        self._publisher.publish(message)

    def _draw(self) -> tuple[float, float]:
        linear, angular = self._rng.uniform(-0.2, 0.6), self._rng.uniform(-1.8, 1.8)
        x, y, yaw = self._place
        if math.hypot(x, y) > 0.9 and all(self._moves):
            aside = wrap_angle(math.atan2(-y, -x) - yaw)
            linear = self._rng.uniform(0.3, 0.6) if abs(aside) < 1.2 else 0.0
            angular = max(-1.8, min(1.8, 1.5 * aside))
        elif math.hypot(x, y) > 0.9:
            linear = -math.copysign(linear, x)
        forward, turns = self._moves
        return linear * forward, angular * turns


def room(folder: Path) -> Scenario:
    """Return a scenario with a robot between four walls."""
    file = folder / "room.yaml"
    file.write_text(ROOM, encoding="utf-8")
    return load(file)


def record(
    scenario: Scenario, bag: Path, seed: int, seconds: float, perturb: str = PLANTED, **how: Any
) -> Truth:
    """Write the bag of a robot that is otherwise than its scenario says; `how` is of its `Driver`."""
    seeded = hardware_alone(scenario).model_copy(update={"seed": seed})
    changed, error = perturbed(scenario, perturb)
    changed = seeded.model_copy(update={"faults": changed.faults})
    run = OpenRun(changed, record=False, bag=bag, clock=DeviceClock(START_NS, error), layout=HARDWARE)
    try:
        Driver(run.run.bus, seed, seconds, **how)
        world = run.run.world
        robot = next(iter(world.robots.values()))
        drive = robot.description.drive
        assert drive is not None
        joints = (*drive.left_joints, *drive.right_joints)
        wheels = [robot.body(robot.description.joints[joint].child) for joint in joints]
        lidar = next(sensor for sensor in robot.sensors if isinstance(sensor, Lidar))
        mounts = []

        def watch() -> bool:
            middle = np.mean([world.pose(wheel).xyz[:2] for wheel in wheels], axis=0)
            axle = Pose2(float(middle[0]), float(middle[1]), world.pose(robot.base).to_pose2().yaw)
            mounts.append(axle.inverse() @ world.pose(robot.body(lidar.spec.link)).to_pose2())
            return world.time_ns >= seconds * 1e9

        run.advance(watch)
        imu = next((sensor for sensor in robot.sensors if isinstance(sensor, Imu)), None)
        scales = dict(zip(robot.hardware.joint_names, robot.hardware._own_scale, strict=True))
        x, y, yaw = np.mean(mounts, axis=0).tolist()
        return Truth(
            counted={joint: scales[joint] for joint in joints},
            lidar=(x, y, yaw),
            gyro_bias=0.0 if imu is None else float(imu._bias[2]),
        )
    finally:
        run.close()


def planted(truth: Truth) -> dict[str, float]:
    """Return what `twin calibrate` should find in a bag of `ROOM` with `PLANTED`.

    A radius is the way per radian that the encoder counts, so each has the error of its own encoder.
    """
    left, right = (0.97 * 0.05 / counted for counted in truth.counted.values())
    return {
        "wheel_radius": (left + right) / 2.0,
        "wheel_radius_left": left,
        "wheel_radius_right": right,
        "track": 1.02 * 0.3,
        **{
            f"encoder_{side}": counted
            for side, counted in zip(("left", "right"), truth.counted.values(), strict=True)
        },
        "latency": 0.08,
        **dict(zip(("lidar_x", "lidar_y", "lidar_yaw"), truth.lidar, strict=True)),
        "lidar_delay": 0.0,
        "imu_scale": 1.0,
        "imu_bias": truth.gyro_bias,
        "slip": 0.0,
    }


def main(count: int = 100, first: int = 1, seconds: float = 45.0) -> None:
    """Print the table."""
    found: list[tuple[dict[str, float], Calibration]] = []
    began = time.process_time()
    with TemporaryDirectory() as name:
        folder = Path(name)
        scenario = room(folder)
        for seed in range(first, first + count):
            bag = folder / f"bag_{seed}"
            found.append((planted(record(scenario, bag, seed, seconds)), calibrate(scenario, bag)))
    bags, spent = f"{count} bags of {seconds:g} s from seed {first} on", time.process_time() - began
    print(f"{bags}, {PLANTED}: {spent:.0f} s of CPU")
    print(f"{'':20}{'covered':>8}{'largest error':>16}{'widest interval':>18}")
    for key in found[0][0]:
        estimates = [next(e for e in each.estimates if e.name == key) for _, each in found]
        errors = np.array([e.value - truth[key] for e, (truth, _) in zip(estimates, found, strict=True)])
        widths = np.array([e.half_width for e in estimates])
        scale = abs(found[0][0][key]) if key.startswith(("wheel", "track")) else 1.0
        shown = "{:.3%}" if scale != 1.0 else "{:.2g}"
        most, widest = (shown.format(np.abs(x).max() / scale) for x in (errors, 2.0 * widths))
        print(f"{key:20}{np.count_nonzero(np.abs(errors) <= widths):8}{most:>16}{widest:>18}")
    print(f"\n{'held out: before / after':28}{'least':>8}{'median':>8}")
    for i, row in enumerate(found[0][1].divergences):
        ratios = [each.divergences[i].before / each.divergences[i].after for _, each in found]
        print(f"{row.name:28}{min(ratios):8.1f}{np.median(ratios):8.1f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
