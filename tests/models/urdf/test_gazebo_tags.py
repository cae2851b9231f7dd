"""Tags of `<gazebo>` in all their spellings, and that no odd value of theirs refuses a robot."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from twin.models.checks import check
from twin.models.description import RobotDescription, Spring
from twin.models.loader import parse_urdf
from twin.models.shapes import Visual
from twin.sensors.imu import ImuSpec
from twin.sensors.range import RangeSpec

BOX = "<geometry><box size='1 1 1'/></geometry>"
CHAIN = (
    f"<link name='a'><visual>{BOX}</visual><visual>{BOX}<material name='m'><color rgba='1 0 0 1'/></material>"
    f"</visual><collision>{BOX}</collision></link><link name='b'/>"
    "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
)


def robot(*lines: str) -> RobotDescription:
    return parse_urdf(f"<robot name='r'>{CHAIN}{''.join(lines)}</robot>", Path("r.urdf"))


def on(reference: str, text: str) -> str:
    return f"<gazebo reference='{reference}'>{text}</gazebo>"


@pytest.mark.parametrize(
    ("text", "friction"),
    [
        ("<mu1>0.3</mu1>", 0.3),
        ("<mu1 value='500.0'/>", 500.0),
        ("<mu1> 0.3 </mu1>", 0.3),
        ("<collision><surface><friction><ode><mu>0.4</mu></ode></friction></surface></collision>", 0.4),
        ("<mu1/>", None),
        ("<mu1>nan</mu1>", None),
        ("<mu1>slippery</mu1>", None),
        ("<mu2>0.2</mu2>", None),
    ],
)
def test_friction_in_every_spelling(text: str, friction: float | None) -> None:
    assert robot(on("a", text)).links["a"].surface.friction == friction


def test_several_elements_of_a_link_add_up_and_the_later_value_holds() -> None:
    surface = (
        robot(
            on("a", "<mu1>0.3</mu1><turnGravityOff>true</turnGravityOff>"),
            on("a", "<mu1>0.5</mu1><selfCollide>0</selfCollide>"),
        )
        .links["a"]
        .surface
    )
    assert (surface.friction, surface.gravity, surface.self_collide) == (0.5, False, False)


@pytest.mark.parametrize(
    ("text", "gravity"),
    [
        ("<turnGravityOff>1</turnGravityOff>", False),
        ("<turnGravityOff>false</turnGravityOff>", True),
        ("<gravity>0</gravity>", False),
        ("<gravity>maybe</gravity>", True),
    ],
)
def test_gravity(text: str, gravity: bool) -> None:
    assert robot(on("a", text)).links["a"].surface.gravity is gravity


def test_springs_of_joints_and_robots_that_are_bolted_down() -> None:
    spring = on("j", "<springStiffness>4</springStiffness><springReference>0.1</springReference>")
    description = robot(spring, "<gazebo><static>true</static><self_collide>true</self_collide></gazebo>")
    assert description.springs == {"j": Spring(stiffness=4.0, reference=0.1)}
    assert description.static
    assert description.self_collide is True
    assert robot(on("j", "<springReference>1</springReference>")).springs == {}


def colours(*lines: str) -> list[tuple[float, ...]]:
    return [visual.rgba for visual in robot(*lines).links["a"].visuals]


def test_a_gazebo_material_colours_what_has_no_material() -> None:
    red = (1.0, 0.0, 0.0, 1.0)
    assert colours(on("a", "<material>Gazebo/Orange</material>")) == [(1.0, 0.5088, 0.0468, 1.0), red]
    diffuse = "<visual><material><diffuse>0 0.5 1</diffuse></material></visual>"
    assert colours(on("a", diffuse)) == [(0.0, 0.5, 1.0, 1.0), red]
    grey = Visual.__dataclass_fields__["rgba"].default
    for unknown in ("<material>Gazebo/WoodFloor</material>", diffuse.replace("0.5", "pale")):
        assert colours(on("a", unknown)) == [grey, red]


def test_an_extension_of_nothing_is_a_warning_with_the_nearest_name() -> None:
    description = robot(on("aa", "<mu1>1</mu1><sensor name='s' type='imu'/>"))
    assert description.sensors == ()
    (found,) = [item for item in check(description) if item.code == "unknown-reference"]
    assert (found.severity, found.fix) == ("warning", "did you mean 'a'?")


NOISE = "<imu><noise><rate><stddev>0.1</stddev></rate><accel><stddev>0.2</stddev></accel></noise></imu>"


def test_imus_of_classic_gazebo() -> None:
    by_sensor, by_plugin = robot(
        on("a", f"<sensor name='i' type='imu'><update_rate>0</update_rate>{NOISE}</sensor>"),
        "<gazebo><plugin filename='libgazebo_ros_imu.so' name='p'><bodyName>b</bodyName>"
        "<gaussianNoise>0.3</gaussianNoise><updateRate>50</updateRate></plugin></gazebo>",
    ).sensors
    assert isinstance(by_sensor, ImuSpec)
    assert isinstance(by_plugin, ImuSpec)
    assert (by_sensor.gyro_noise_stddev, by_sensor.accel_noise_stddev) == (0.1, 0.2)
    assert by_sensor.rate_hz == 100.0, "0 is every step in Gazebo"
    assert (by_plugin.link, by_plugin.rate_hz, by_plugin.gyro_noise_stddev) == ("b", 50.0, 0.3)


def test_a_sonar_by_the_radius_of_its_cone() -> None:
    cone = "<sonar><min>0.1</min><max>2</max><radius>2</radius></sonar>"
    (sonar,) = robot(on("a", f"<sensor name='s' type='sonar'>{cone}</sensor>")).sensors
    assert isinstance(sonar, RangeSpec)
    assert math.isclose(sonar.field_of_view, math.pi / 2)


CAMERA = (
    "<camera><horizontal_fov>1.5</horizontal_fov><image><width>640</width><height>480</height></image>"
    "<clip><near>0.2</near><far>9</far></clip></camera>"
)


@pytest.mark.parametrize("kind", ["camera", "depth", "depth_camera", "rgbd_camera"])
def test_cameras_in_every_spelling(kind: str) -> None:
    frame = "<plugin filename='libgazebo_ros_camera.so'><frame_name>lens</frame_name></plugin>"
    pose = "<pose degrees='true'>1 2 3 0 0 90</pose>"
    sensor = f"<sensor name='c' type='{kind}'>{pose}{CAMERA}{frame}</sensor>"
    (camera,) = robot(on("a", sensor)).cameras
    assert (camera.horizontal_fov, camera.width, camera.height) == (1.5, 640, 480)
    assert (camera.near, camera.far, camera.optical_frame, camera.link) == (0.2, 9.0, "lens", "a")
    assert camera.T_link_sensor.xyz.tolist() == [1.0, 2.0, 3.0]
    assert math.isclose(camera.T_link_sensor.quat_wxyz[3], math.sqrt(0.5))


def test_sensors_of_one_name_on_two_links_and_a_multicamera() -> None:
    two = "".join(on(link, f"<sensor name='c' type='camera'>{CAMERA}</sensor>") for link in "ab")
    assert [camera.name for camera in robot(two).cameras] == ["c", "b_c"]
    pair = CAMERA.replace("<camera>", "<camera name='left'>") + CAMERA.replace(
        "<camera>", "<camera name='right'>"
    )
    cameras = robot(on("a", f"<sensor name='eyes' type='multicamera'>{pair}</sensor>")).cameras
    assert [camera.name for camera in cameras] == ["eyes_left", "eyes_right"]


def test_a_fisheye_is_named_and_left_out() -> None:
    wide = CAMERA.replace("1.5", "3.5")
    description = robot(on("a", f"<sensor name='c' type='camera'>{wide}</sensor>"))
    assert description.cameras == ()
    assert ["3.5 rad" in found.message for found in check(description) if found.code == "not-simulated"] == [
        True
    ]


UNSIMULATED = {
    "gz mecanum": "<gazebo><plugin filename='gz-sim-mecanum-drive-system' "
    "name='gz::sim::systems::MecanumDrive'/></gazebo>",
    "ign ackermann": "<gazebo><plugin filename='libignition-gazebo-ackermann-steering-system.so' "
    "name='ignition::gazebo::systems::AckermannSteering'/></gazebo>",
    "p3d": "<gazebo><plugin filename='libgazebo_ros_p3d.so' name='p'/></gazebo>",
    "altimeter": on("a", "<sensor name='s' type='altimeter'/>"),
    "displaced": on("a", "<sensor name='s' type='imu'><pose>0 0 1 0 0 0</pose></sensor>"),
    "mu2": on("a", "<mu1>1</mu1><mu2>0.1</mu2>"),
    "proposed sensor": f"<sensor name='s' type='camera'><parent link='a'/>{CAMERA}</sensor>",
}  # fmt: skip


@pytest.mark.parametrize("name", UNSIMULATED)
def test_each_thing_that_is_not_simulated_is_said_once(name: str) -> None:
    codes = [found.code for found in check(robot(UNSIMULATED[name]))]
    assert codes.count("not-simulated") == 1


@pytest.mark.parametrize(
    "library",
    ["libgazebo_ros2_control.so", "gz_ros2_control-system", "libgazebo_ros_joint_state_publisher.so",
     "gz-sim-joint-state-publisher-system", "libgazebo_ros_control.so", "gz-sim-imu-system"],
)  # fmt: skip
def test_plugins_whose_work_twin_does_are_no_warning(library: str) -> None:
    description = robot(f"<gazebo><plugin filename='{library}' name='p'/></gazebo>")
    assert "not-simulated" not in [found.code for found in check(description)]
