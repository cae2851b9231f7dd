"""The sensors in an exported robot.xml, in plain MuJoCo in front of a wall, against what geometry says."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from twin.convert import convert
from twin.convert.export import export
from twin.geometry import Pose2, Pose3, rotate_wxyz
from twin.models import load
from twin.models.description import RobotDescription
from twin.models.shapes import Box
from twin.sensors.lidar import Lidar
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene, Shape, StaticBody
from twin.sim.world import World

WALL_X = 2.0
"""Where the wall's near face is [m]."""
SAMPLES = 37
URDF = f"""<robot name="probe">
<link name="base"><inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
<collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
<link name="lidar_link"/>
<joint name="lidar_joint" type="fixed"><parent link="base"/><child link="lidar_link"/>
  <origin xyz="0.05 0 0.3" rpy="0 0 0.1"/></joint>
<link name="arm"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
<joint name="arm_joint" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
  <limit effort="5" velocity="3"/></joint>
<gazebo reference="lidar_link">
  <sensor name="scan" type="ray"><update_rate>10</update_rate><ray><scan><horizontal>
    <samples>{SAMPLES}</samples><min_angle>-1.2</min_angle><max_angle>1.2</max_angle></horizontal></scan>
    <range><min>0.05</min><max>30</max></range><noise><stddev>0.01</stddev></noise></ray></sensor>
  <sensor name="sonar" type="sonar"><update_rate>10</update_rate>
    <sonar><min>0.05</min><max>5</max><fov>0.4</fov></sonar></sensor>
</gazebo>
<gazebo reference="base">
  <sensor name="imu" type="imu"><pose>0 0 0 0 0 1.5707963267948966</pose><imu><angular_velocity><x>
    <noise><stddev>0.002</stddev></noise></x></angular_velocity></imu></sensor>
  <sensor name="bumper" type="contact"/>
  <sensor name="eye" type="camera"><pose>0.1 0 0.2 0 0 0</pose><camera><horizontal_fov>1.2</horizontal_fov>
    <image><width>800</width><height>600</height></image></camera></sensor>
</gazebo>
<ros2_control name="c" type="system"><joint name="arm_joint"><command_interface name="effort"/>
  <state_interface name="position"/><state_interface name="velocity"/><state_interface name="effort"/>
</joint></ros2_control>
</robot>"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("probe")
    (folder / "probe.urdf").write_text(URDF, encoding="utf-8")
    export(load(folder / "probe.urdf"), folder / "out")
    return folder


@pytest.fixture(scope="module")
def description(exported: Path) -> RobotDescription:
    return load(exported / "probe.urdf")


class Bench:
    """The exported robot on a floor, before a wall."""

    def __init__(self, folder: Path) -> None:
        spec = mujoco.MjSpec()
        geom = mujoco.mjtGeom
        spec.worldbody.add_geom(type=geom.mjGEOM_PLANE, size=[10, 10, 1])
        spec.worldbody.add_geom(type=geom.mjGEOM_BOX, size=[0.1, 20, 2], pos=[WALL_X + 0.1, 0, 2])
        robot = mujoco.MjSpec.from_file(str(folder / "out" / "robot.xml"))
        spec.attach(robot, prefix="r/", frame=spec.worldbody.add_frame())
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def read(self, name: str) -> np.ndarray:
        return self.data.sensor(f"r/{name}").data.copy()


@pytest.fixture(scope="module")
def bench(exported: Path) -> Bench:
    return Bench(exported)


def scan(bench: Bench) -> np.ndarray:
    return np.array([bench.read(f"scan-{index:03}")[0] for index in range(SAMPLES)])


def test_each_ray_of_the_lidar_meets_the_wall_where_geometry_says(bench: Bench) -> None:
    headings = np.linspace(-1.2, 1.2, SAMPLES) + 0.1
    np.testing.assert_allclose(scan(bench), (WALL_X - 0.05) / np.cos(headings), atol=1e-9)


def test_the_lidar_agrees_with_that_of_twin_sim(bench: Bench, description: RobotDescription) -> None:
    wall = StaticBody(
        name="wall",
        T_world_body=Pose3.from_xyz_rpy((WALL_X + 0.1, 0, 2)),
        shapes=(Shape(geometry=Box(size=(0.2, 40, 4))),),
    )
    robot = RobotPlacement(name="probe", conversion=convert(description), pose=Pose2(0.0, 0.0, 0.0))
    world = World.compose(Scene(name="hall", statics=(wall,)), [robot])
    lidar = next(item for item in world.robots["probe"].sensors if isinstance(item, Lidar))
    noise = 6 * lidar.spec.noise_stddev
    np.testing.assert_allclose(lidar.sample(0).ranges, scan(bench), atol=noise)


def test_the_rays_of_the_sonar_fill_its_cone(bench: Bench) -> None:
    rays = np.array([bench.read(f"sonar-{index:03}")[0] for index in range(19)])
    ahead, height = WALL_X - 0.05, bench.data.body("r/lidar_link").xpos[2]
    assert rays[0] == pytest.approx(ahead / math.cos(0.1)), "the axis is 0.1 rad to the left"
    assert rays[4] == pytest.approx(ahead), "half of the way to the cone's right edge"
    assert rays[16] == pytest.approx(height / math.sin(0.2)), "its lower edge meets the floor"
    assert np.argmin(rays) == 16


def test_beyond_its_range_a_rangefinder_reads_the_range(bench: Bench) -> None:
    assert bench.model.sensor("r/sonar-000").cutoff[0] == 5.0
    assert bench.model.sensor("r/scan-000").noise[0] == 0.01


def test_the_imu_feels_gravity_upwards_and_turns_with_its_pose(exported: Path) -> None:
    bench = Bench(exported)
    for _ in range(500):
        mujoco.mj_step(bench.model, bench.data)
    np.testing.assert_allclose(bench.read("imu_accel"), [0, 0, 9.81], atol=1e-3)
    np.testing.assert_allclose(bench.read("imu_gyro"), 0.0, atol=1e-3)
    forward = rotate_wxyz(bench.read("imu_quat"), (1.0, 0.0, 0.0))
    np.testing.assert_allclose(forward, [0, 1, 0], atol=1e-3)
    found, *force = bench.read("bumper")
    assert found >= 1.0
    assert np.linalg.norm(force) == pytest.approx(6 * 9.81, rel=1e-3)
    assert bench.model.sensor("r/imu_gyro").noise[0] == 0.002


def test_joint_states_are_read(exported: Path) -> None:
    bench = Bench(exported)
    bench.data.ctrl[bench.model.actuator("r/arm_joint").id] = 2.0
    mujoco.mj_step(bench.model, bench.data)
    mujoco.mj_forward(bench.model, bench.data)
    joint = bench.data.joint("r/arm_joint")
    assert bench.read("arm_joint_effort")[0] == 2.0
    assert bench.read("arm_joint_velocity")[0] == joint.qvel[0] > 0.0
    assert bench.read("arm_joint_position")[0] == joint.qpos[0] > 0.0


def test_the_camera_looks_forward_with_its_field_of_view(bench: Bench) -> None:
    camera = bench.data.camera("r/eye")
    axes = camera.xmat.reshape(3, 3)
    np.testing.assert_allclose(-axes[:, 2], [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(axes[:, 1], [0, 0, 1], atol=1e-9)
    forward = camera.xpos - bench.data.body("r/base").xpos
    np.testing.assert_allclose(forward, [0.1, 0, 0.2], atol=1e-9)
    assert bench.model.cam_resolution[camera.id].tolist() == [800, 600]
    fovy = math.radians(bench.model.cam_fovy[camera.id])
    horizontal = 2 * math.atan(math.tan(fovy / 2) * 800 / 600)
    assert horizontal == pytest.approx(1.2, abs=1e-12)


def test_the_numbers_of_robot_xml_are_exact(exported: Path, description: RobotDescription) -> None:
    written = mujoco.MjModel.from_xml_path(str(exported / "out" / "robot.xml"))
    last = written.site(f"scan-{SAMPLES - 1:03}").quat
    ray = rotate_wxyz(last, (0.0, 0.0, 1.0))
    np.testing.assert_allclose(ray, [math.cos(1.2), math.sin(1.2), 0.0], atol=1e-15)
    assert len({written.sensor(index).name for index in range(written.nsensor)}) == written.nsensor


def test_the_report_has_every_sensor(exported: Path) -> None:
    report: dict[str, Any] = json.loads((exported / "out" / "report.json").read_text("utf-8"))
    sensors = {sensor["name"]: sensor for sensor in report["sensors"]}
    assert [sensor["type"] for sensor in report["sensors"]] == ["lidar", "range", "imu", "contact", "camera"]
    assert sensors["scan"]["rate_hz"] == 10.0
    assert sensors["scan"]["mujoco"] == ["scan-000", "...", f"scan-{SAMPLES - 1:03}"]
    assert sensors["imu"]["mujoco"] == ["imu_quat", "imu_gyro", "imu_accel"]
    assert sensors["eye"]["xyz"] == [0.1, 0.0, 0.2]


def test_a_lidar_of_very_many_rays_is_in_the_report_alone(tmp_path: Path) -> None:
    (tmp_path / "many.urdf").write_text(
        URDF.replace(f"<samples>{SAMPLES}<", "<samples>4000<"), encoding="utf-8"
    )
    report = export(load(tmp_path / "many.urdf"), tmp_path / "out")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    assert model.nsite == 1 + 19
    (lidar,) = [sensor for sensor in report["sensors"] if sensor["type"] == "lidar"]
    assert (lidar["samples"], lidar["mujoco"]) == (4000, [])
    (entry,) = [entry for entry in report["ledger"] if entry["element"] == "sensor 'scan'"]
    assert entry["outcome"] == "dropped"


def test_the_simulations_own_model_has_no_sensors(description: RobotDescription) -> None:
    spec = convert(description).spec
    assert (list(spec.sensors), list(spec.sites), list(spec.cameras)) == ([], [], [])


def test_sensors_that_share_a_name_and_stand_nowhere_still_load(tmp_path: Path) -> None:
    pose = "<pose>1e300 nan 0 0 0 inf</pose>"
    eyes = f"<sensor name='eye' type='camera'>{pose}<camera/></sensor>" * 3
    imu = f"<sensor name='scan-000' type='imu'>{pose}</sensor><sensor name='a' type='imu'/>"
    extra = f"<gazebo reference='arm'>{eyes}{imu}<sensor name='a_gyro' type='contact'/></gazebo></robot>"
    (tmp_path / "odd.urdf").write_text(URDF.replace("</robot>", extra), encoding="utf-8")
    export(load(tmp_path / "odd.urdf"), tmp_path / "out")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    assert [model.camera(index).name for index in range(model.ncam)] == [
        "eye",
        "arm_eye",
        "arm_eye_2",
        "arm_eye_3",
    ]
    assert model.sensor("a_gyro_2").type == mujoco.mjtSensor.mjSENS_CONTACT
