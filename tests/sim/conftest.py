"""A hand-made robot, so that these tests depend on neither the URDF reader nor the converter."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mujoco
import pytest

from twin.convert.conversion import Conversion
from twin.geometry import Pose2, Pose3
from twin.models.description import Joint, Link, RobotDescription
from twin.models.shapes import Box, Visual
from twin.models.specs import SensorSpec
from twin.sensors.contact import ContactSpec
from twin.sensors.imu import ImuSpec
from twin.sensors.lidar import LidarSpec
from twin.sensors.range import RangeSpec
from twin.sim.robot import RobotPlacement
from twin.sim.scene import FreeBody, Scene, Shape, StaticBody

XML = """
<mujoco>
  <worldbody>
    <body name="base_link">
      {joint}
      <inertial pos="0 0 0" mass="5" diaginertia=".05 .05 .08"/>
      <geom name="chassis" type="box" size=".15 .12 .03" group="3" mass="0" pos="0 0 .03"/>
      <geom type="box" size=".15 .12 .05" group="2" contype="0" conaffinity="0" mass="0" pos="0 0 .03"/>
      <geom type="sphere" size=".048" pos=".1 0 0" group="3" condim="1" mass="0"/>
      <geom type="sphere" size=".048" pos="-.1 0 0" group="3" condim="1" mass="0"/>
      <body name="laser" pos="0.05 0 0.13"/>
      <body name="imu" pos="0.1 0 0.05"/>
      <body name="left_wheel" pos="0 .15 0">
        <joint name="left_wheel_joint" axis="0 1 0" armature=".001"/>
        <geom type="ellipsoid" size=".05 .02 .05" group="3" priority="2" mass=".2"
          friction=".9 .005 .0001" solref=".004 1"/>
      </body>
      <body name="right_wheel" pos="0 -.15 0">
        <joint name="right_wheel_joint" axis="0 1 0" armature=".001"/>
        <geom type="ellipsoid" size=".05 .02 .05" group="3" priority="2" mass=".2"
          friction=".9 .005 .0001" solref=".004 1"/>
      </body>
      <body name="mast" pos="-.1 0 .08">
        <joint name="mast_joint" type="slide" axis="0 0 1" range="0 .3" limited="true" damping="20"/>
        <geom type="box" size=".02 .02 .02" group="3" mass=".3"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <velocity name="left_wheel_joint" joint="left_wheel_joint" kv="5"/>
    <velocity name="right_wheel_joint" joint="right_wheel_joint" kv="5"/>
    <position name="mast_joint" joint="mast_joint" kp="2000"/>
  </actuator>
</mujoco>
"""

LIDAR = LidarSpec(
    name="lidar", link="laser", topic="scan", rate_hz=10.0, samples=73, line=11,
    angle_min=-math.pi, angle_max=math.pi, range_min=0.05, range_max=8.0,
)  # fmt: skip
IMU = ImuSpec(name="imu", link="imu", topic="imu", rate_hz=100.0)
SONAR = RangeSpec(
    name="sonar", link="laser", topic="range", rate_hz=20.0,
    field_of_view=math.radians(30.0), range_min=0.05, range_max=4.0,
)  # fmt: skip
BUMPER = ContactSpec(name="bumper", link="base_link", topic="bumper", rate_hz=50.0)


def description(sensors: tuple[SensorSpec, ...] = (LIDAR, IMU, SONAR, BUMPER)) -> RobotDescription:
    still = Pose3.from_xyz_rpy()
    visual = Visual(T_link_geometry=still, geometry=Box(size=(0.3, 0.24, 0.1)))
    names = ("base_link", "laser", "imu", "left_wheel", "right_wheel", "mast")
    links = {name: Link(name=name, visuals=(visual,) if name == "base_link" else ()) for name in names}
    joints = [
        Joint(name=name, type=kind, parent="base_link", child=child, T_parent_joint=still)
        for name, kind, child in (
            ("laser_joint", "fixed", "laser"),
            ("left_wheel_joint", "continuous", "left_wheel"),
            ("right_wheel_joint", "continuous", "right_wheel"),
            ("mast_joint", "prismatic", "mast"),
        )
    ]
    return RobotDescription(
        name="cart", source=Path("cart.urdf"), urdf="<robot/>", links=links,
        joints={joint.name: joint for joint in joints}, root="base_link", sensors=sensors,
    )  # fmt: skip


def hand_made(base: str = "free", sensors: tuple[SensorSpec, ...] | None = None) -> Conversion:
    """A two-wheeled cart with a lifting mast; wheels of radius 0.05 m, track 0.30 m."""
    spec = mujoco.MjSpec.from_string(XML.format(joint="<freejoint/>" if base == "free" else ""))
    spec.body("base_link").mocap = base == "kinematic"
    robot = description() if sensors is None else description(sensors)
    return Conversion(
        description=robot, spec=spec, spawn_height=0.05, guesses=(),
        root_joint="base_link" if base == "free" else None,
    )  # fmt: skip


def box(name: str, xyz: tuple[float, float, float], size: tuple[float, float, float]) -> StaticBody:
    return StaticBody(
        name=name, T_world_body=Pose3.from_xyz_rpy(xyz), shapes=(Shape(geometry=Box(size=size)),)
    )


def tote(name: str, xyz: tuple[float, float, float], mass: float = 2.5) -> FreeBody:
    return FreeBody(
        name=name, T_world_body=Pose3.from_xyz_rpy(xyz), mass=mass, friction=0.6,
        shapes=(Shape(geometry=Box(size=(0.30, 0.24, 0.18))),),
    )  # fmt: skip


ORIGIN = Pose2(0.0, 0.0, 0.0)


def placed(pose: Pose2 | Pose3 = ORIGIN, base: str = "free", **changes: Any) -> RobotPlacement:
    return RobotPlacement(name="cart", conversion=hand_made(base, **changes), pose=pose)


@pytest.fixture
def room() -> Scene:
    """A room whose inner walls are at x = ±3 and y = ±2, with a shelf board at z = 0.4 and a tote on it."""
    return Scene(
        name="room",
        statics=(
            box("wall_east", (3.1, 0.0, 0.5), (0.2, 4.4, 1.0)),
            box("wall_west", (-3.1, 0.0, 0.5), (0.2, 4.4, 1.0)),
            box("wall_north", (0.0, 2.1, 0.5), (6.0, 0.2, 1.0)),
            box("wall_south", (0.0, -2.1, 0.5), (6.0, 0.2, 1.0)),
            box("shelf", (-2.0, 1.5, 0.385), (1.0, 0.6, 0.03)),
        ),
        goods=(tote("tote", (-2.0, 1.5, 0.49)),),
    )
