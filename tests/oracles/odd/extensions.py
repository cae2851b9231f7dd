"""`<gazebo>`, `<ros2_control>` and `<transmission>` with values that nobody can use."""

from __future__ import annotations

from tests.oracles.odd.case import BALL, INERTIAL, accepted, joint, link, pair, refused, robot

_WHEEL = "<collision><geometry><cylinder radius='.1' length='.02'/></geometry></collision>"


def _on_a(inside: str) -> str:
    return robot(
        link("a", f"{INERTIAL}<collision>{BALL}</collision>"), f"<gazebo reference='a'>{inside}</gazebo>"
    )


def _lidar(
    samples: str = "9",
    angle: str = "1",
    reach: str = "9",
    rate: str = "10",
    name: str = "s",
    noise: str = "0",
) -> str:
    return _on_a(
        f"<sensor name='{name}' type='ray'><update_rate>{rate}</update_rate><ray><scan><horizontal>"
        f"<samples>{samples}</samples><min_angle>-1</min_angle><max_angle>{angle}</max_angle></horizontal></scan>"
        f"<range><min>0.1</min><max>{reach}</max></range><noise><stddev>{noise}</stddev></noise></ray></sensor>"
    )


def _camera(width: str = "64", fov: str = "1") -> str:
    return _on_a(
        f"<sensor name='c' type='camera'><camera><horizontal_fov>{fov}</horizontal_fov>"
        f"<image><width>{width}</width><height>48</height></image></camera></sensor>"
    )


def _drive(inside: str, right: str = "rj") -> str:
    return robot(
        link("a"),
        *(link(name, INERTIAL + _WHEEL) for name in "lr"),
        joint("lj", child="l"),
        joint("rj", child="r"),
        f"<gazebo><plugin filename='libgazebo_ros_diff_drive.so' name='d'><left_joint>lj</left_joint>"
        f"<right_joint>{right}</right_joint>{inside}</plugin></gazebo>",
    )


def _control(name: str = "j", interface: str = "velocity", limit: str = "", kind: str = "continuous") -> str:
    return pair(
        f"<ros2_control name='s' type='system'><joint name='{name}'><command_interface name='{interface}'>"
        f"<param name='min'>0</param><param name='max'>{limit}</param>"
        f"</command_interface></joint></ros2_control>",
        kind=kind,
    )


def _transmission(name: str = "j", reduction: str = "1") -> str:
    return pair(
        "<transmission name='t'><type>transmission_interface/SimpleTransmission</type>"
        f"<joint name='{name}'><hardwareInterface>EffortJointInterface</hardwareInterface></joint>"
        f"<actuator name='m'><mechanicalReduction>{reduction}</mechanicalReduction></actuator></transmission>"
    )


def _balls(count: int, inside: str = "") -> str:
    """Return a robot of balls that turn on their own, all in one place."""
    links = (link(f"b{i}", f"{INERTIAL}<collision>{BALL}</collision>") for i in range(count))
    joints = (joint(f"j{i}", child=f"b{i}") for i in range(count))
    return robot(link("a", INERTIAL), *links, *joints, inside)


