"""Each check passes and fails on hand-made observations, with the right value, time and reason."""

from __future__ import annotations

import math
from typing import Any

import pytest

from twin.errors import ScenarioError
from twin.geometry import Pose2, Pose3
from twin.scenario.checks import CheckEntry, CheckResult
from twin.scenario.observation import (
    CheckContext,
    ContactObservation,
    Held,
    Observation,
    RobotObservation,
    Zone,
)

CONTEXT = CheckContext(
    robots=("bot",),
    zones={"unloading": Zone(centre=Pose2(5.0, 2.0, math.pi / 2), size=(1.0, 0.4), height=0.4)},
    good_bottoms={"tote_a": 0.1},
)


def fold(entry: dict[str, Any], observations: list[Observation]) -> CheckResult:
    check = CheckEntry.model_validate(entry).build(CONTEXT)
    for observation in observations:
        check.observe(observation)
    return check.result()


def at(seconds: float, **fields: Any) -> Observation:
    return Observation(time_ns=round(seconds * 1e9), **fields)


def bot(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, **fields: Any) -> dict[str, RobotObservation]:
    return {"bot": RobotObservation(pose=Pose3.from_pose2(Pose2(x, y, yaw)), **fields)}


def tote(x: float = 5.0, y: float = 2.0, z: float = 0.5, roll: float = 0.0) -> dict[str, Pose3]:
    return {"tote_a": Pose3.from_xyz_rpy((x, y, z), (roll, 0.0, 0.0))}


def held(x: float = 0.0) -> dict[str, Held]:
    return {"tote_a": Held(robot="bot", T_gripper_good=Pose3.from_xyz_rpy((x, 0.0, 0.0)))}


def test_mission_succeeded() -> None:
    entry = {"mission_succeeded": None}
    done = at(2, mission_done=True, mission_succeeded=True)
    result = fold(entry, [at(1), done, at(3, mission_done=True, mission_succeeded=True)])
    assert (result.passed, result.at_s, result.reason) == (True, 2.0, "")
    result = fold(entry, [at(1, mission_state="driving")])
    assert (result.passed, result.reason) == (
        False,
        "the mission was not done when the run ended, in state 'driving'",
    )
    lost = at(2, mission_done=True, mission_succeeded=False, mission_reason="no path to rack_a")
    assert fold(entry, [lost]).reason == "no path to rack_a"


def test_mission_failed_for_the_reason_that_was_expected() -> None:
    entry = {"mission_failed": {"reason": "*no scan*"}}
    why = {"mission_reason": "navigate: no scan for 5 s"}
    failed = at(2, mission_done=True, mission_succeeded=False, **why)
    assert fold(entry, [at(1), failed]).passed
    assert fold({"mission_failed": None}, [failed]).passed
    other = at(2, mission_done=True, mission_succeeded=False, mission_reason="no path")
    assert fold(entry, [other]).reason == "the mission failed, but not for '*no scan*': no path"
    assert fold(entry, [at(2, mission_done=True, mission_succeeded=True)]).reason == "the mission succeeded"
    assert not fold(entry, [at(1, mission_state="driving")]).passed


def test_time_limit() -> None:
    entry = {"time_limit": {"limit": "10 s"}}
    assert fold(entry, [at(9), at(10, mission_done=True), at(11, mission_done=True)]).value == 10.0
    late = fold(entry, [at(9), at(10.5, mission_done=True)])
    assert (late.passed, late.reason) == (False, "the mission took 10.5 s")
    assert fold(entry, [at(9)]).reason == "the mission was not done after 9.0 s"


def test_a_time_limit_is_decided_when_it_passes() -> None:
    check = CheckEntry.model_validate({"time_limit": {"limit": "10 s"}}).build(CONTEXT)
    seen = []
    for observation in (at(9), at(10), at(10.5), at(12, mission_done=True)):
        check.observe(observation)
        seen.append(check.decided)
    result = check.result()
    assert seen == [None, None, False, False]
    assert (result.passed, result.value, result.at_s) == (False, 12.0, 10.5)


DELIVERED = {"delivered": {"tote": "tote_a", "zone": "unloading"}}


