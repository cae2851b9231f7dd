"""Robots with something of everything, for the fuzz run to break."""

from __future__ import annotations

from tests.oracles.odd.case import INERTIAL, LIMIT, joint, link, robot
from twin.models.catalogue import catalogue
from twin.models.expansion.expand import expand
from twin.models.options import ReadOptions

_BOX = "<geometry><box size='.4 .3 .1'/></geometry>"
_WHEEL = "<origin rpy='1.5707963267948966 0 0'/><geometry><cylinder radius='.1' length='.03'/></geometry>"
_RAY = (
    "<ray><scan><horizontal><samples>9</samples><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal>"
    "</scan><range><min>.1</min><max>9</max></range><noise><stddev>.01</stddev></noise></ray>"
)
_SENSORS = (
    f"<sensor name='scan' type='ray'><update_rate>10</update_rate><pose>0 0 .1 0 0 0</pose>{_RAY}</sensor>"
    "<sensor name='imu' type='imu'><imu><noise><rate><stddev>.1</stddev></rate></noise></imu></sensor>"
    "<sensor name='bumper' type='contact'><contact><collision>c</collision></contact></sensor>"
    "<sensor name='cam' type='camera'><camera><horizontal_fov>1</horizontal_fov><image><width>64</width>"
    "<height>48</height></image><clip><near>.1</near><far>9</far></clip></camera></sensor>"
    f"<sensor name='sonar' type='sonar'><sonar><min>.1</min><max>3</max><radius>.5</radius></sonar></sensor>"
)
_DRIVE = (
    "<gazebo><plugin name='d' filename='libgazebo_ros_diff_drive.so'><left_joint>wlj</left_joint>"
    "<right_joint>wrj</right_joint><wheel_separation>.4</wheel_separation><wheel_diameter>.2</wheel_diameter>"
    "<max_wheel_torque>5</max_wheel_torque></plugin></gazebo>"
)

CART = robot(
    "<material name='red'><color rgba='1 0 0 1'/></material>",
    link(
        "base",
        f"{INERTIAL}<visual>{_BOX}<material name='red'/></visual><collision name='c'>{_BOX}</collision>",
    ),
    *(link(name, f"{INERTIAL}<collision>{_WHEEL}</collision>") for name in ("wl", "wr")),
    joint("wlj", inside=f"<origin xyz='0 .2 0'/><axis xyz='0 1 0'/>{LIMIT}", parent="base", child="wl"),
    joint("wrj", inside="<origin xyz='0 -.2 0'/><axis xyz='0 1 0'/>", parent="base", child="wr"),
    link("caster", f"{INERTIAL}<collision><geometry><sphere radius='.1'/></geometry></collision>"),
    joint("cj", "fixed", "<origin xyz='.15 0 0' rpy='0 0 .3'/>", "base", "caster"),
    f"<gazebo reference='base'>{_SENSORS}<material>Gazebo/Blue</material></gazebo>",
    "<gazebo reference='caster'><mu1>0</mu1><mu2>0</mu2>"
    "<kp>1e6</kp><kd>1</kd><selfCollide>true</selfCollide></gazebo>",
    _DRIVE,
)
ARM = robot(
    link("world", ""),
    link("a"),
    link(
        "b",
        f"{INERTIAL}<collision><geometry><mesh filename='m.stl' scale='.1 .1 -.1'/></geometry></collision>",
    ),
    link("c", f"{INERTIAL}<visual><geometry><capsule radius='.1' length='.2'/></geometry></visual>"),
    *(link(name) for name in "def"),
    joint("w", "fixed", "", "world", "a"),
    joint("j", "revolute", f"<axis xyz='0 .6 .8'/>{LIMIT}<dynamics damping='.1' friction='.2'/>", "a", "b"),
    joint(
        "k",
        "prismatic",
        f"<origin rpy='1 2 3'/>{LIMIT}<mimic joint='j' multiplier='2' offset='.1'/>",
        "b",
        "c",
    ),
    joint("l", "continuous", "<mimic joint='k' multiplier='-1'/>", "c", "d"),
    joint("m", "planar", "<axis xyz='0 0 1'/>", "d", "e"),
    joint("n", "floating", "", "e", "f"),
    "<ros2_control name='s' type='system'><hardware><plugin>p</plugin></hardware><joint name='j'>"
    "<command_interface name='position'><param name='min'>-1</param><param name='max'>1</param>"
    "</command_interface><state_interface name='position'/>"
    "<state_interface name='velocity'/></joint></ros2_control>",
    "<transmission name='t'><type>transmission_interface/SimpleTransmission</type><joint name='j'>"
    "<hardwareInterface>EffortJointInterface</hardwareInterface></joint><actuator name='motor'>"
    "<mechanicalReduction>3</mechanicalReduction></actuator></transmission>",
    "<gazebo reference='j'><springStiffness>3</springStiffness>"
    "<springReference>.1</springReference></gazebo>",
    "<gazebo reference='b'><turnGravityOff>true</turnGravityOff></gazebo>",
    "<gazebo><static>false</static><self_collide>false</self_collide></gazebo>",
)
RICH = (CART, ARM, CART, ARM, *(expand(file, ReadOptions()).urdf for file in catalogue().values()))
"""Without xacro, so that a change is one of the URDF."""
