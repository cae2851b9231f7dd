"""The formula, the distance to cylinders, totals and the picture."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import pytest

from tests.benchmarks.barn.conftest import rules_of, world
from twin.geometry import Pose2
from twin_benchmarks.barn.clearance import clearance
from twin_benchmarks.barn.picture import svg
from twin_benchmarks.barn.referee import Outcome, Trial, score
from twin_benchmarks.barn.report import BarnReport
from twin_benchmarks.barn.scenarios import BarnOptions

CORNERS = Pose2(0.0, 0.0, 0.0).apply([(0.2, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.2, -0.1)])


def trial(number: int, outcome: Outcome = "success", time_s: float = 8.0) -> Trial:
    return Trial(
        world=number,
        seed=1,
        outcome=outcome,
        reason="" if outcome == "success" else "why",
        score=score(outcome, time_s, 5.0),
        time_s=time_s,
        optimal_time=5.0,
        length=9.0,
        min_clearance=0.1 * number,
        max_speed=1.0,
        drift=0.0,
        recoveries=0,
        real_time_factor=10.0,
        trajectory=((-2.25, 3.0), (-2.25, 12.0)),
    )


@pytest.mark.parametrize(
    ("time_s", "expected"),
    [(1.0, 0.5), (10.0, 0.5), (20.0, 0.25), (40.0, 0.125), (90.0, 0.125)],
)
def test_score_is_that_of_2024_and_later(time_s: float, expected: float) -> None:
    assert score("success", time_s, 5.0) == expected
    assert score("collision", time_s, 5.0) == score("timeout", time_s, 5.0) == 0.0


@pytest.mark.parametrize(
    ("pose", "centre", "expected"),
    [
        (Pose2(0.0, 0.0, 0.0), (1.0, 0.0), 0.7),
        (Pose2(0.0, 0.0, math.pi / 2), (1.0, 0.0), 0.8),
        (Pose2(0.0, 0.0, 0.0), (0.5, 0.5), 0.4),
        (Pose2(3.0, 4.0, math.pi), (2.5, 3.5), 0.4),
        (Pose2(0.0, 0.0, 0.0), (0.15, 0.0), -0.15),
    ],
)
def test_clearance_is_from_the_rectangles_edge_to_the_disc(
    pose: Pose2, centre: tuple[float, float], expected: float
) -> None:
    far = (50.0, 50.0)
    points = Pose2(0.0, 0.0, 0.0).apply([far, centre])
    found = clearance(pose, CORNERS, points, 0.1)
    assert found == pytest.approx(expected if centre != (0.5, 0.5) else math.hypot(0.3, 0.4) - 0.1)


def test_one_collision_fails_whatever_the_score() -> None:
    good = [trial(number) for number in range(1, 20)]
    assert BarnReport(good, BarnOptions()).passed
    assert not BarnReport([*good, trial(20, "collision")], BarnOptions()).passed
    assert BarnReport([*good, trial(20, "timeout")], BarnOptions()).passed
    assert not BarnReport([], BarnOptions()).passed


def test_totals() -> None:
    told = BarnReport([trial(1), trial(2, time_s=20.0), trial(3, "collision")], BarnOptions()).to_dict()
    assert told["score"] == pytest.approx(0.25)
    assert (told["successes"], told["collisions"], told["timeouts"]) == (2, 1, 0)
    assert told["mean_time_s"] == 14.0
    assert told["min_clearance_m"] == pytest.approx(0.1)
    assert told["passed"] is False


def test_the_picture_has_a_tile_for_each_world_and_a_line_for_each_run() -> None:
    rules = rules_of(world(4, (-1.0, 6.0)), world(7, (-2.0, 6.0)))
    picture = svg(rules, [trial(4), trial(7), trial(7, "collision")])
    root = ElementTree.fromstring(picture)
    texts = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert texts == ["4: 0.500", "7: 0.250 collision"]
    assert len(list(root.iter("{http://www.w3.org/2000/svg}polyline"))) == 3
