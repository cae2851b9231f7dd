"""Drive a robot of one's own by hand, without any node: `python examples/python/own_robot.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import twin


def main() -> None:
    """Read the file beside this one, look at the robot, and let it drive a square."""
    robot = twin.load_robot(Path(__file__).with_name("rover.urdf"))
    print(f"{robot.name}: {len(robot.links)} links, {robot.mass:.2f} kg, moves {', '.join(robot.velocities)}")
    print(f"the lidar is {robot.pose('lidar').xyz[2]:.3f} m above {robot.root}")
    world = twin.World(robot)
    rover = world.robots[robot.name]
    for side in range(4):
        rover.drive(0.4, 0.0)
        world.advance(2.5)
        rover.drive(0.0, np.pi / 4)
        world.advance(2.0)
        x, y, yaw = rover.pose().to_pose2()
        print(f"corner {side + 1}: x {x:.2f} m, y {y:.2f} m, yaw {np.degrees(yaw):.0f} deg")
    rover.drive(0.0, 0.0)
    world.advance(1.0)
    turned = dict(zip(rover.joint_names, rover.joints().position, strict=True))
    print(f"the wheels turned by {turned['left_wheel']:.1f} and {turned['right_wheel']:.1f} rad")


if __name__ == "__main__":
    main()