def test_delivered_counts_from_when_it_came_to_rest() -> None:
    run = [at(1, goods=tote(), held=held()), at(2, goods=tote()), at(3, goods=tote())]
    result = fold(DELIVERED, run)
    assert (result.name, result.passed, result.value, result.at_s) == ("delivered(tote_a)", True, 0.0, 2.0)


@pytest.mark.parametrize(
    ("goods", "reason"),
    [
        (tote(x=5.3), "tote_a is 0.100 m outside of unloading"),  # the zone is turned by 90 degrees
        (tote(y=2.8), "tote_a is 0.300 m outside of unloading"),
        (tote(z=0.1), "tote_a is 0.400 m below the surface of unloading"),
        (tote(z=0.6), "tote_a is 0.100 m above the surface of unloading"),
        (tote(roll=math.radians(6.0)), "tote_a is tilted by 6.0 deg (limit 5.0 deg)"),
        (tote(roll=math.pi), "tote_a is tilted by 180.0 deg (limit 5.0 deg)"),
        ({}, "tote_a was never seen"),
    ],
)
def test_not_delivered(goods: dict[str, Pose3], reason: str) -> None:
    result = fold(DELIVERED, [at(1, goods=goods), at(2, goods=goods)])
    assert (result.passed, result.reason) == (False, reason)


def test_not_delivered_while_held_or_moving_or_taken_away_again() -> None:
    assert fold(DELIVERED, [at(1, goods=tote(), held=held())]).reason == "tote_a is still held by bot"
    moving = [at(1, goods=tote(x=5.0)), at(1.02, goods=tote(x=5.001))]
    assert fold(DELIVERED, moving).reason == "tote_a still moves at 0.050 m/s"
    assert not fold(DELIVERED, [at(1, goods=tote()), at(9, goods=tote(x=0.0))]).passed


def test_delivered_names_what_the_arena_has() -> None:
    with pytest.raises(ScenarioError, match=r"zone 'loading'.*did you mean 'unloading'\? Valid: unloading"):
        fold({"delivered": {"tote": "tote_a", "zone": "loading"}}, [])
    with pytest.raises(ScenarioError, match=r"tote 'tote_b'.*did you mean 'tote_a'\?"):
        fold({"delivered": {"tote": "tote_b", "zone": "unloading"}}, [])


def touch(other: str, force: float, body: str = "base_link") -> ContactObservation:
    return ContactObservation(robot="bot", body=body, other=other, force_N=force)


def test_no_collision() -> None:
    entry = {"no_collision": {"max_force": "5 N", "allowed": [{"other": "tote_*", "body": "*finger"}]}}
    gentle = [
        at(1, contacts=[touch("wall", 4.0), touch("tote_a", 90.0, "left_finger")]),
        at(2, moved={"bot"}),
    ]
    result = fold(entry, gentle)
    assert (result.passed, result.value, result.limit, result.at_s) == (True, 4.0, 5.0, 2.0)
    hard = [at(1, contacts=[touch("tote_a", 6.0)]), at(2, contacts=[touch("rack_a", 80.0)]), at(3)]
    result = fold(entry, hard)
    assert (result.passed, result.value, result.at_s) == (False, 80.0, 1.0)
    assert result.reason == (
        "bot/base_link hit tote_a with 6.0 N at 1.00 s; "
        "hardest: bot/base_link hit rack_a with 80.0 N at 2.00 s"
    )
    assert not fold({"no_collision": None}, [at(1, contacts=[touch("wall", 1e-6)])]).passed
    both = [touch("tote_a", 90.0, "left_finger"), touch("wall", 4.0), touch("rack_a", 7.0)]
    assert fold(entry, [at(1, contacts=both)]).reason.startswith("bot/base_link hit rack_a with 7.0 N")
    just = [at(1, contacts=[touch("wall", 5.0)]), at(2, moved={"bot"})]
    assert fold(entry, just).passed, "up to max_force"
    assert not fold(entry, [at(1, contacts=[touch("wall", 5.001)]), *just]).passed
    assert fold({"no_collision": {"robot": "other"}}, [*hard, at(4, moved={"walker"})]).passed


