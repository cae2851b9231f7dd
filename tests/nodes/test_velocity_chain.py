"""From commands to wheels: twist_mux, velocity_smoother, diff_drive_controller."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from tests.nodes.conftest import TICK_S, Bench, Joints, Robot, open_room
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Float64MultiArray, JointState, MultiArrayLayout, Odometry, Twist
from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.nodes.diff_drive_controller import planar_covariance
from twin.nodes.joint_state_broadcaster import JointStateBroadcasterNode
from twin.nodes.missions.simple import VelocityProfileNode
from twin.nodes.navigation.velocity.twist_mux import TwistMuxNode
from twin.nodes.navigation.velocity.velocity_smoother import VelocitySmootherNode
from twin.nodes.position_controller import PositionControllerNode


def speeds(messages: list[Twist]) -> list[float]:
    return [message.linear.x for message in messages]


def test_mux_passes_the_highest_live_source_on(bench: Bench) -> None:
    TwistMuxNode(bench.bus)
    out = bench.listen(Twist, "cmd_vel")
    names = ("cmd_vel_smoothed", "cmd_vel_docking", "cmd_vel_teleop")
    publishers = {name: bench.node.create_publisher(Twist, name, 1) for name in names}

    def send(**values: float) -> list[float]:
        out.clear()
        for name, value in values.items():
            publishers[name].publish(twist_from_planar(value, 0.0))
        bench.run(2 * TICK_S)
        return speeds(out)

    assert send(cmd_vel_smoothed=0.1) == [0.1]
    assert send(cmd_vel_teleop=0.3) == [0.3]
    assert send(cmd_vel_smoothed=0.1) == [], "a person at the joystick is in charge"
    assert send(cmd_vel_docking=0.2) == []
    bench.run(0.6)
    assert send(cmd_vel_docking=0.2) == [0.2], "teleop is silent for longer than its time-out"
    assert send(cmd_vel_smoothed=0.1) == []


@pytest.fixture
def smoother(bench: Bench) -> VelocitySmootherNode:
    limits = AxisLimits(max_velocity=0.5, max_acceleration=1.0, max_deceleration=2.0)
    return VelocitySmootherNode(bench.bus, VelocitySmootherConfig(linear=limits))


def test_smoother_ramps_and_falls_silent_at_rest(bench: Bench, smoother: VelocitySmootherNode) -> None:
    out = bench.listen(Twist, "cmd_vel_smoothed")
    bench.run(1.0)
    assert out == [], "nothing was asked for, nothing is sent: others may drive"
    publisher = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)
    publisher.publish(twist_from_planar(2.0, 0.0))
    bench.run(0.48)
    ramp = speeds(out)
    assert np.diff(ramp).max() <= 1.0 * TICK_S + 1e-9
    assert ramp[-1] == pytest.approx(0.46, abs=0.03)
    bench.run(3.0)
    assert max(speeds(out)) <= 0.5
    assert out[-1].linear.x == 0.0, "no command for long: brought to rest"
    sent = len(out)
    bench.run(1.0)
    assert len(out) == sent


def test_smoother_refuses_nan_and_keeps_the_last_command(
    bench: Bench, smoother: VelocitySmootherNode
) -> None:
    out, logs = bench.listen(Twist, "cmd_vel_smoothed"), bench.logs()
    publisher = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)
    publisher.publish(twist_from_planar(math.nan, 0.0))
    bench.run(0.2)
    assert out == []
    for value in (0.2, math.nan, math.inf):
        publisher.publish(twist_from_planar(value, 0.0))
        bench.run(0.3)
    assert all(math.isfinite(speed) for speed in speeds(out))
    assert out[10].linear.x > 0.15
    assert len([line for line in logs if "must be finite" in line]) == 3


def test_drive_turns_wheels_and_reports_where_it_is(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    odom = bench.listen(Odometry, "odom")
    command = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)
    for _ in range(20):
        command.publish(twist_from_planar(0.3, 0.6))
        bench.run(0.1)
    left, right = robot.joints.velocity
    assert left == pytest.approx((0.3 - 0.6 * 0.15) / 0.05)
    assert right == pytest.approx((0.3 + 0.6 * 0.15) / 0.05)
    last = odom[-1]
    assert (last.header.frame_id, last.child_frame_id) == ("odom", "base_footprint")
    assert last.twist.twist.linear.x == pytest.approx(0.3)
    assert last.twist.twist.angular.z == pytest.approx(0.6)
    covariance = last.pose.covariance.reshape(6, 6)
    assert covariance[0, 0] > 0.0
    assert covariance[5, 5] > 0.0
    assert covariance[2, 2] >= 1e6, "height is not measured"
    assert np.array_equal(covariance, covariance.T)
    pose = last.pose.pose
    assert math.hypot(pose.position.x, pose.position.y) > 0.4
    in_odom = robot.pose_lookup.in_odom()
    assert in_odom is not None
    assert in_odom.x == pytest.approx(pose.position.x, abs=0.4 * TICK_S)
    assert in_odom.yaw == pytest.approx(
        2.0 * math.atan2(pose.orientation.z, pose.orientation.w), abs=0.7 * TICK_S
    )


def test_drive_turns_left_for_positive_angular(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    bench.node.create_publisher(Twist, "cmd_vel_nav", 1).publish(twist_from_planar(0.0, 1.0))
    bench.run(0.4)
    assert robot.joints.velocity[1] > 0.0 > robot.joints.velocity[0]
    assert robot.pose.yaw > 0.1


def test_drive_stops_when_commands_stop(bench: Bench) -> None:
    robot = Robot(bench, open_room())
    bench.node.create_publisher(Twist, "cmd_vel_nav", 1).publish(twist_from_planar(0.3, 0.0))
    bench.run(0.4)
    assert robot.joints.velocity[0] > 5.0
    bench.run(0.5)
    assert np.array_equal(robot.joints.velocity, [0.0, 0.0])


def test_drive_refuses_what_is_not_finite(bench: Bench) -> None:
    robot, logs = Robot(bench, open_room()), bench.logs()
    command = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)
    for v, w in ((0.2, 0.0), (math.nan, 0.0), (0.2, -math.inf)):
        command.publish(twist_from_planar(v, w))
        bench.run(0.1)
    assert len([line for line in logs if "cmd_vel refused" in line]) == 2
    assert np.allclose(robot.joints.velocity, 4.0), "the last good command holds until its time-out"


def test_joint_states_are_what_the_encoders_say(bench: Bench) -> None:
    joints = Joints(wheels=("left", "right"), others=("lift",))
    JointStateBroadcasterNode(bench.bus, joints, period_ns=20_000_000)
    got = bench.listen(JointState, "joint_states")
    joints.position[:] = (1.0, 2.0, 0.3)
    bench.run(1.0)
    assert len(got) in (49, 50)
    assert got[-1].name == ["left", "right", "lift"]
    assert got[-1].position.tolist() == [1.0, 2.0, 0.3]


def test_position_controller_takes_one_value_per_joint(bench: Bench) -> None:
    joints, logs = Joints(others=("tilt", "swivel")), bench.logs()
    PositionControllerNode(bench.bus, joints, joints.joint_names)
    publisher = bench.node.create_publisher(Float64MultiArray, "position_controller/commands", 1)
    layout = MultiArrayLayout(dim=[], data_offset=0)
    publisher.publish(Float64MultiArray(layout=layout, data=np.array([0.1, 0.2])))
    bench.run(0.1)
    publisher.publish(Float64MultiArray(layout=layout, data=np.array([9.0])))
    bench.run(0.1)
    assert joints.target.tolist() == [0.1, 0.2]
    assert any("1 commands for the 2 joints tilt, swivel" in line for line in logs)


def test_a_velocity_profile_keeps_its_durations_to_the_control_period(bench: Bench) -> None:
    sent: list[tuple[float, float]] = []
    bench.node.create_subscription(
        Twist, "cmd_vel", lambda twist: sent.append((round(bench.now_s, 3), twist.linear.x)), 10
    )
    mission = VelocityProfileNode(bench.bus, [(0.13, 1.0, 0.0), (1.005, 2.0, 0.0), (0.1, 3.0, 0.0)])
    bench.until(lambda: mission.done)
    begins: dict[float, float] = {}
    for time_s, speed in sent:
        begins.setdefault(speed, time_s)
    start = begins[1.0]
    due = {1.0: 0.0, 2.0: 0.13, 3.0: 1.135, 0.0: 1.235}
    assert list(begins) == list(due)
    for speed, at in due.items():
        assert -1e-9 <= begins[speed] - start - at < 0.02, "at the first control period at or after"
    assert all(later - earlier <= 0.1 + 1e-9 for (earlier, _), (later, _) in pairwise(sent)), "10 Hz or more"


def test_a_covariance_in_the_plane_is_part_of_one_in_space() -> None:
    planar = np.random.default_rng(1).normal(size=(3, 3))
    full = planar_covariance(planar.flat).reshape(6, 6)
    np.testing.assert_array_equal(full[np.ix_([0, 1, 5], [0, 1, 5])], planar)
    assert full[2:5, 2:5].tolist() == np.diag([1e6] * 3).tolist()
    assert np.count_nonzero(full) == 12
    assert not full.flags.writeable, "messages may share it"
