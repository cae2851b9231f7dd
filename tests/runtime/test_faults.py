"""Hardware that fails, a robot carried away, a wrong map: each ends well or says why."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import Odometry
from twin.errors import ScenarioError
from twin.runtime.run import Run
from twin.scenario.schema import Scenario, load

HALL = """
name: hall
hall: {x: [-5, 5], y: [-4, 4]}
partitions:
  corner: {start: [-5, 1.5], end: [-3.5, 1.5]}
pillars:
  pillar: {pose: [2.5, -3, 0]}
racks:
  rack: {pose: [0, 3.2, -90 deg], length: 3.0, depth: 0.6, levels: [0.4, 0.8]}
obstacles:
  machine: {pose: [0, -0.2, 0], size: [1.2, 1.2, 0.8]}
poses:
  start: [-3.8, -2, 0]
"""

ACROSS = """
name: faults
seed: 1
duration: 60 s
world: {arena: hall.yaml}
robots:
  - model: warehouse_bot
    start: start
    localisation: {type: amcl, initial_pose_error: {xy: 10 cm, yaw: 3 deg}}
    navigation: {collision_monitor: {}}
mission:
  type: behaviors
  robot: warehouse_bot
  steps:
    - wait: {duration: 1 s}
    - navigate_to_pose: {x: 3.5, y: 1.5, yaw: 90 deg}
