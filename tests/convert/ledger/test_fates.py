"""The ledger names every element of a file with everything in it, and calls nothing kept that is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from lxml import etree

from twin.convert.contact_roles import roles_of
from twin.convert.ledger.tags import TagEntry, tag_ledger
from twin.models.loader import parse_urdf

INERTIAL = "<inertial><origin/><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>"
BOX = "<geometry><box size='1 1 1'/></geometry>"
EVERYTHING = f"""<robot name="all" version="1.0">
<material name="red"><color rgba="1 0 0 1"/><texture filename="x.png"/></material>
<material name="red"><color rgba="0 1 0 1"/></material>
<material name="unused"><color rgba="0 0 0 1"/></material>
<link name="base" type="laser">{INERTIAL}
  <visual name="v"><origin/>{BOX}<material name="red"/></visual><visual>{BOX}</visual>
  <visual>{BOX}<geometry><sphere radius="1"/></geometry></visual>
  <collision name="c"><origin/>{BOX}<verbose value="1"/></collision><collision_checking/>
  <odd><odder a="1"/></odd>
</link>
<link name="arm">{INERTIAL}</link><link name="tip">{INERTIAL}</link><link name="frame"/>
<joint name="j" type="revolute"><origin/><parent link="base"/><child link="arm"/><axis xyz="0 0 2"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/><dynamics damping="1" friction="1"/>
  <calibration rising="0"/><safety_controller k_velocity="1"/></joint>
<joint name="k" type="revolute"><parent link="arm"/><child link="tip"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/><mimic joint="j"/></joint>
<joint name="f" type="fixed"><parent link="base"/><child link="frame"/><mimic joint="j"/></joint>
<gazebo reference="base"><mu1>0.5</mu1><mu2>0.4</mu2><kp>1</kp><kd>1</kd><fdir1>1 0 0</fdir1>
  <maxVel>1</maxVel>
  <minDepth>0</minDepth><maxContacts>1</maxContacts><laserRetro>0</laserRetro><dampingFactor>0</dampingFactor>
  <material>Gazebo/Orange</material><selfCollide>false</selfCollide><turnGravityOff>true</turnGravityOff>
  <mu1>0.9</mu1><blob><inner/></blob></gazebo>
<gazebo reference="arm"><gravity>1</gravity><mu1>0.5</mu1><selfCollide>1</selfCollide>
  <material>Gazebo/Blue</material></gazebo>
<gazebo reference="tip"><collision><max_contacts>1</max_contacts><surface><friction><ode><mu>1</mu>
  <mu2>1</mu2></ode><torsional><coefficient>1</coefficient></torsional></friction></surface></collision>
  <visual><material><ambient>1 0 0 1</ambient><diffuse>1 0 0 1</diffuse></material></visual></gazebo>
<gazebo reference="frame"><material>Gazebo/NoSuchColour</material></gazebo>
<gazebo reference="nowhere"><mu1>1</mu1><sensor name="ghost" type="imu"/></gazebo>
<gazebo reference="j"><springStiffness>1</springStiffness><springReference>0.1</springReference>
  <implicitSpringDamper>true</implicitSpringDamper><provideFeedback>true</provideFeedback><stopCfm>0</stopCfm>
  <stopErp>0</stopErp><fudgeFactor value="0.5"/></gazebo>
<gazebo reference="f"><preserveFixedJoint>true</preserveFixedJoint>
  <disableFixedJointLumping>false</disableFixedJointLumping><springStiffness>1</springStiffness></gazebo>
<gazebo><static>false</static><self_collide>true</self_collide><enable_wind>0</enable_wind>
  <plugin filename="libgazebo_ros_p3d.so" name="p"><bodyName>base</bodyName></plugin>
  <plugin filename="libgazebo_ros_imu.so" name="pi"><bodyName>base</bodyName><gaussianNoise>1</gaussianNoise>
    <serviceName>s</serviceName></plugin></gazebo>
