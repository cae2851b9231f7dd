"""robot_state_publisher's parameters, and the node that sends transforms seldom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench
from twin.bridge.msgs import JointState, String, TFMessage, header, ns
from twin.bridge.qos import LATCHED
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.errors import BridgeError
from twin.geometry import Pose3
from twin.models import load
from twin.nodes.robot_state_publisher import RobotStatePublisherNode
from twin.nodes.tf_throttle import TfThrottleNode

MS = 1_000_000


def joint_state(time_ns: int, **positions: float) -> JointState:
    values = np.array(list(positions.values()))
    return JointState(header(time_ns, ""), list(positions), values, np.zeros(0), np.zeros(0))


class Published:
    """Stamps [ms] of every child frame on /tf."""

    def __init__(self, bench: Bench) -> None:
        self.stamps: dict[str, list[int]] = {}
        self.parents: dict[str, str] = {}
        bench.node.create_subscription(TFMessage, "/tf", self._on_message, 100)

    def _on_message(self, message: TFMessage) -> None:
        for item in message.transforms:
            self.stamps.setdefault(item.child_frame_id, []).append(ns(item.header.stamp) // MS)
            self.parents[item.child_frame_id] = item.header.frame_id


def send(bench: Bench, *messages: JointState) -> None:
    publisher = bench.node.create_publisher(JointState, "joint_states", 1)
    for message in messages:
        publisher.publish(message)
        bench.tick()
    bench.tick()


def test_each_joint_is_published_so_often_and_stamped_as_its_state(bench: Bench) -> None:
    RobotStatePublisherNode(bench.bus, load("diff_bot"), parameters={"publish_frequency": 10.0})
    published = Published(bench)
    states = [
        joint_state(time * MS, **{f"wheel_{side}_joint": 0.1})
        for time in range(1000, 1300, 30)
        for side in ("left", "right")
    ]
    send(bench, *states)
    assert published.stamps == {"wheel_left": [1000, 1120, 1210], "wheel_right": [1000, 1120, 1210]}


def test_stamps_may_be_ignored(bench: Bench) -> None:
    RobotStatePublisherNode(bench.bus, load("diff_bot"), parameters={"ignore_timestamp": True})
    published = Published(bench)
    send(bench, *[joint_state(5 * MS, wheel_left_joint=0.1)] * 3)
    assert published.stamps == {"wheel_left": [5, 5, 5]}


def test_frames_have_the_prefix(bench: Bench) -> None:
    static = bench.listen(TFMessage, "/tf_static", LATCHED)
    RobotStatePublisherNode(bench.bus, load("diff_bot"), parameters={"frame_prefix": "one/"})
    published = Published(bench)
    send(bench, joint_state(0, wheel_left_joint=0.1))
    assert published.parents == {"one/wheel_left": "one/base_link"}
    mounts = {item.child_frame_id: item.header.frame_id for item in static[-1].transforms}
    assert mounts["one/lidar_link"] == "one/base_link"
    assert len(mounts) == 7


def test_joints_that_it_does_not_know_and_states_that_make_no_sense(bench: Bench) -> None:
    logs = bench.logs()
    RobotStatePublisherNode(bench.bus, load("warehouse_bot"))
    published = Published(bench)
    broken = joint_state(100 * MS, left_finger_joint=0.01)
    broken.name.append("right_finger_joint")
    send(
        bench,
        joint_state(0, of_another_robot=1.0, left_finger_joint=0.01, lift_joint=float("nan")),
        broken,
        broken,
        joint_state(200 * MS, of_another_robot=1.0),
        joint_state(300 * MS, arm_stage_1_joint=0.1),
    )
    fingers = {frame: stamps for frame, stamps in published.stamps.items() if "finger" in frame}
    assert list(fingers.values()) == [[0], [0]], "who follows a joint moves with it"
    assert len(published.stamps) == 4
    assert len([line for line in logs if "2 names and 1 positions" in line]) == 1


@pytest.mark.parametrize("frequency", [0.0, -1.0, 2000.0])
def test_a_frequency_that_makes_no_sense_is_refused(bench: Bench, frequency: float) -> None:
    with pytest.raises(
        BridgeError, match=r"publish_frequency of /robot_state_publisher is .* at most 1000 Hz"
    ):
        RobotStatePublisherNode(bench.bus, load("diff_bot"), parameters={"publish_frequency": frequency})


def test_a_prefix_that_changes_is_that_of_fixed_frames_too(bench: Bench) -> None:
    static = bench.listen(TFMessage, "/tf_static", LATCHED)
    published = Published(bench)
    robot = RobotStatePublisherNode(bench.bus, load("diff_bot"))
    bench.tick()
    robot.node.set_parameter("frame_prefix", "two/")
    send(bench, joint_state(0, wheel_left_joint=0.1))
    assert len(static) == 2
    assert "two/lidar_link" in {item.child_frame_id for item in static[-1].transforms}
    assert published.parents == {"two/wheel_left": "two/base_link"}


def test_another_description_takes_the_place_of_the_first(bench: Bench) -> None:
    static = bench.listen(TFMessage, "/tf_static", LATCHED)
    texts = bench.listen(String, "/robot_description", LATCHED)
    published = Published(bench)
    robot = RobotStatePublisherNode(bench.bus, load("diff_bot"))
    longer = load("diff_bot").urdf.replace('"lidar_link"', '"scanner"')
    robot.node.set_parameter("robot_description", longer)
    send(bench, joint_state(0, wheel_left_joint=0.1))
    assert [text.data for text in texts][-1] == longer
    assert "scanner" in {item.child_frame_id for item in static[-1].transforms}
    assert set(published.parents) == {"wheel_left"}


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("publish_frequency", 0.0, "at most 1000 Hz"),
        ("publish_frequency", 2000.0, "at most 1000 Hz"),
        ("robot_description", "<robot", "robot_description: .*not well-formed"),
        ("robot_description", "", "robot_description: "),
    ],
)
def test_what_cannot_be_is_refused_at_run_time(bench: Bench, name: str, value: Any, words: str) -> None:
    robot = RobotStatePublisherNode(bench.bus, load("diff_bot"))
    was = robot.node.get_parameter(name).value
    with pytest.raises(BridgeError, match=words):
        robot.node.set_parameter(name, value)
    assert robot.node.get_parameter(name).value == was


def test_a_chain_is_sent_again_when_it_has_moved(bench: Bench) -> None:
    limits = {"rate": 10.0, "trans_thres": 0.1, "angular_thres": 0.5}
    names = {"target_frame": "map", "source_frames": ["base", "nowhere"]}
    TfThrottleNode(bench.bus, parameters={**limits, **names})
    broadcaster = TransformBroadcaster(bench.node)
    got = bench.listen(TFMessage, "tf_throttled", 100)

    def drive() -> None:
        now = bench.clock.now_ns
        x = max(0.0, bench.now_s - 1.0)  # stands for a second, then 1 m/s
        broadcaster.send_transform(
            [
                transform_stamped("map", "odom", now, Pose3.from_xyz_rpy((5.0, 0.0, 0.0))),
                transform_stamped("odom", "base", now, Pose3.from_xyz_rpy((x, 0.0, 0.0))),
            ]
        )

    bench.each_tick.append(drive)
    bench.run(1.0)
    assert [[t.child_frame_id for t in message.transforms] for message in got] == [["base"]]
    assert got[0].transforms[0].header.frame_id == "map"
    assert got[0].transforms[0].transform.translation.x == pytest.approx(5.0)
    bench.run(1.0)
    assert 5 <= len(got) <= 10
    steps = np.diff([message.transforms[0].transform.translation.x for message in got])
    assert (steps > 0.1 - 1e-9).all()