def test_no_collision_counts_what_robots_carry() -> None:
    contact = ContactObservation(robot="bot", body="tote_a", other="machine", force_N=139.0, carried=True)
    result = fold({"no_collision": {"allowed": [{"other": "tote_a"}]}}, [at(1, contacts=[contact])])
    assert result.reason == "tote_a, carried by bot, hit machine with 139.0 N at 1.00 s"
    allowed = {"no_collision": {"allowed": [{"other": "machine", "body": "tote_*"}]}}
    assert fold(allowed, [at(1, contacts=[contact], moved={"bot"})]).passed


def test_a_collision_of_two_robots_is_that_of_either() -> None:
    def check(config: dict[str, Any]) -> CheckResult:
        fold = CheckEntry.model_validate({"no_collision": config}).build(CheckContext(robots=("bot", "cart")))
        fold.observe(at(1, contacts=[touch("cart/mast", 7.0)], moved={"bot"}))
        return fold.result()

    assert check({"robot": "bot"}).reason == "bot/base_link hit cart/mast with 7.0 N at 1.00 s"
    assert check({"robot": "cart"}).reason == "cart/mast hit bot/base_link with 7.0 N at 1.00 s"
    assert check({"robot": "cart", "allowed": [{"other": "bot/*", "body": "mast"}]}).passed
    assert check({"allowed": [{"other": "bot/*", "body": "mast"}]}).passed
    assert not check({"allowed": [{"other": "bot/*", "body": "base_link"}]}).passed


def test_tote_slip() -> None:
    entry = {"tote_slip": {"max": "5 mm"}}
    result = fold(entry, [at(0), at(1.8, held=held(0.1)), at(2, held=held(0.104)), at(3)])
    assert (result.passed, result.value, result.at_s) == (True, pytest.approx(0.004), 2.0)
    result = fold(entry, [at(1.8, held=held(0.1)), at(2, held=held(0.094)), at(2.2, held=held(0.1))])
    assert (result.passed, result.at_s) == (False, 2.0)
    assert result.reason == "tote_a slipped 6.0 mm in bot's gripper"
    assert fold(entry, [at(1)]).reason == "no tote was carried"


def test_tote_slip_survives_a_lost_contact_but_not_a_new_grasp() -> None:
    entry = {"tote_slip": {"max": "5 mm"}}
    flicker = [at(1, held=held(0.1)), at(1.02), at(1.04, held=held(0.12))]
    assert not fold(entry, flicker).passed
    again = [at(1, held=held(0.1)), at(1.1, held=held(0.1)), at(5), at(9, held=held(0.12))]
    assert fold(entry, again).passed
    assert fold(entry, [*again, at(9.1, held=held(0.13))]).value == pytest.approx(0.01)
    assert fold(entry, [at(1, held=held(0.1))]).reason == "no tote was carried", "one look compares nothing"


def test_localisation_error() -> None:
    run = [at(t, robots=bot(x=t, estimate=Pose2(t + 0.03, 0.04, 0.0))) for t in (1.0, 2.0)]
    result = fold({"localisation_error": {"rms": "5.1 cm"}}, run)
    assert (result.passed, result.value) == (True, pytest.approx(0.05))
    assert not fold({"localisation_error": {"rms": "4.9 cm"}}, run).passed
    spike = [
        *run,
        at(3, robots=bot(estimate=Pose2(0.3, 0.0, 0.0))),
        at(4, robots=bot(estimate=Pose2(0, 0, 0))),
    ]
    result = fold({"localisation_error": {"rms": 1.0, "max": "20 cm"}}, spike)
    assert (result.passed, result.value, result.limit, result.at_s) == (False, pytest.approx(0.3), 0.2, 3.0)
    assert fold({"localisation_error": {"max": "20 cm", "after": 4}}, spike).passed
    silent = fold({"localisation_error": {"rms": 1.0}}, [at(1, robots=bot())])
    assert (silent.passed, silent.value, silent.reason) == (
        False,
        None,
        "bot published no estimate of its pose",
    )


