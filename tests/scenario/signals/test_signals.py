"""Each signal of the simulator's truth on hand-made observations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.scenario.checks.test_checks import at, bot
from twin.geometry import Pose2, Pose3
from twin.scenario.observation import (
    CheckContext,
    ContactObservation,
    Observation,
    RobotObservation,
    Zone,
)
from twin.scenario.signals import SIGNALS
from twin.scenario.signals.reference import Reference

CONTEXT = CheckContext(
    robots=("bot", "other"), zones={"dock": Zone(centre=Pose2(5.0, 0.0, 0.0), size=(2.0, 1.0))}
)


def values(text: str, run: list[Observation]) -> list[Any]:
    signal = Reference(text).make("bot", CONTEXT)
    return [signal.value(observation) for observation in run]


def drive(**fields: Any) -> list[Observation]:
    """Return a run at 1, then 3 m/s along x, with an observation every half second."""
    return [at(0.5 * i, robots=bot(x, 0.0, **fields)) for i, x in enumerate((0.0, 0.5, 1.0, 2.5, 4.0))]


TURN = [at(t, robots=bot(0.0, 0.0, yaw)) for t, yaw in enumerate((3.0, -3.0, -2.0))]
LEANING = {"bot": RobotObservation(pose=Pose3.from_xyz_rpy((0.0, 0.0, 0.2), (0.3, 0.0, 1.0)))}
HIT = ContactObservation(robot="other", body="base", other="bot/arm", force_N=7.0)
WRONG = bot(1.0, 0.0, 0.1, estimate=Pose2(1.3, 0.4, -0.1))
OBSERVED = {
    "x": (drive(), [0.0, 0.5, 1.0, 2.5, 4.0]),
    "y": (drive()[:2], [0.0, 0.0]),
    "z": ([at(0, robots=LEANING)], [0.2]),
    "yaw": (TURN, [3.0, -3.0, -2.0]),
    "tilt": ([at(0, robots=LEANING)], [0.3]),
    "speed": ([at(0, robots=bot(speed=0.7))], [0.7]),
    "turn_rate": (TURN, [None, 2 * math.pi - 6.0, 1.0]),
    "acceleration": (drive(), [None, None, 0.0, 4.0, 0.0]),
    "jerk": (drive(), [None, None, None, 8.0, 8.0]),
    "driven_distance": (drive(), [0.0, 0.5, 1.0, 2.5, 4.0]),
    "path_efficiency": ([*drive(), at(9, robots=bot(0.0, 3.0))], [None, 1.0, 1.0, 1.0, 1.0, 3.0 / 9.0]),
    "distance_to(100 cm, 1)": (drive()[:1], [math.sqrt(2.0)]),
    "distance_to_zone(dock)": (drive()[3:], [1.5, 0.0]),
    "distance_to_start": (drive()[2:], [0.0, 1.5, 3.0]),
    "distance_to_goal": ([*drive()[:1], *drive(goal=Pose2(0.0, 2.0, 0.0))[:1]], [None, 2.0]),
    "distance_to_circle(1, 0, 2 m)": (drive(), [1.0, 1.5, 2.0, 0.5, 1.0]),
    "turned_from(180 deg)": (TURN, [math.pi - 3.0, math.pi - 3.0, math.pi - 2.0]),
    "turned_from_start": (TURN, [0.0, 2 * math.pi - 6.0, 2 * math.pi - 5.0]),
    "clearance": (drive(clearance=0.25)[:1], [0.25]),
    "contact_force": ([at(0, robots=bot(), contacts=[HIT]), at(1, robots=bot())], [7.0, 0.0]),
    "slip": (drive(slip=0.1)[:1], [0.1]),
    "energy": (drive(work_J=3.0)[:1], [3.0]),
    "localisation_error": ([at(0, robots=bot()), at(1, robots=WRONG)], [None, 0.5]),
    "localisation_rms(1 s)": (
        [at(t, robots=bot(estimate=Pose2(e, 0.0, 0.0))) for t, e in enumerate((9.0, 1.0, 7.0))],
        [None, 1.0, 5.0],
    ),
    "heading_error": ([at(0, robots=WRONG)], [0.2]),
    "odometry_drift": (
        [at(t, robots=bot(t, 0.0, odometry=Pose2(7.0, t, math.pi / 2))) for t in (0.0, 2.0)]
        + [at(3, robots=bot(2.0, 0.0, odometry=Pose2(7.5, 2.0, math.pi / 2)))],
        [0.0, 0.0, 0.5],
    ),
    "goals": (drive(goals=2)[:1], [2.0]),
    "recoveries": (drive(recoveries=3)[:1], [3.0]),
    "time_in_recoveries": ([*drive(recovering=True)[:3], *drive()[3:]], [0.0, 0.5, 1.0, 1.5, 1.5]),
    "mission_state": ([at(0, mission_state="idle")], ["idle"]),
    "mission_done": ([at(0), at(1, mission_done=True)], [False, True]),
    "mission_succeeded": ([at(0), at(1, mission_done=True, mission_succeeded=True)], [False, True]),
}


@pytest.mark.parametrize("text", OBSERVED)
def test_what_a_signal_says(text: str) -> None:
    run, expected = OBSERVED[text]
    found = values(text, run)
    assert [value is None for value in found] == [value is None for value in expected]
    for value, wanted in zip(found, expected, strict=True):
        if isinstance(wanted, float):
            assert value == pytest.approx(wanted, abs=1e-9)
        else:
            assert value == wanted


def test_all_signals_are_tested_here_and_are_what_they_say() -> None:
    assert [text.partition("(")[0] for text in OBSERVED] == list(SIGNALS.shipped)
    for text, (run, _) in OBSERVED.items():
        signal = Reference(text).make("bot", CONTEXT)
        kinds = {type(value) for value in map(signal.value, run) if value is not None}
        assert kinds <= {signal.kind, np.float64}, text


def test_what_needs_to_be_asked_for_is_asked_for() -> None:
    needs = {text: Reference(text).make("bot", CONTEXT).needs for text in OBSERVED}
    assert {text: need for text, need in needs.items() if need} == {
        "clearance": "clearance",
        "slip": "slip",
        "energy": "work_J",
    }


def test_a_robot_that_is_named_goes_before_that_of_the_check() -> None:
    both = {"bot": bot(speed=1.0)["bot"], "other": bot(speed=2.0)["bot"]}
    assert values("other.speed", [at(0, robots=both)]) == [2.0]
