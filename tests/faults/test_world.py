"""What is in the way, or elsewhere than all believe."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.faults.conftest import ROUND, Drive
from twin.errors import ScenarioError

AHEAD = ROUND.replace("angular: 0.5", "angular: 0")


def ahead(drive: Drive, faults: str, text: str = AHEAD) -> list[float]:
    """Return what the lidar measures straight ahead, scan by scan [m]."""
    return [float(told.message.ranges[180]) for told in drive(faults, text).said["/scan"]]


def test_a_pallet_is_seen_from_its_begin_to_its_end(drive: Drive) -> None:
    plain = np.array(ahead(drive, ""))
    seen = np.array(ahead(drive, "[pallet: {ahead: 1.5 m, at: 0.5 s, duration: 0.5 s}]"))
    there = (np.arange(1, 16) > 5) & (np.arange(1, 16) <= 10)
    assert seen[~there] == pytest.approx(plain[~there])
    assert (seen[there] < plain[there] - 0.5).all()
    placed = np.array(ahead(drive, "[pallet: {pose: {x: 2}, size: [0.4, 1, 1]}]"))
    assert placed[1:] == pytest.approx(plain[1:] - 1.15, abs=0.05)


def test_a_person_walks_and_gives_way(drive: Drive) -> None:
    walks = drive("[person: {pose: {x: 2.2, y: -1.5}, route: [[2.2, 1.5]], speed: 1 m/s, at: 0.2 s}]", AHEAD)
    at = walks.run.world.pose("person").xyz
    assert at[:2] == pytest.approx((2.2, -1.5 + 1.3), abs=0.03)
    near = drive("[person: {pose: {x: 1.2, y: -1.2}, route: [[1.2, 1.5]], speed: 1 m/s}]", AHEAD)
    assert near.run.world.pose("person").xyz[1] < -0.5, "they stop for the robot"
    assert walks.reports["person"].outcome == "landed"
    stands = drive("[person: {pose: {x: 1.5, y: 0}, at: 0.2 s, duration: 0.4 s}]", AHEAD)
    assert stands.run.world.pose("person").xyz[2] < -10.0, "gone"
    assert stands.log == ["person in the way", "person is gone"]


def test_who_is_far_away_is_in_nobodys_way(drive: Drive) -> None:
    report = drive("[person: {pose: {x: -6, y: 1}}]", AHEAD).reports["person"]
    assert report.outcome == "no_effect"
    assert report.effect.endswith("m from the nearest robot's base")


def test_two_of_a_kind_and_one_that_is_touched(drive: Drive) -> None:
    faults = "[{pallet: {pose: {x: 0.6}, size: [0.2, 1, 1]}}, {pallet: {pose: {x: -3}}}]"
    ended = drive(faults, AHEAD)
    assert [report.outcome for report in ended.reports.values()] == ["landed", "no_effect"]
    collisions = ended.run.checks[0].result()
    assert "pallet" in collisions.reason


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("pallet: ", "either a pose, or how far ahead"),
        ("pallet: {pose: {x: 1}, ahead: 1}", "either a pose, or how far ahead"),
        ("person: {ahead: 1, route: [[1, 1]]}", "starts at a pose"),
        ("displacement: {name: rack_b, by: {x: 1}}", "displacement needs an arena"),
    ],
)
def test_what_does_not_fit_is_told(drive: Drive, fault: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        drive(f"[{fault}]")


def test_a_kidnapped_robot_is_elsewhere_and_believes_nothing_of_it(drive: Drive) -> None:
    plain, carried = (
        drive("", AHEAD),
        drive("[kidnapping: {at: 0.5 s, to: {x: -2, y: 1, yaw: 90 deg}}]", AHEAD),
    )
    assert carried.pose.x == pytest.approx(-2.0, abs=0.02)
    assert carried.pose.y > 1.1
    assert carried.odometry.x == pytest.approx(plain.odometry.x, abs=0.05)
    report = carried.reports["kidnapping"]
    assert report.outcome == "landed"
    assert report.effect.startswith("carried ")
    assert math.isclose(float(report.effect.split("turned ")[1].split()[0]), 90.0, abs_tol=0.2)
