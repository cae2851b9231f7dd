"""What faults wait for."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.faults.conftest import ROUND, Drive
from twin.errors import ScenarioError

AHEAD = ROUND.replace("angular: 0.5", "angular: 0")


def begun(drive: Drive, when: str, more: str = "") -> tuple[float | None, float]:
    """Return when a fault begins, and how far the robot believed to be then."""
    ended = drive(f"[bias: {{sensor: imu, by: 1, when: {when}{more}}}]", AHEAD)
    report = ended.reports["bias"]
    assert (report.at_s is None) == (report.outcome == "not_reached")
    assert bool(ended.log) == (report.at_s is not None)
    xs = {told.time_ns / 1e9: told.message.pose.pose.position.x for told in ended.said["/odom"]}
    return report.at_s, xs.get(report.at_s or 0.0, 0.0)


def test_a_way_a_place_and_a_pause(drive: Drive) -> None:
    at_s, x = begun(drive, "{driven: 0.2 m}")
    assert x == pytest.approx(0.2, abs=0.01)
    assert begun(drive, "{near: {x: 0.3, y: 0, within: 10 cm}}")[0] == pytest.approx(at_s, abs=0.021)
    assert begun(drive, "{near: {x: 0.3, y: 0.2, within: 10 cm}}")[0] is None
    assert begun(drive, "{driven: 2 m}")[0] is None
    assert begun(drive, "{driven: 0.2 m}", ", after: 0.2 s")[0] == pytest.approx((at_s or 0.0) + 0.2)


def test_a_state_of_the_mission(drive: Drive) -> None:
    assert begun(drive, '{mission_state: "step 1*"}')[0] == 0.1
    assert begun(drive, "{mission_state: docking}")[0] is None


def test_another_fault_by_its_label_or_kind(drive: Drive) -> None:
    faults = (
        "[{loss: {share: 0.5, topic: /imu, label: first, at: 0.3 s}},"
        " {loss: {share: 0.5, topic: /scan, when: {fault: first}, after: 0.1 s}},"
        " {noise: {sensor: imu, stddev: 1, when: {fault: loss}, duration: 0.2 s}}]"
    )
    reports = drive(faults).reports
    assert [(report.at_s, report.end_s) for report in reports.values()] == [
        (0.3, None),
        (0.4, None),
        (0.3, 0.5),
    ]


ARENA = """
name: yard
hall: {x: [-5, 5], y: [-4, 4]}
zones:
  bay: {pose: [0.5, 0, 45 deg], size: [0.4, 0.4]}
"""


def test_a_zone_of_the_arena(drive: Drive, tmp_path: Path) -> None:
    (tmp_path / "yard.yaml").write_text(ARENA, encoding="utf-8")
    text = AHEAD.replace("world: {", "world: {arena: yard.yaml, ")
    ended = drive("[pallet: {ahead: 1 m, when: {zone: bay}}]", text)
    assert ended.reports["pallet"].outcome == "landed"
    assert ended.run.world.pose("pallet").xyz[0] == pytest.approx(1.5 - 0.2 * 2**0.5, abs=0.01), (
        "at its corner"
    )
    with pytest.raises(ScenarioError, match=r"faults.*no zone 'bai'; did you mean 'bay'"):
        drive("[bias: {sensor: imu, by: 1, when: {zone: bai}}]", text)
    with pytest.raises(ScenarioError, match="no zone 'bay'; the world has no zones"):
        drive("[bias: {sensor: imu, by: 1, when: {zone: bay}}]", AHEAD)


@pytest.mark.parametrize(
    ("faults", "message"),
    [
        (
            "[loss: {share: 1, at: 1, when: {driven: 1}}]",
            "either at a time or when something happens, not both",
        ),
        ("[loss: {share: 1, after: 1}]", "'after' needs a 'when'"),
        ("[loss: {share: 1, at: 2}]", "the run ends after 1.5 s, before 2 s"),
        ("[loss: {share: 1, when: {fault: noise}}]", "there is no other fault 'noise'; there is no other"),
        (
            "[{loss: {share: 1, when: {fault: delai}}}, {delay: {sensor: imu, time: 1}}]",
            "did you mean 'delay'",
        ),
        ("[{loss: {share: 1, label: a}}, {loss: {share: 0, label: a}}]", "another fault is called 'a'"),
        ("[loss: {share: 1, when: {driven: 1, zone: a}}]", "exactly one of the keys"),
        ("[los: 1]", "unknown key 'los' in faults.0; did you mean 'loss'"),
        ("[loss: {shar: 1}]", "unknown key 'shar'.*did you mean 'share'"),
        ("[loss: 120 %]", "must be at most 1"),
        ("[noise: 0.5]", "must be a mapping"),
        ("[wheel_radius: {factor: 0.9, robot: diffbot}]", "unknown robot 'diffbot'; did you mean 'diff_bot'"),
    ],
)
def test_what_does_not_fit_is_told(drive: Drive, faults: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        drive(faults)