<gazebo reference="base">
  <sensor name="scan" type="ray"><always_on>1</always_on><update_rate>10</update_rate><pose>0 0 1 0 0 0</pose>
    <visualize>true</visualize><topic>scan</topic><ray><scan><horizontal><samples>3</samples>
    <resolution>1</resolution><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal><vertical>
    <samples>1</samples></vertical></scan><range><min>0.1</min><max>9</max><resolution>0.1</resolution></range>
    <noise><type>gaussian</type><mean>0</mean><stddev>0.1</stddev></noise></ray>
    <plugin filename="libgazebo_ros_ray_sensor.so"><frame_name>base</frame_name></plugin></sensor>
  <sensor name="imu" type="imu"><imu><angular_velocity><x><noise type="gaussian"><stddev>0.1</stddev>
    <bias_stddev>0.1</bias_stddev></noise></x><y><noise><stddev>0.2</stddev></noise></y></angular_velocity>
    </imu></sensor>
  <sensor name="eye" type="camera"><camera name="e"><horizontal_fov>1</horizontal_fov><image><width>4</width>
    <height>3</height><format>R8G8B8</format></image><clip><near>1</near><far>2</far></clip><noise>
    <type>gaussian</type><stddev>0.1</stddev></noise><lens><intrinsics><fx>3</fx><fy>2</fy></intrinsics></lens>
    </camera></sensor>
  <sensor name="bump" type="contact"><contact><collision>c</collision></contact></sensor>
  <sensor name="high" type="altimeter"><altimeter/></sensor>
  <sensor name="bare" type="camera"/><sensor/></gazebo>
<transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="j">
  <hardwareInterface>EffortJointInterface</hardwareInterface>
  <hardwareInterface>PositionJointInterface</hardwareInterface></joint>
  <actuator name="m"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>
<transmission name="d"><type>DifferentialTransmission</type><joint name="j"/></transmission>
<ros2_control name="c" type="system"><hardware><plugin>x</plugin><param name="p">1</param></hardware>
  <sensor name="ft"><state_interface name="force.x"/></sensor><joint name="k">
  <state_interface name="position"/><state_interface name="acceleration"/><param name="mimic">j</param>
  </joint></ros2_control>
