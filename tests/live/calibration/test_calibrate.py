"""Bags of robots that are otherwise than their models say."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.measures.calibration import START_NS, planted, record, room
from twin.bridge.bags.metadata import BagMessage
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.writer import BagWriter
from twin.bridge.cdr.codec import codec
from twin.errors import RecordingError, ScenarioError
from twin.geometry import Pose2, yaw_from_quat_wxyz
from twin.live.calibration.calibrate import Calibration, calibrate
from twin.live.calibration.estimates import Estimate
from twin.live.calibration.recorded import Recorded, read, topics_of
from twin.scenario.schema import load

SECONDS = 24.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("calibration")


@pytest.fixture(scope="module")
def drive(folder: Path) -> tuple[Path, Mapping[str, float]]:
    """A bag of a robot with another clock, and what is to be found in it."""
    perturb = "wheel_radius=0.97,track=1.02,latency=80ms,clock_offset=0.4s"
    truth = record(room(folder), folder / "drive", 11, SECONDS, perturb)
    return folder / "drive", planted(truth)


@pytest.fixture(scope="module")
def found(folder: Path, drive: tuple[Path, Any]) -> Calibration:
    return calibrate(room(folder), drive[0])


def named(found: Calibration) -> dict[str, Estimate]:
    return {each.name: each for each in found.estimates}


def test_what_was_planted_is_found(found: Calibration, drive: tuple[Path, Mapping[str, float]]) -> None:
    estimates, truth = named(found), drive[1]
    for name in ("wheel_radius", "wheel_radius_left", "wheel_radius_right", "track"):
        each = estimates[name]
        assert each.value == pytest.approx(truth[name], rel=3e-3)
        assert 2.0 * each.half_width < 6e-3 * each.value
    assert estimates["latency"].value == pytest.approx(0.08, abs=5e-3)
    # Twice the interval: of one bag one in twenty truths may be beside it.
    assert [
        n for n, value in truth.items() if abs(estimates[n].value - value) > 2.0 * estimates[n].half_width
    ] == []
    assert not estimates["friction"].observable


def test_what_is_held_out_is_predicted_at_least_five_times_as_well(found: Calibration) -> None:
    assert sum(found.seconds) == pytest.approx(SECONDS, abs=0.1)
    assert {
        row.name: row.before / row.after for row in found.divergences if row.before < 5.0 * row.after
    } == {}


def test_a_robot_that_never_turns_tells_nothing_of_its_track(folder: Path) -> None:
    scenario = room(folder)
    record(scenario, folder / "straight", 3, 16.0, "wheel_radius=0.97", moves=(True, False))
    found = calibrate(scenario, folder / "straight")
    estimates = named(found)
    assert estimates["wheel_radius"].factor == pytest.approx(0.97, abs=3e-3)
    assert {name for name, each in estimates.items() if "turned" in each.not_observable} >= {
        "track",
        "lidar_x",
        "lidar_y",
        "imu_scale",
    }
    assert [[*fault] for fault in found.patch] == [["wheel_radius"]]


def test_a_robot_that_only_stands_is_not_patched(folder: Path) -> None:
    scenario = room(folder)
    record(scenario, folder / "still", 3, 16.0, moves=(False, False))
    found = calibrate(scenario, folder / "still")
    estimates = named(found)
    assert [name for name in ("wheel_radius", "track", "latency") if estimates[name].observable] == []
    assert found.patch == ()


# -- bags that cannot be used --------------------------------------------------------------------------------


def altered(source: Path, target: Path, change: Callable[[str, Any, int], tuple[Any, int] | None]) -> Path:
    """Write a bag whose messages are what `change` makes of topic, message and time [ns]; None: left out."""
    with BagReader(source) as bag:
        writer = BagWriter(target)
        for topic, payload, time_ns, *_ in bag.messages():
            known: Any = codec(bag.topics[topic].type)
            changed = change(topic, known.decode(payload), time_ns)
            if changed is None:
                continue
            if topic not in writer.topics:
                writer.add_topic(bag.topics[topic])
            message, at = changed
            writer.write(BagMessage(topic, known.encode(message), at, at))
        writer.close()
    return target


def refusal(folder: Path, bag: Path) -> str:
    with pytest.raises(RecordingError) as told:
        calibrate(room(folder), bag)
    (problem,) = told.value.problems
    return problem.message.removeprefix(f"{bag}: ")


def without_odometry(topic: str, message: Any, time_ns: int) -> tuple[Any, int] | None:
    return None if topic == "/odom" else (message, time_ns)


def of_another_robot(topic: str, message: Any, time_ns: int) -> tuple[Any, int] | None:
    if topic == "/joint_states":
        message.name[:] = [name.replace("wheel_left", "front_left") for name in message.name]
    return message, time_ns


def with_few_rays(topic: str, message: Any, time_ns: int) -> tuple[Any, int] | None:
    if topic == "/scan":
        message.ranges = message.ranges[:180]
    return message, time_ns


def with_a_clock_that_jumps(topic: str, message: Any, time_ns: int) -> tuple[Any, int] | None:
    if hasattr(message, "header") and message.header.stamp.sec % 100 >= 12:
        message.header.stamp.sec -= 5
    return message, time_ns


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (without_odometry, "has no topic /odom"),
        (of_another_robot, "/joint_states has no joint wheel_left_joint, only "),
        (with_few_rays, "its scans have 180 rays"),
        (with_a_clock_that_jumps, "the robot's clock jumps by -5.000 s at "),
    ],
)
def test_a_bag_that_cannot_be_used_is_refused_in_a_sentence(
    folder: Path, drive: tuple[Path, Any], change: Callable[..., Any], says: str
) -> None:
    bag = altered(drive[0], folder / change.__name__, change)
    assert refusal(folder, bag).startswith(says)


def test_a_bag_that_is_too_short_is_refused(folder: Path) -> None:
    record(room(folder), folder / "short", 1, 5.0)
    assert refusal(folder, folder / "short") == "holds 4.9 s of the wheels; at least 15 s are needed"


def test_a_bag_of_another_room_is_refused(folder: Path, drive: tuple[Path, Any]) -> None:
    empty = load("diff_bot_figure8")
    with pytest.raises(RecordingError, match="first scan does not fit what 'diff_bot' sees"):
        calibrate(empty, drive[0])


def test_a_robot_that_had_driven_before_is_found_by_its_odometry_and_localisation(
    folder: Path, drive: tuple[Path, Any]
) -> None:
    before = Pose2(30.0, -10.0, 2.0)
    T_map_odom = before.inverse()

    def later(topic: str, message: Any, time_ns: int) -> tuple[Any, int] | None:
        if topic == "/odom":
            pose = message.pose.pose
            x, y, yaw = before @ Pose2(pose.position.x, pose.position.y, yaw_of(pose.orientation))
            pose.position.x, pose.position.y = x, y
            pose.orientation.z, pose.orientation.w = math.sin(yaw / 2.0), math.cos(yaw / 2.0)
        if topic == "/tf":
            found = message.transforms[0]
            found.header.frame_id, found.child_frame_id = "map", "odom"
            found.transform.translation.x, found.transform.translation.y = T_map_odom.x, T_map_odom.y
            found.transform.rotation.z = math.sin(T_map_odom.yaw / 2.0)
            found.transform.rotation.w = math.cos(T_map_odom.yaw / 2.0)
        return (message, time_ns) if time_ns < START_NS + 16_000_000_000 else None

    bag = altered(drive[0], folder / "later", later)
    elsewhere = load(folder / "room.yaml", {"robots.0.pose.yaw": "100 deg"})
    found = calibrate(elsewhere, bag)
    assert named(found)["track"].factor == pytest.approx(1.02, abs=5e-3)


def yaw_of(q: Any) -> float:
    return yaw_from_quat_wxyz((q.w, q.x, q.y, q.z))


def test_what_is_not_a_number_is_left_out_and_told(folder: Path, drive: tuple[Path, Any]) -> None:
    def some_nan(topic: str, message: Any, time_ns: int) -> tuple[Any, int] | None:
        if topic == "/joint_states" and time_ns % 1_000_000_000 == 0:
            message.position = np.full_like(message.position, np.nan)
        return message, time_ns

    recorded = wheels_of(altered(drive[0], folder / "nan", some_nan))
    (notice,) = recorded.notices
    assert notice.endswith(f"/joint_states: {SECONDS:.0f} of 599 messages hold what is not a number")
    assert np.isfinite(recorded.wheels.left).all()


def wheels_of(bag: Path) -> Recorded:
    return read(bag, topics_of("", "scan"), ["wheel_left_joint"], ["wheel_right_joint"])


def test_messages_that_come_twice_late_and_in_another_order_are_sorted_by_their_stamps(
    folder: Path, drive: tuple[Path, Any]
) -> None:
    rng = np.random.default_rng(1)
    with BagReader(drive[0]) as bag, BagWriter(folder / "late") as writer:
        rows = [(m.topic, m.data, m.log_ns + round(rng.exponential(20e6))) for m in bag.messages()]
        for topic in bag.topics.values():
            writer.add_topic(topic)
        for topic, data, at in sorted(rows + rows[::7], key=lambda row: row[2]):
            writer.write(BagMessage(topic, data, at, at))
    late, sound = wheels_of(folder / "late"), wheels_of(drive[0])
    assert late.wheels.left == pytest.approx(sound.wheels.left)
    assert np.diff(late.wheels.time) == pytest.approx(np.diff(sound.wheels.time), abs=1e-4)
    assert late.link.jitter == pytest.approx(0.06, abs=0.005)


@pytest.mark.parametrize(
    ("model", "says"),
    [("sp1s", "has no lidar"), ("r2d2", "has no")],
)
def test_robots_without_what_it_takes_are_refused(drive: tuple[Path, Any], model: str, says: str) -> None:
    name = {"sp1s": "sp1s_square", "r2d2": "r2d2_circle"}[model]
    with pytest.raises(ScenarioError, match=says):
        calibrate(load(name), drive[0])
    with pytest.raises(ScenarioError, match="has no robot 'x'"):
        calibrate(load(name), drive[0], "x")