SIZE = "<wheel_separation>.4</wheel_separation><wheel_diameter>.2</wheel_diameter>"
EXTENSIONS = {
    "lidar of no rays": refused(_lidar("0"), "has 0 samples; a whole number from 1 to 100000"),
    "lidar of 10^9 rays": refused(_lidar("1000000000"), "has 1e+09 samples; a whole number from 1 to 100000"),
    "lidar of 2.5 rays": refused(_lidar("2.5"), "has 2.5 samples"),
    "lidar of 100000 rays": accepted(_lidar("100000"), lambda m: m.nsensor == 0),
    "lidar of NaN": refused(_lidar("nan"), "is not a finite number"),
    "lidar that turns back": refused(_lidar(angle="-2"), "min_angle is above max_angle"),
    "lidar of a negative range": refused(_lidar(reach="-1"), "is not a range"),
    "lidar that sees everything": refused(_lidar(reach="1e300"), "is out of range"),
    "lidar at every step": accepted(_lidar(rate="0"), lambda m: m.nsensor == 9),
    "lidar of a negative rate": refused(_lidar(rate="-1"), "has update rate -1 Hz"),
    "lidar beyond all rates": refused(_lidar(rate="1e9"), "has update rate 1e+09 Hz"),
    "lidar without a name": refused(_lidar(name=""), "has no name="),
    "line break in a sensor's name": accepted(_lidar(name="a&#10;b"), lambda m: m.sensor("a b-000").dim == 1),
    "negative noise": refused(_lidar(noise="-1"), "a deviation is not negative"),
    "camera of 10^12 pixels": accepted(_camera("1000000"), lambda m: m.ncam == 0, "not-simulated"),
    "camera of no pixels": accepted(_camera("0"), lambda m: m.ncam == 0, "not-simulated"),
    "camera that sees nothing": accepted(_camera(fov="0"), lambda m: m.ncam == 0, "not-simulated"),
    "camera that sees behind": accepted(_camera(fov="7"), lambda m: m.ncam == 0, "not-simulated"),
    "negative friction": refused(_on_a("<mu1>-1</mu1>"), "friction is not negative"),
    "friction that is no number": accepted(
        _on_a("<mu1>slippery</mu1>"), lambda m: m.ngeom == 1, "ignored-value"
    ),
    "sensor on nothing": accepted(
        _lidar().replace("reference='a'", "reference='b'"), lambda m: m.nsensor == 0, "unknown-reference"
    ),
    "spring of NaN": accepted(
        pair("<gazebo reference='j'><springStiffness>nan</springStiffness></gazebo>"),
        lambda m: m.joint("j").stiffness[0] == 0,
        "ignored-value",
    ),
    "static": accepted(
        _on_a("").replace("</robot>", "<gazebo><static>true</static></gazebo></robot>"), lambda m: m.nv == 0
    ),
    "drive of nothing": refused(
        robot(link(), "<gazebo><plugin filename='libgazebo_ros_diff_drive.so' name='d'/></gazebo>"),
        "has no <left_joint>",
        "a positive <wheel_radius>",
    ),
    "drive of no size": refused(
        _drive("<wheel_separation>0</wheel_separation>"), "a positive <wheel_separation>"
    ),
    "drive beyond all bounds": refused(_drive(SIZE.replace(".4", "1e300")), "is out of range"),
    "drive of an unknown wheel": refused(_drive(SIZE, "lk"), "did you mean 'lj'?"),
    "drive of one wheel": refused(_drive(SIZE, "lj"), "each wheel is named once"),
    "drive that pulls back": refused(
        _drive(SIZE + "<max_wheel_torque>-5</max_wheel_torque>"), "wheel torque -5 Nm"
    ),
    "drive without strength": accepted(
        _drive(SIZE + "<max_wheel_torque>1e-300</max_wheel_torque>"), lambda m: m.nu == 2
    ),
    "command of an unknown joint": refused(_control("k"), "commands joint 'k', which does not exist"),
    "command of a fixed joint": refused(_control(kind="fixed"), "which is fixed"),
    "command of a planar joint": refused(_control(kind="planar"), "which is planar"),
    "command of warp": refused(_control(interface="warp"), "command interface 'warp'"),
    "command of hardly a range": accepted(
        _control(limit="1e-300"), lambda m: m.actuator("j").ctrllimited == 0
    ),
    "command of a negative range": accepted(_control(limit="-1"), lambda m: m.actuator("j").ctrllimited == 0),
    "transmission to nothing": accepted(_transmission("k"), lambda m: m.nu == 0, "not-simulated"),
    "transmission by zero": accepted(_transmission(reduction="0"), lambda m: m.nu == 1),
    "transmission by NaN": accepted(_transmission(reduction="nan"), lambda m: m.nu == 1),
    "10000 plugins": refused(
        robot(link(), "<gazebo><plugin name='p' filename='x'/></gazebo>" * 10_000), "at most 500 are read"
    ),
    "600 sensors": refused(
        _lidar().replace("<sensor", "<sensor name='t' type='imu'/>" * 600 + "<sensor"), "at most 500 are read"
    ),
    "20000 visuals": refused(
        robot(link("a", INERTIAL + f"<visual>{BALL}</visual>" * 20_000)), "at most 10000 are read"
    ),
    "150 solids in one place": accepted(_balls(150), lambda m: m.ngeom == 150, "overlap"),
    "150 that would touch": accepted(
        _balls(150, "<gazebo><self_collide>1</self_collide></gazebo>"),
        lambda m: m.nexclude == 11175,
        "overlap",
    ),
    "500 solids in one place": refused(_balls(500), "more than 50000 pairs of links do not touch each other"),
}
"""What is odd about the extension, and the outcome."""