<sensor name="s"><parent link="base"/></sensor><wholly_unknown><child/></wholly_unknown>
</robot>"""  # fmt: skip

DEMANDED: dict[str, tuple[str, str]] = {
    "robot 'all'": ("kept", "version= is dropped"),
    "link 'base'": ("kept", "type= is dropped"),
    "link 'base'/visual": ("kept", "name= is dropped"),
    "link 'base'/collision": ("kept", "name= is dropped"),
    "link 'base'/odd/odder": ("dropped", "no counterpart"),
    "gazebo 'base'/mu2": ("dropped", "mu1 counts"),
    "gazebo 'base'/material": ("translated", "1 0.5088 0.0468 1"),
    "gazebo 'base'/selfCollide": ("translated", "excludes"),
    "gazebo 'base'/turnGravityOff": ("translated", "gravcomp"),
    "gazebo 'base'/dampingFactor": ("dropped", "slows down"),
    "gazebo 'base'/blob/inner": ("dropped", ""),
    "gazebo 'arm'/gravity": ("kept", "gravity pulls"),
    "gazebo 'arm'/mu1": ("dropped", "no collision shape"),
    "gazebo 'arm'/material": ("dropped", "material of its own"),
    "gazebo 'frame'": ("dropped", "nothing in it"),
    "gazebo 'frame'/material": ("dropped", "no plain colour"),
    "gazebo 'nowhere'/mu1": ("dropped", "no link or joint is called 'nowhere'"),
    "sensor 'ghost'": ("dropped", "no link or joint"),
    "gazebo 'j'/springStiffness": ("kept", "stiffness"),
    "gazebo 'j'/springReference": ("kept", "springref"),
    "gazebo 'j'/implicitSpringDamper": ("kept", "implicitly"),
    "gazebo 'j'/provideFeedback": ("dropped", ""),
    "gazebo 'f'/preserveFixedJoint": ("kept", "fused"),
    "gazebo 'f'/disableFixedJointLumping": ("dropped", "fused"),
    "gazebo 'f'/springStiffness": ("dropped", "no spring"),
    "gazebo/static": ("kept", "free base"),
    "gazebo/plugin": ("dropped", "not simulated"),
    "joint 'f'/mimic": ("dropped", "a fixed joint has none"),
    "joint 'k'/mimic": ("translated", "equality"),
    "sensor 'scan'": ("translated", "'scan'"),
    "sensor 'scan'/update_rate": ("dropped", "report.json"),
    "sensor 'scan'/ray/scan/horizontal": ("translated", "inside"),
    "sensor 'scan'/ray/scan/horizontal/resolution": ("dropped", ""),
    "sensor 'scan'/ray/scan/vertical": ("dropped", "nothing in it"),
    "sensor 'scan'/ray/range/min": ("dropped", "report.json"),
    "sensor 'scan'/ray/range/max": ("translated", "cutoff"),
    "sensor 'scan'/plugin": ("dropped", ""),
    "sensor 'imu'/imu/angular_velocity/x/noise/stddev": ("translated", "noise"),
    "sensor 'imu'/imu/angular_velocity/x/noise/bias_stddev": ("dropped", "report.json"),
    "sensor 'imu'/imu/angular_velocity/y/noise/stddev": ("dropped", "x axis"),
    "sensor 'eye'/camera/horizontal_fov": ("translated", "fovy"),
    "sensor 'eye'/camera/clip/near": ("dropped", "alike"),
    "sensor 'eye'/camera/noise": ("dropped", ""),
    "sensor 'eye'/camera/lens/intrinsics/fx": ("translated", "focalpixel"),
    "sensor 'bump'/contact/collision": ("dropped", "every shape"),
    "sensor 'high'": ("dropped", "altimeter"),
    "sensor 'bare'": ("dropped", "camera"),
    "transmission 't'": ("translated", "actuator 'j'"),
    "transmission 't'/actuator 'm'/mechanicalReduction": ("dropped", "50:1"),
    "transmission 'd'": ("dropped", "DifferentialTransmission"),
    "ros2_control 'c'/joint 'k'/state_interface 'position'": ("translated", "sensor"),
    "ros2_control 'c'/joint 'k'/state_interface 'acceleration'": ("dropped", ""),
    "ros2_control 'c'/hardware/plugin": ("dropped", "hardware"),
    "wholly_unknown": ("dropped", "no counterpart"),
    "wholly_unknown/child": ("dropped", ""),
}


@pytest.fixture(scope="module")
def entries() -> tuple[TagEntry, ...]:
    description = parse_urdf(EVERYTHING, Path("all.urdf"))
    return tag_ledger(description, roles_of(description))


def test_every_element_has_one_entry_in_file_order(entries: tuple[TagEntry, ...]) -> None:
    elements = list(etree.fromstring(EVERYTHING).iter(tag=etree.Element))
    assert [entry.line for entry in entries] == [element.sourceline for element in elements]
    assert all(entry.note for entry in entries)


@pytest.mark.parametrize("element", DEMANDED)
def test_fate(element: str, entries: tuple[TagEntry, ...]) -> None:
    outcome, note = DEMANDED[element]
    entry = next(entry for entry in entries if entry.element == element)
    assert entry.outcome == outcome, entry
    assert note in entry.note, entry


def test_the_whole_ledger_reads_as_it_did() -> None:
    """Each line was read by a person against what the conversion does; a new fate is a new line to read."""
    description = parse_urdf(EVERYTHING, Path("all.urdf"))
    made = tag_ledger(description, roles_of(description))
    told = [f"{entry.outcome:10} {entry.element}: {entry.note}" for entry in made]
    assert told == Path(__file__).with_name("everything.txt").read_text("utf-8").splitlines()


def all_of(element: str, entries: tuple[TagEntry, ...]) -> list[tuple[str, str]]:
    return [(entry.outcome, entry.note) for entry in entries if entry.element == element]


def test_of_things_that_stand_twice_only_the_effective_one_is_kept(entries: tuple[TagEntry, ...]) -> None:
    assert [outcome for outcome, _ in all_of("material", entries)] == ["kept", "dropped", "dropped"]
    assert [outcome for outcome, _ in all_of("link 'base'/visual/geometry", entries)].count("dropped") == 1
    assert all_of("link 'base'/visual/geometry/sphere", entries)[0][0] == "dropped"
    first, second = [e.outcome for e in entries if e.element.endswith("'j'/hardwareInterface")]
    assert (first, second) == ("translated", "dropped")
    assert [outcome for outcome, _ in all_of("gazebo 'base'/mu1", entries)] == ["kept", "dropped"]


def test_nothing_unknown_has_an_effect(entries: tuple[TagEntry, ...]) -> None:
    for word in ("odd", "blob", "wholly_unknown", "altimeter", "verbose", "torsional", "hardware/"):
        found = [entry for entry in entries if word in entry.element]
        assert found
        assert {entry.outcome for entry in found} == {"dropped"}, word
