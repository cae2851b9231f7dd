"""Wheels, motors and masses that are not as all believe."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from tests.faults.conftest import ROUND, Drive
from twin.errors import ScenarioError

AHEAD = ROUND.replace("angular: 0.5", "angular: 0")
TURN = ROUND.replace("linear: 0.3, angular: 0.5", "linear: 0, angular: 1")
GUST = ROUND.replace("linear: 0.3, angular: 0.5", "linear: 1.2, angular: 0")
"""Faster than the wheels can start."""


def test_a_smaller_wheel_comes_less_far_and_odometry_does_not_know(drive: Drive) -> None:
    plain, small = drive("", AHEAD), drive("[wheel_radius: 0.9]", AHEAD)
    assert small.pose.x / plain.pose.x == pytest.approx(0.9, abs=0.002)
    assert small.odometry.x == pytest.approx(plain.odometry.x, rel=0.002)
    travel = small.odometry.x
    report = small.reports["wheel_radius"]
    assert report.outcome == "landed"
    assert float(report.effect.split()[0]) == pytest.approx(0.1 * travel, rel=0.03)


def test_one_smaller_wheel_leads_to_its_side_and_is_the_right_one_again(drive: Drive) -> None:
    ended = drive("[wheel_radius: {factor: 0.9, joint: wheel_left_joint}]", AHEAD)
    assert ended.pose.yaw > 0.1
    assert abs(ended.odometry.yaw) < 0.02
    for_a_while = drive("[wheel_radius: {factor: 0.9, joint: wheel_left_joint, duration: 0.7 s}]", AHEAD)
    assert 0.2 < for_a_while.pose.yaw / ended.pose.yaw < 0.6
    yaws = [2.0 * math.atan2(t.message.pose.pose.orientation.z, 1.0) for t in for_a_while.said["/odom"]]
    assert np.abs(np.diff(yaws)).max() < 0.01, "odometry does not jump when the wheel is changed"


def test_a_wider_robot_turns_less(drive: Drive) -> None:
    plain, wide = drive("", TURN), drive("[track: 1.1]", TURN)
    assert wide.pose.yaw / plain.pose.yaw == pytest.approx(1.0 / 1.1, abs=0.01)
    assert wide.odometry.yaw == pytest.approx(plain.odometry.yaw, abs=0.01)
    report = wide.reports["track"]
    assert report.outcome == "landed"
    assert float(report.effect.split()[0]) == pytest.approx(
        math.degrees(plain.pose.yaw - wide.pose.yaw), rel=0.2
    )
    straight = drive("[track: 1.1]", AHEAD).reports["track"]
    assert straight.outcome == "no_effect", "who does not turn notices nothing"


@pytest.mark.parametrize("fault", ["friction: 0.05", "slippery_floor: 0.05"])
def test_without_friction_wheels_spin_and_odometry_believes_them(drive: Drive, fault: str) -> None:
    plain, icy = drive("", GUST), drive(f"[{fault}]", GUST)
    assert icy.pose.x < 0.6 * plain.pose.x
    assert icy.odometry.x > 1.5 * icy.pose.x
    (report,) = icy.reports.values()
    assert report.outcome == "landed"
    assert "at the limit of friction in" in report.effect


def test_a_wheel_that_slips_turns_the_robot(drive: Drive) -> None:
    ended = drive("[wheel_slip: {joint: wheel_left_joint, factor: 0.01}]", AHEAD)
    assert ended.pose.yaw > 0.2 > 4.0 * abs(ended.odometry.yaw)


def test_a_patch_is_slippery_only_where_it_is(drive: Drive) -> None:
    crossed = drive("[slippery_floor: {friction: 0.02, patch: {x: 0, y: 0, within: 20 cm}}]", GUST)
    beside = drive("[slippery_floor: {friction: 0.02, patch: {x: 0, y: 2, within: 20 cm}}]", GUST)
    assert crossed.reports["slippery_floor"].outcome == "landed"
    assert beside.reports["slippery_floor"].outcome == "no_effect"
    assert crossed.pose.x < beside.pose.x - 0.1
    left = drive("[slippery_floor: {friction: 0.01, patch: {x: 0, y: 0.12, within: 10 cm}}]", AHEAD)
    assert left.pose.yaw > 0.1, "only the left wheel is on it"


def test_enough_friction_is_no_fault(drive: Drive) -> None:
    report = drive("[friction: 0.7]", AHEAD).reports["friction"]
    assert report.outcome == "no_effect"
    assert report.effect.startswith("wheels at the limit of friction in 0 of 7")
    assert 0 < int(re.search(r"used at most (\d+) % of it", report.effect)[1]) < 98  # type: ignore[index]


def test_a_wheel_without_grip_that_rolls_straight_on_needs_none(drive: Drive) -> None:
    plain = drive("", AHEAD)
    slips = drive("[wheel_slip: {joint: wheel_left_joint, factor: 0.02, at: 1 s, duration: 0.2 s}]", AHEAD)
    (report,) = slips.reports.values()
    assert report.outcome == "no_effect"
    assert report.effect.endswith("0 of 10 ticks; they used at most 0 % of it")
    assert slips.pose.x == pytest.approx(plain.pose.x, abs=1e-9)
    assert slips.pose.yaw == pytest.approx(plain.pose.yaw, abs=1e-9)


def test_a_weak_motor_is_slow_and_its_side_lags(drive: Drive) -> None:
    plain = drive("", GUST)
    weak = drive("[weak_motor: 0.2]", GUST)
    assert weak.pose.x < 0.6 * plain.pose.x
    assert abs(weak.pose.yaw) < 0.02
    left = drive("[weak_motor: {factor: 0.2, joint: wheel_left_joint}]", GUST)
    assert left.pose.yaw > 0.1
    assert left.reports["weak_motor"].outcome == "landed"
    strong = drive("[weak_motor: 0.95]", AHEAD.replace("linear: 0.3", "linear: 0.02"))
    assert strong.reports["weak_motor"].outcome == "no_effect"


def test_with_a_flat_battery_the_robot_coasts_and_drives_on_when_it_is_charged(drive: Drive) -> None:
    flat = drive("[flat_battery: {at: 0.7 s}]", AHEAD)
    assert flat.reports["flat_battery"].outcome == "landed"
    speeds = [told.message.twist.twist.linear.x for told in flat.said["/odom"]]
    assert speeds[32] == pytest.approx(0.3, abs=0.03)
    still = drive("[flat_battery: ]", AHEAD)
    assert abs(still.pose.x) < 1e-3, "nothing drives it"
    again = drive("[flat_battery: {duration: 0.5 s}]", AHEAD)
    assert again.pose.x > 0.15
    asleep = drive("[flat_battery: ]", AHEAD.replace("linear: 0.3", "linear: 0"))
    assert asleep.reports["flat_battery"].outcome == "no_effect", "who stands needs no motors"


def test_latency_delays_the_start_by_as_much(drive: Drive) -> None:
    def starts(fault: str) -> int:
        said = drive(fault, AHEAD).said["/odom"]
        return next(told.time_ns for told in said if told.message.twist.twist.linear.x > 0.05)

    assert starts("[latency: 120 ms]") - starts("") == 120_000_000
    both = "[{latency: 60 ms}, {latency: {time: 40 ms, label: more}}]"
    assert starts(both) - starts("") == 100_000_000
    assert starts("[latency: {time: 100 ms, duration: 60 ms}]") == starts(""), "over before it starts"
    midway = drive("[latency: {time: 200 ms, at: 0.9 s}]", AHEAD)
    speeds = [t.message.twist.twist.linear.x for t in midway.said["/odom"] if t.time_ns > 800_000_000]
    assert min(speeds[:25]) > 0.28, "the motors go on with what they do"
    over = drive("[latency: {time: 100 ms, duration: 0.2 s}]", AHEAD)
    assert over.reports["latency"].effect == "motors late in 5 of 11 ticks"


def test_mass_is_heavier_to_the_floor_and_to_the_motors(drive: Drive) -> None:
    plain, heavy = drive("", GUST), drive("[mass: 3]", GUST)
    body = "diff_bot/base_footprint"
    assert heavy.run.world.weight(body) == pytest.approx(3.0 * plain.run.world.weight(body))
    assert heavy.pose.x < plain.pose.x
    part = drive("[mass: {factor: 2, link: base_link}]", AHEAD)
    assert 1.5 < part.run.world.weight(body) / plain.run.world.weight(body) < 2.0


def test_a_stuck_caster_brakes(drive: Drive) -> None:
    plain, stuck = (
        drive("", TURN),
        drive("[{stuck_caster: }, {mass: {factor: 60, link: caster_front}}]", TURN),
    )
    assert stuck.reports["stuck_caster"].outcome == "landed"
    assert "dragged with up to" in stuck.reports["stuck_caster"].effect
    assert abs(stuck.pose.yaw) < 0.97 * abs(plain.pose.yaw)


def test_an_encoder_that_is_right_again_counts_on_from_there(drive: Drive) -> None:
    ended = drive("[encoder: {joint: wheel_left_joint, factor: 0, at: 0.3 s, duration: 0.4 s}]", AHEAD)
    lefts = []
    for told in ended.said["/joint_states"]:
        place = list(told.message.name).index("wheel_left_joint")
        lefts.append((told.time_ns, told.message.position[place]))
    during = {round(angle, 6) for time, angle in lefts if 320_000_000 <= time <= 700_000_000}
    assert len(during) == 1
    assert max(np.diff([angle for _, angle in lefts])) < 0.5, "without a jump"
    assert lefts[-1][1] > max(during) + 1.0


@pytest.mark.parametrize(
    "fault",
    [
        "wheel_radius: {factor: 0.9, duration: 0.2 s}",
        "track: {factor: 1.1, duration: 0.2 s}",
        "mass: {factor: 2, duration: 0.2 s}",
        "friction: {factor: 0.1, duration: 0.2 s}",
        "slippery_floor: {friction: 0.1, duration: 0.2 s}",
        "stuck_caster: {duration: 0.2 s}",
        "weak_motor: {factor: 0.1, duration: 0.2 s}",
        "flat_battery: {duration: 0.2 s}",
    ],
)
def test_when_a_fault_is_over_the_physics_is_what_it_was_to_the_last_bit(drive: Drive, fault: str) -> None:
    names = [
        name
        for name in dir(drive().run.world.model)
        if name.startswith(("geom_", "body_", "actuator_", "dof_"))
    ]

    def parameters(faults: str) -> dict[str, np.ndarray]:
        model = drive(faults, duration="0.3 s").run.world.model
        values = {name: getattr(model, name) for name in names}
        return {name: value.copy() for name, value in values.items() if isinstance(value, np.ndarray)}

    plain, after = parameters(""), parameters(f"[{fault}]")
    bounds = {"actuator_forcelimited", "actuator_forcerange"}
    different = [name for name in plain if not np.array_equal(plain[name], after[name], equal_nan=True)]
    assert set(different) <= (bounds if "motor" in fault or "battery" in fault else set())
    assert after["actuator_forcerange"][:, 1] == pytest.approx(plain["actuator_forcerange"][:, 1])
    during = parameters(f"[{fault.replace(', duration: 0.2 s', '').replace('duration: 0.2 s', '')}]")
    changed = {name for name in plain if not np.array_equal(plain[name], during[name], equal_nan=True)}
    assert changed or fault.startswith("wheel_radius"), "which is in the hardware"


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (
            "wheel_slip: {joint: wheel_lefft_joint}",
            "no driven wheel 'wheel_lefft_joint'; did you mean 'wheel_left_joint",
        ),
        ("weak_motor: {factor: 0.5, joint: caster}", "no motor at joint 'caster'"),
        ("stuck_caster: {link: wheel_left}", "no caster 'wheel_left'; .*caster_front"),
        ("mass: {factor: 2, link: base}", "no link 'base'; did you mean 'base_link'"),
        ("encoder: {joint: caster, factor: 1}", "no encoder at joint 'caster'"),
        ("latency: 15 ms", r"the latency \(15 ms\) must be a whole number of control periods \(20 ms\)"),
        ("dropped_good: ", "robot 'diff_bot' has no gripper"),
    ],
)
def test_what_a_robot_lacks_is_told(drive: Drive, fault: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        drive(f"[{fault}]")
