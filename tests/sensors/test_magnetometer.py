"""A magnetometer measures the earth's field in its own frame, in the twin as in MuJoCo."""

from __future__ import annotations

import json
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.wire.session import SessionConfig
from twin.convert import convert
from twin.convert.export import export
from twin.geometry import Pose2
from twin.models import load
from twin.models.checks import check
from twin.models.description import RobotDescription
from twin.nodes.sensor_publishers import SensorPublisher
from twin.sensors.magnetometer import FIELD
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene
from twin.sim.world import World

URDF = """<robot name="probe">
<link name="base"><inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
<collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
<link name="mag_link"/>
<joint name="j" type="fixed"><parent link="base"/><child link="mag_link"/>
<origin rpy="0 1.5707963267948966 0"/></joint>
<gazebo reference="mag_link"><sensor name="compass" type="magnetometer"><update_rate>50</update_rate>
<magnetometer><x><noise type="gaussian"><stddev>NOISE</stddev></noise></x></magnetometer></sensor></gazebo>
</robot>"""


def probe(folder: Path, noise: float = 0.0) -> RobotDescription:
    file = folder / "probe.urdf"
    file.write_text(URDF.replace("NOISE", str(noise)))
    return load(file)


def world_of(description: RobotDescription, yaw: float = 0.0) -> World:
    placement = RobotPlacement(name="probe", conversion=convert(description), pose=Pose2(0.0, 0.0, yaw))
    return World.compose(Scene(name="floor"), [placement], Physics(), seed=1)


def test_its_frame_turns_with_the_robot_and_its_link(tmp_path: Path) -> None:
    world = world_of(probe(tmp_path), yaw=math.pi / 2)
    (sensor,) = world.robots["probe"].sensors
    east, north, up = FIELD
    # The robot looks north, the sensor's x down: its y is then the robot's left, west; its z ahead.
    assert sensor.sample(0) == pytest.approx([-up, -east, north], abs=1e-12)


def test_its_message_has_the_field_the_frame_and_the_variance(tmp_path: Path) -> None:
    world = world_of(probe(tmp_path, noise=1e-7))
    bus = Bus.of(SessionConfig(), Clock())
    heard = []
    bus.tap(lambda sample: heard.append(sample))
    publisher = SensorPublisher(bus, world.robots["probe"].sensors[0])
    publisher.publish(0)
    bus.close()
    (message,) = [sample.message for sample in heard if sample.topic == "/magnetic_field"]
    assert message.header.frame_id == "mag_link"
    assert message.magnetic_field_covariance[0] == pytest.approx(1e-14)
    measured = np.array([message.magnetic_field.x, message.magnetic_field.y, message.magnetic_field.z])
    assert 0.0 < np.abs(measured - [-FIELD[2], FIELD[1], FIELD[0]]).max() < 5e-7


def test_mujoco_measures_the_same(tmp_path: Path) -> None:
    description = probe(tmp_path)
    export(description, tmp_path / "out")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    (sensor,) = world_of(description).robots["probe"].sensors
    assert data.sensor("compass").data == pytest.approx(sensor.sample(0), abs=1e-12)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    fates = {entry["element"]: entry["outcome"] for entry in report["ledger"]}
    assert fates["sensor 'compass'"] == fates["sensor 'compass'/magnetometer/x/noise/stddev"] == "translated"


def test_twin_check_has_nothing_against_it(tmp_path: Path) -> None:
    assert [finding for finding in check(probe(tmp_path)) if finding.code == "not-simulated"] == []