checks: [no_collision: ]
"""
GOAL = (3.5, 1.5)

Drive = Callable[..., Run]


@pytest.fixture
def across(tmp_path: Path) -> Callable[..., Scenario]:
    """Return a function that loads the scenario with a fault, and perhaps other overrides."""
    (tmp_path / "hall.yaml").write_text(HALL, encoding="utf-8")
    (tmp_path / "across.yaml").write_text(ACROSS, encoding="utf-8")

    def make(fault: str, overrides: Mapping[str, str] | None = None) -> Scenario:
        return load(tmp_path / "across.yaml", {"faults": f"[{fault}]", **(overrides or {})})

    return make


@pytest.fixture
def drive(across: Callable[..., Scenario], make_run: Callable[..., Run]) -> Drive:
    """Return a function that drives to the end with a fault and makes sure that nothing was touched."""

    def go(fault: str, **overrides: str) -> Run:
        run = make_run(across(fault, overrides))
        while not run.over:
            run.tick()
        (collisions,) = run.checks
        assert collisions.result().passed, collisions.result().reason
        return run

    return go


def off_goal(run: Run) -> float:
    """Return how far the robot truly is from its goal [m]."""
    pose = run.world.pose("warehouse_bot/base_footprint")
    return math.hypot(pose.xyz[0] - GOAL[0], pose.xyz[1] - GOAL[1])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("stop", "no scan for"),
        ("freeze", "it stays the same while the robot moves"),
        ("nan", "every reading is NaN"),
        ("blind", "suddenly no ray returns"),
    ],
)
def test_without_a_lidar_the_robot_stands_and_the_action_says_why(
    drive: Drive, kind: str, reason: str
) -> None:
    run = drive(f"lidar: {{kind: {kind}, at: 5 s}}")
    assert run.parts.mission.succeeded is False
    assert "the local costmap is not current: " in run.parts.mission.reason
    assert reason in run.parts.mission.reason
    pose = run.world.pose("warehouse_bot/base_footprint").xyz
    assert math.hypot(pose[0] + 2.68, pose[1] + 0.62) < 1.7, "at 1 m/s from where it was at 5 s"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["stop", "blind"])
def test_a_lidar_that_comes_back_in_time_delays_the_robot_only(drive: Drive, kind: str) -> None:
    run = drive(f"lidar: {{kind: {kind}, at: 5 s, duration: 4 s}}")
    assert run.parts.mission.succeeded, run.parts.mission.reason
    assert off_goal(run) < 0.15


@pytest.mark.slow
@pytest.mark.parametrize(
    ("at", "to"),
    [
        ("8 s", "{x: -3.0, y: -1.5, yaw: 90 deg}"),
        ("6 s", "{x: 3.5, y: 0, yaw: 180 deg}"),
        ("12.5 s", "{x: -3.4, y: -0.3, yaw: 80 deg}"),
    ],
    ids=["on the way", "beyond a machine", "while it turns at the goal"],
)
def test_a_kidnapped_robot_finds_itself_and_drives_to_its_goal(drive: Drive, at: str, to: str) -> None:
    run = drive(f"kidnapping: {{to: {to}, at: {at}}}")
    assert run.parts.mission.succeeded, run.parts.mission.reason
    assert off_goal(run) < 0.15


JUMP = """
name: jump
seed: 1
duration: 2 s
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 1 s, linear: 0 m/s}]}
faults: [odometry_jump: {distance: 0.3 m, yaw: 40 deg, at: 0.5 s}]
checks: [mission_succeeded: ]
"""


def test_odometry_jumps_ahead_and_to_the_left_by_what_the_fault_says(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run]
) -> None:
    run = make_run(scenario(JUMP))
    got: list[Odometry] = []
    run.bus.create_node("listener").create_subscription(Odometry, "/odom", got.append)
    while not run.over:
        run.tick()
    before, after = (pose2_from_pose(message.pose.pose) for message in (got[0], got[-1]))
    jump = before.inverse() @ after
    half = math.radians(20.0)
    assert jump.yaw == pytest.approx(2.0 * half, abs=0.01)
    chord = 0.3 * math.sin(half) / half
    assert (jump.x, jump.y) == pytest.approx((chord * math.cos(half), chord * math.sin(half)), abs=0.005)
    assert run.world.pose("diff_bot/base_link").xyz[:2] == pytest.approx([0.0, 0.0], abs=0.01), (
        "nothing moved"
    )


@pytest.mark.slow
@pytest.mark.parametrize("odometry", ["wheels", "ekf"])
def test_odometry_that_jumps_does_not_lead_astray(drive: Drive, odometry: str) -> None:
    run = drive(
        "odometry_jump: {distance: 1 m, yaw: 40 deg, at: 8 s}",
        **{"robots.0.odometry": f"{{type: {odometry}}}"},
    )
    assert run.parts.mission.succeeded, run.parts.mission.reason
    assert off_goal(run) < 0.15


@pytest.mark.slow
def test_an_encoder_that_counts_the_wrong_way_ends_the_mission_with_that_reason(drive: Drive) -> None:
    run = drive("encoder: {joint: wheel_right_joint, factor: -1, at: 2 s}")
    assert run.parts.mission.succeeded is False
    assert "wheels and lidar contradict each other: in " in run.parts.mission.reason
    assert run.world.time_ns < 45e9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "by"),
    [("rack", "{x: 0.46, y: -0.2}"), ("machine", "{x: -0.35, y: 0.35}"), ("machine", "{y: 0.5}")],
)
def test_a_map_that_is_wrong_by_half_a_metre_is_no_danger(drive: Drive, name: str, by: str) -> None:
    run = drive(f"displacement: {{name: {name}, by: {by}}}")
    assert run.parts.mission.succeeded, run.parts.mission.reason
    assert off_goal(run) < 0.3, "as far as a map that is wrong allows"


def test_faults_act_on_the_hardware_and_are_told(
    across: Callable[..., Scenario], make_run: Callable[..., Run]
) -> None:
    faults = (
        "lidar: {kind: freeze, at: 0.3 s, duration: 0.4 s}}, {odometry_jump: {distance: 1, at: 0.5 s}},"
        " {kidnapping: {to: {x: 3}, at: 0.6 s}"
    )
    run = make_run(across("{" + faults + "}"))
    scans: dict[int, np.ndarray] = {}
    odometry: list[float] = []
    told: list[str] = []

    def on_sample(sample: object) -> None:
        topic, message = sample.topic, sample.message  # type: ignore[attr-defined]
        if topic == "/scan":
            scans[round(run.world.time_ns / 1e8)] = message.ranges
        elif topic == "/odom":
            odometry.append(message.pose.pose.position.x)
        elif topic == "/rosout" and message.name == "faults":
            told.append(message.msg)

    run.bus.tap(on_sample)
    while run.world.time_ns < 1e9:
        run.tick()
    assert all(np.array_equal(scans[i], scans[3]) for i in (4, 5, 6, 7)), "the last scan again and again"
    assert not np.array_equal(scans[8], scans[7])
    assert odometry[-1] == pytest.approx(1.0, abs=0.02), (
        "wheels were miscounted, and stood when it was carried"
    )
    assert run.world.pose("warehouse_bot/base_footprint").xyz[:2] == pytest.approx((3.0, 0.0), abs=0.02)
    assert [text.partition("warehouse_bot")[2] for text in told] == [
        ": freeze",
        " jumps",
        " is carried to (3, 0)",
        " works again",
    ]


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("lidar: {sensor: skan, kind: stop, at: 1}", "no lidar 'skan'; did you mean 'scan'"),
        (
            "encoder: {joint: wheel_rihgt_joint, factor: 0, at: 1}",
            "no encoder at joint 'wheel_rihgt_joint'; did you",
        ),
        ("displacement: {name: rak, by: {x: 1}}", "no part 'rak'; did you mean 'rack'"),
    ],
)
def test_what_is_not_there_cannot_fail(
    across: Callable[..., Scenario], make_run: Callable[..., Run], fault: str, message: str
) -> None:
    with pytest.raises(ScenarioError, match=message):
        make_run(across(fault))
