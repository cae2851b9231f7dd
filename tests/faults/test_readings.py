"""Sensors that measure wrongly, seldom, late or not at all."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.faults.conftest import Drive, Ended
from twin.bridge.msgs import Imu, LaserScan
from twin.errors import ScenarioError

TO_SCAN = ((LaserScan, "/scan"),)


def scans(ended: Ended) -> np.ndarray:
    """Return the ranges of all scans, shape (scans, rays)."""
    return np.array([told.message.ranges for told in ended.said["/scan"]])


def payloads(ended: Ended, *without: str) -> dict[str, list[str]]:
    """Return all that was said but on some topics."""
    return {t: [repr(told) for told in all_] for t, all_ in ended.said.items() if t not in without}


def test_noise_comes_on_top_of_one_sensor_and_changes_no_other(drive: Drive) -> None:
    plain, noisy = drive(), drive("[noise: {sensor: scan, stddev: 0.05}]")
    seen = np.isfinite(scans(plain))
    off = (scans(noisy) - np.where(seen, scans(plain), 0.0))[seen]
    assert off.std() == pytest.approx(0.05, rel=0.05)
    assert abs(off.mean()) < 0.005
    assert payloads(plain, "/scan", "/rosout") == payloads(noisy, "/scan", "/rosout"), "not another bit"
    assert noisy.reports["noise"].effect == "15 of 15 readings of scan altered"
    assert not noisy.said["/scan"][0].message.ranges.flags.writeable, "as those of others: many hear it"
    other = drive("[{loss: {share: 1, topic: /imu}}, {noise: {sensor: scan, stddev: 0.05}}]")
    assert np.array_equal(scans(other), scans(noisy)), "another fault changes nothing of its numbers"
    other = drive("[{noise: {sensor: imu, stddev: 1}}, {noise: {sensor: scan, stddev: 0.05}}]")
    assert np.array_equal(scans(other), scans(noisy)), "nor one of its kind"
    assert not np.array_equal(scans(drive("[noise: {sensor: scan, stddev: 0.05}]", seed="2")), scans(noisy))
    twice = drive("[{noise: {sensor: scan, stddev: 0.05}}, {noise: {sensor: scan, stddev: 0.05}}]")
    off = (scans(twice) - np.where(seen, scans(plain), 0.0))[seen]
    assert off.std() == pytest.approx(0.05 * 2**0.5, rel=0.05), "two of them have each their own"


def test_noise_is_new_at_each_moment_and_there_from_its_begin_to_its_end_only(drive: Drive) -> None:
    plain = drive()
    noisy = drive("[noise: {sensor: scan, stddev: 0.05, at: 0.45 s, duration: 0.3 s}]")
    seen = np.isfinite(scans(plain))
    off = np.where(seen, scans(noisy), 0.0) - np.where(seen, scans(plain), 0.0)
    is_off = [bool(np.abs(row).max() > 0.0) for row in off]
    assert is_off == [0.45 < time < 0.76 for time in np.arange(1, 16) / 10]
    both = seen[4] & seen[5]
    assert abs(np.corrcoef(off[4][both], off[5][both])[0, 1]) < 0.4
    report = noisy.reports["noise"]
    assert (report.outcome, report.at_s, report.end_s) == ("landed", 0.46, 0.76)


def test_a_bias_is_on_one_field_or_part_of_it(drive: Drive) -> None:
    plain, biased = drive(), drive("[bias: {sensor: imu, field: angular_velocity.z, by: 0.25}]")
    pairs = zip(plain.said["/imu"], biased.said["/imu"], strict=True)
    for (_, was), (_, now) in pairs:
        assert now.angular_velocity.z - was.angular_velocity.z == pytest.approx(0.25)
        assert now.angular_velocity.x == was.angular_velocity.x
        assert now.linear_acceleration == was.linear_acceleration
    whole = drive("[bias: {sensor: imu, field: linear_acceleration, by: 1}]")
    for (_, was), (_, now) in zip(plain.said["/imu"], whole.said["/imu"], strict=True):
        assert now.linear_acceleration.x - was.linear_acceleration.x == pytest.approx(1.0)
        assert now.linear_acceleration.z - was.linear_acceleration.z == pytest.approx(1.0)
        assert now.angular_velocity == was.angular_velocity


def test_a_bias_of_a_joint_is_one_of_odometry(drive: Drive) -> None:
    plain = drive()
    biased = drive("[bias: {sensor: joint_states, joint: wheel_left_joint, by: 2, at: 0.5 s}]")
    names = list(plain.said["/joint_states"][-1].message.name)
    off = biased.said["/joint_states"][-1].message.position - plain.said["/joint_states"][-1].message.position
    turned = dict(zip(names, off, strict=True))
    assert turned == pytest.approx({"wheel_left_joint": 2.0, "wheel_right_joint": 0.0})
    assert biased.pose == plain.pose, "the robot drives as it did"
    assert biased.odometry.yaw < plain.odometry.yaw - 0.2, "and believes to have turned right"


def test_a_share_of_readings_drops_out(drive: Drive) -> None:
    plain, some = drive(), drive("[dropout: {sensor: imu, share: 30 %}]")
    said = [told.time_ns for told in some.said["/imu"]]
    every = [told.time_ns for told in plain.said["/imu"]]
    assert set(said) < set(every)
    assert len(every) == 75
    assert 0.15 < 1.0 - len(said) / len(every) < 0.45
    assert some.reports["dropout"].effect == f"{len(every) - len(said)} of 75 readings of imu dropped"


def test_a_share_of_rays_drops_out_others_each_time(drive: Drive) -> None:
    gone = np.isnan(scans(drive("[dropout: {sensor: scan, share: 0.3, of: values}]")))
    assert gone.mean() == pytest.approx(0.3, abs=0.02)
    assert (gone[0] != gone[1]).mean() > 0.3


def test_a_frozen_sensor_repeats_what_it_said_before_with_new_stamps(drive: Drive) -> None:
    plain, frozen = drive(), drive("[freeze: {sensor: imu, at: 0.5 s, duration: 0.5 s}]")
    at = {told.time_ns: told.message for told in frozen.said["/imu"]}
    last = at[500_000_000]
    assert last == {told.time_ns: told.message for told in plain.said["/imu"]}[500_000_000]
    during = [told for told in frozen.said["/imu"] if 500_000_000 < told.time_ns <= 1_000_000_000]
    assert len(during) == 25
    assert all(told.message.angular_velocity == last.angular_velocity for told in during)
    assert all(told.age_ns == 0 for told in during)
    assert at[1_100_000_000].angular_velocity != last.angular_velocity


def test_frozen_and_missing_encoders_stop_odometry(drive: Drive) -> None:
    plain = drive()
    for fault in (
        "freeze: {sensor: joint_states, at: 0.7 s}",
        "dropout: {sensor: joint_states, share: 1, at: 0.7 s}",
    ):
        ended = drive(f"[{fault}]")
        assert ended.odometry.x < 0.7 * plain.odometry.x
        assert ended.pose == plain.pose


@pytest.mark.parametrize(("sensor", "late_ms"), [("scan", 80), ("imu", 30)])
def test_a_late_sensor_tells_of_its_time(drive: Drive, sensor: str, late_ms: int) -> None:
    listen = ((LaserScan if sensor == "scan" else Imu, f"/{sensor}"),)
    ended = drive(f"[delay: {{sensor: {sensor}, time: {late_ms} ms}}]", listen=listen)
    ages = {told.age_ns for told in ended.said[f"/{sensor}"]}
    assert min(ages) >= late_ms * 1_000_000
    assert max(ages) < (late_ms + 20) * 1_000_000, "at the next control period"
    report = ended.reports["delay"]
    assert report.outcome == "landed"
    assert " late" in report.effect
    assert ended.heard[f"/{sensor}"], "and it comes"


def test_late_encoders_are_those_of_so_long_ago(drive: Drive) -> None:
    plain, late = drive(), drive("[delay: {sensor: joint_states, time: 120 ms}]")
    then = {told.time_ns: told.message.position for told in plain.said["/joint_states"]}
    now = {told.time_ns: told.message.position for told in late.said["/joint_states"]}
    assert now[1_240_000_000] == pytest.approx(then[1_120_000_000], abs=1e-9), "the last one told 120 ms ago"


def test_what_freezes_to_what_it_would_say_anyway_has_no_effect(drive: Drive) -> None:
    ended = drive("[freeze: {sensor: scan}]", world__obstacles="[]")
    assert ended.reports["freeze"].outcome == "no_effect", "there is nothing to see in the first place"


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("noise: {sensor: skan, stddev: 1}", "no sensor 'skan'; did you mean 'scan'"),
        (
            "noise: {sensor: imu, stddev: 1, field: angular_speed}",
            "measures no 'angular_speed'; did you mean",
        ),
        (
            "noise: {sensor: imu, stddev: 1, joint: wheel_left_joint}",
            "only the sensor 'joint_states' has joints",
        ),
        ("bias: {sensor: joint_states, by: 1, joint: wheel}", "no joint 'wheel'"),
        ("dropout: {sensor: imu, share: 0.1, of: values}", "measures no array of values"),
        ("lidar: {sensor: imu, kind: stop}", "no lidar 'imu'; .*'?scan"),
    ],
)
def test_what_a_sensor_lacks_is_told(drive: Drive, fault: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        drive(f"[{fault}]")


def test_overlapping_faults_of_one_sensor_act_one_after_the_other(drive: Drive) -> None:
    plain = drive()
    both = drive("[{bias: {sensor: scan, by: 0.5}}, {dropout: {sensor: scan, share: 0.5, of: values}}]")
    one, two = scans(plain), scans(both)
    left = ~np.isnan(two)
    assert two[left] == pytest.approx(one[left] + 0.5, abs=1e-5)


def test_a_users_sensor_can_fail_without_a_word(drive: Drive, tmp_path: Any) -> None:
    (tmp_path / "pressure.py").write_text(PRESSURE, encoding="utf-8")
    (tmp_path / "balloon.urdf").write_text(BALLOON, encoding="utf-8")
    text = ROBOT.replace("FOLDER", str(tmp_path))
    plain = drive("", text)
    biased = drive("[bias: {sensor: air_pressure, field: fluid_pressure, by: 100}]", text)
    pairs = zip(plain.said["/air_pressure"], biased.said["/air_pressure"], strict=True)
    assert all(
        now.message.fluid_pressure - was.message.fluid_pressure == pytest.approx(100.0) for was, now in pairs
    )
    with pytest.raises(ScenarioError, match="several quantities; name one: fluid_pressure, variance"):
        drive("[bias: {sensor: air_pressure, by: 100}]", text)


PRESSURE = """
from twin.bridge import types
from twin.sensors import Sensor, SensorSpec

FluidPressure = types.get("sensor_msgs/msg/FluidPressure")

class Barometer(Sensor):
    types = ("air_pressure",)
    topic, rate_hz = "air_pressure", 10.0
    message = FluidPressure

    @classmethod
    def read(cls, element, common, report):
        return SensorSpec(**common)

    def sample(self, time_ns):
        return 101325.0

    @classmethod
    def to_message(cls, spec, header, reading):
        return FluidPressure(header=header, fluid_pressure=reading, variance=0.0)
"""
BALLOON = """
<robot name="balloon"><link name="base_link">
<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
<collision><geometry><sphere radius="0.2"/></geometry></collision></link>
<gazebo reference="base_link"><sensor name="barometer" type="air_pressure">
<update_rate>20</update_rate></sensor></gazebo>
</robot>
"""
ROBOT = """
name: balloon
duration: 0.5 s
robots: [{model: FOLDER/balloon.urdf}]
sensors: [FOLDER/pressure.py:Barometer]
checks: [final_pose: {x: 0, y: 0}]
"""