def test_odometry_drift_is_seen_from_the_start() -> None:
    start = at(0, robots=bot(3.0, 4.0, math.pi / 2, odometry=Pose2(0, 0, 0)))
    end = at(1, robots=bot(3.0, 5.0, math.pi / 2, odometry=Pose2(1.1, 0, 0)))
    result = fold({"odometry_drift": {"max": 0.2}}, [start, end])
    assert (result.passed, result.value) == (True, pytest.approx(0.1))
    assert fold({"odometry_drift": {"max": 0.05}}, [start, end]).reason == (
        "odometry ends 0.100 m from the true position"
    )
    assert fold({"odometry_drift": {"max": 1}}, [at(0, robots=bot())]).reason == "bot published no odometry"


def test_recoveries() -> None:
    def run(*counts: int) -> list[Observation]:
        still = Pose3.from_xyz_rpy()
        robots = [RobotObservation(pose=still, recoveries=count, goals=1) for count in counts]
        return [
            Observation(time_ns=i * 10**9, robots={"bot": robot}) for i, robot in enumerate(robots, start=1)
        ]

    forced = {"recoveries": {"min": 1, "max": 2}}
    assert fold(forced, run(0, 1, 1)).passed
    assert fold(forced, run(0, 1, 1)).at_s == 2.0, "when it last recovered"
    assert fold(forced, run(0, 0)).reason == "bot recovered 0 times"
    assert fold(forced, run(0, 3)).limit == 2.0
    km = [
        at(t, robots=bot(x, 0.0, recoveries=int(x > 0), goals=1)) for t, x in enumerate((0.0, 900.0, 1100.0))
    ]
    assert not fold({"recoveries": {"max_per_km": 1}}, km[:2]).passed
    assert fold({"recoveries": {"max_per_km": 1}}, km).passed
    exactly = [at(t, robots=bot(x, 0.0, recoveries=t, goals=1)) for t, x in enumerate((0.0, 1000.0))]
    assert fold({"recoveries": {"max_per_km": 1}}, exactly).passed


def test_driven_distance() -> None:
    run = [at(t, robots=bot(x, 0.0)) for t, x in enumerate((0.0, 1.0, 0.0))]
    assert fold({"driven_distance": {"min": 1.9, "max": 2.1}}, run).value == 2.0
    short = fold({"driven_distance": {"min": 3, "max": 4}}, run)
    assert (short.passed, short.limit, short.reason) == (False, 3.0, "bot drove 2.00 m, less than allowed")
    assert fold({"driven_distance": {"max": 1}}, run).reason == "bot drove 2.00 m, more than allowed"


@pytest.mark.parametrize(
    ("entry", "robots", "what"),
    [
        ({"no_collision": None}, bot(), "nothing moved"),
        ({"energy": {"max": 1}}, bot(), "bot did not move"),
        ({"driven_distance": {"max": 1}}, bot(), "bot did not move"),
        ({"odometry_drift": {"max": 1}}, bot(odometry=Pose2(0, 0, 0)), "bot did not move"),
        ({"path_on_circle": {"radius": 1, "tolerance": 0.1}}, bot(1.0), "bot did not move"),
        ({"recoveries": {"max": 1}}, bot(), "bot had no goal to drive to"),
        (
            {"localisation_error": {"rms": 1, "after": 9}},
            bot(estimate=Pose2(0, 0, 0)),
            "the run ended before 9 s",
        ),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_what_holds_because_nothing_happened_fails(
    entry: dict[str, Any], robots: dict[str, RobotObservation], what: str
) -> None:
    result = fold(entry, [at(t, robots=robots) for t in (0, 1, 2)])
    assert (result.passed, result.reason) == (False, f"nothing to look at: {what}")


def test_a_robot_may_be_asked_to_stand_still() -> None:
    run = [at(t, robots=bot()) for t in (0, 1)]
    assert fold({"driven_distance": {"min": 0, "max": "1 cm"}}, run).passed
    assert fold({"driven_distance": {"max": "1 cm"}}, [*run, at(2, robots=bot(yaw=0.1))]).passed, "it turned"
    assert fold({"final_pose": {"x": 0, "y": 0}}, run).passed
    assert fold({"no_collision": None}, [at(1, robots=bot(), moved={"walker"})]).passed


def test_an_estimate_that_is_no_number_is_wrong() -> None:
    lost = [at(1, robots=bot(estimate=Pose2(math.nan, 0.0, 0.0)))]
    assert not fold({"localisation_error": {"max": 1}}, lost).passed


def test_energy() -> None:
    run = [at(t, robots=bot(work_J=w), moved={"bot"}) for t, w in enumerate((0.0, 10.0, 10.0, 30.0))]
    assert fold({"energy": {"max": 30}}, run).value == 30.0
    result = fold({"energy": {"max": 29}}, run)
    assert (result.passed, result.at_s, result.reason) == (False, 3.0, "bot used 30 J")
    assert not fold({"energy": {"max": 30}}, [at(1, robots=bot(), moved={"walker"})]).passed, "another moved"


def test_final_pose() -> None:
    entry = {"final_pose": {"x": 1, "y": 0, "yaw": "180 deg", "tolerance": 0.1, "yaw_tolerance": "5 deg"}}
    assert fold(entry, [at(0, robots=bot()), at(1, robots=bot(1.05, 0, math.radians(-178)))]).passed
    assert fold(entry, [at(1, robots=bot(1.2, yaw=math.pi))]).reason == "bot ends 0.200 m from the goal"
    assert (
        fold(entry, [at(1, robots=bot(1.0, yaw=3.0))]).reason == "bot ends turned by 8.1 deg (limit 5.0 deg)"
    )
    assert fold({"final_pose": {"x": 1, "y": 0}}, [at(1, robots=bot(1.0, yaw=2.0))]).passed


def test_path_on_circle() -> None:
    entry = {"path_on_circle": {"centre": (1.0, 0.0), "radius": 2.0, "tolerance": "1 cm"}}
    run = [at(0, robots=bot(3, 0)), at(1, robots=bot(1, 2.005)), at(2, robots=bot(-1, 0))]
    result = fold(entry, run)
    assert (result.passed, result.value, result.worst_s) == (True, pytest.approx(0.005), 1.0)
    assert fold(entry, [*run, at(3, robots=bot(1, 0))]).reason == "bot was 2.000 m off the circle"


def test_closed_loop() -> None:
    entry = {"closed_loop": {"tolerance": 0.1, "yaw_tolerance": "5 deg"}}
    there, back = at(1, robots=bot(2, 0)), at(2, robots=bot(0.05, 0))
    start = at(0, robots=bot())
    assert fold(entry, [start, there, back]).passed
    assert fold(entry, [start, there]).reason == "bot ends 2.000 m from its start"
    assert fold(entry, [start, back]).reason == "bot never left its start"
    assert "turned by" in fold(entry, [start, there, at(2, robots=bot(0, 0, 1))]).reason


@pytest.mark.parametrize(
    "entry",
    [
        {"mission_succeeded": None},
        {"mission_failed": None},
        {"time_limit": {"limit": 1}},
        DELIVERED,
        {"no_collision": None},
        {"tote_slip": {"max": 1}},
        {"localisation_error": {"rms": 1}},
        {"odometry_drift": {"max": 1}},
        {"driven_distance": {"min": 1}},
        {"recoveries": {"max": 1}},
        {"map_accuracy": {"mean": 1}},
        {"map_coverage": {"floor": 0.5}},
        {"energy": {"max": 1}},
        {"final_pose": {"x": 0, "y": 0}},
        {"path_on_circle": {"radius": 1, "tolerance": 1}},
        {"closed_loop": {"tolerance": 1}},
        {"always": "speed < 1"},
        {"never": "speed > 1"},
        {"eventually": "speed < 1"},
        {"until": {"first": "speed < 1", "then": "mission_done"}},
        {"within": {"time": 1, "of": "speed < 1", "then": "mission_done"}},
        {"reaches": {"x": 0, "y": 0}},
        {"formula": "speed < 1"},
        {"finally": "speed < 1"},
    ],
    ids=lambda entry: next(iter(entry)),
)
def test_no_check_passes_without_observations(entry: dict[str, Any]) -> None:
    result = fold(entry, [])
    assert not result.passed
    assert result.reason
    assert result.at_s is None


def test_every_check_of_the_schema_is_tested_here() -> None:
    mark = test_no_check_passes_without_observations.pytestmark[0]  # type: ignore[attr-defined]
    assert {next(iter(entry)) for entry in mark.args[1]} == set(CheckEntry.model_fields)
