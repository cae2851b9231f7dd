"""Checks of the language in real runs: topics, truth that is computed on demand, early ends, recordings."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import mujoco
import pytest

from tests.runtime.test_workers import CROSSING, TRIO
from twin.recording.read_back import read
from twin.runtime.open_run import run
from twin.runtime.run import Run
from twin.scenario.schema import Scenario
from twin.sim.clearance import ClearanceMeter
from twin.sim.slip import SlipMeter

MakeScenario = Callable[[str], Scenario]
DRIVE = """
name: drive
duration: 3 s
early_stop: {early_stop}
robots: [{{model: diff_bot}}]
world:
  obstacles:
    - {{name: wall, size: [0.1, 2, 0.5], pose: {{x: 1.2 m, y: 0.3, yaw: 20 deg}}}}
    - {{name: post, size: [0.1, 0.1, 0.5], pose: {{x: 0.5, y: -0.6}}}}
    - {{name: box, size: [0.2, 0.2, 0.2], pose: {{x: -0.6, y: 0.2}}, mass: 2 kg}}
mission:
  type: velocity_profile
  robot: diff_bot
  steps: [{{duration: 5 s, linear: 0.2 m/s}}]
checks:
  - driven_distance: {{min: 0.1 m}}
{checks}
"""


def drive(scenario: MakeScenario, *checks: str, early_stop: str = "never") -> Scenario:
    lines = "\n".join(f"  - {check}" for check in checks)
    return scenario(DRIVE.format(checks=lines, early_stop=early_stop))


def test_topics_are_seen_as_they_are_published_and_change_nothing(scenario: MakeScenario) -> None:
    plain = run(drive(scenario), record=False)
    checks = (
        "eventually: /odom.twist.twist.linear.x > 0.15",
        "always: norm(/odom.twist.twist.linear) < 0.3",
        "eventually: min(/scan.ranges) < 1.0",
        "finally: /clock.clock.sec >= 2",
        "always: /odom.child_frame_id == 'base_footprint'",
        "always: /robot_description.data != ''",  # latched, and published before the run begins
    )
    checked = run(drive(scenario, *checks), record=False)
    assert [check.reason for check in checked.checks] == [""] * 7
    assert checked.digest == plain.digest
    speed = checked.checks[1]
    assert speed.margin == pytest.approx(0.05, abs=5e-3)
    assert 0.0 < (speed.worst_s or 0.0) < 3.0


def test_truth_on_demand_changes_nothing(scenario: MakeScenario) -> None:
    checks = (
        "always: clearance > 1 cm",
        "always: slip < 1 m/s",
        "always: energy < 1 kJ",
        "always: jerk < 1e6",
    )
    checked = run(drive(scenario, *checks), record=False)
    assert checked.verdict == "pass", checked.to_json()
    assert checked.digest == run(drive(scenario), record=False).digest


@pytest.mark.parametrize(
    ("early_stop", "check", "end_s"),
    [
        ("never", "always: speed < 0.1", 3.0),
        ("failed", "always: speed < 0.1", 0.2),
        ("failed", "eventually: speed > 0.1", 3.0),
        ("decided", "eventually: speed > 0.1", 3.0),  # driven_distance is not decided before the end
    ],
)
def test_a_run_may_end_when_a_check_has_failed(
    early_stop: str, check: str, end_s: float, scenario: MakeScenario
) -> None:
    verdict = run(drive(scenario, check, early_stop=early_stop), record=False)
    assert verdict.metrics["sim_time_s"] == pytest.approx(end_s, abs=0.15)


def test_a_run_may_end_when_all_is_decided(scenario: MakeScenario) -> None:
    text = DRIVE.replace("  - driven_distance: {{min: 0.1 m}}\n", "").format(
        early_stop="decided",
        checks="  - eventually: driven_distance > 10 cm\n  - always: {signal: speed, below: 1, before: 1 s}",
    )
    verdict = run(scenario(text), record=False)
    assert verdict.verdict == "pass"
    assert verdict.metrics["sim_time_s"] == 1.0


def test_the_recording_marks_the_worst_moments(scenario: MakeScenario, tmp_path: Path) -> None:
    verdict = run(drive(scenario, "always: speed < 0.1", "eventually: clearance < 50 cm"), out=tmp_path)
    column = read(tmp_path / "drive.rrd").column("/log/checks", "TextLog:text")
    marked = dict(zip(column.times_ns.tolist(), (row[0] for row in column.values), strict=True))
    worst = {round((check.worst_s or 0.0) * 1e9): check for check in verdict.checks}
    assert set(marked) == set(worst)
    failed = next(check for check in verdict.checks if not check.passed)
    assert marked[round((failed.worst_s or 0.0) * 1e9)] == (
        f"always(speed < 0.1): {failed.reason}, margin {failed.margin:.4g} m/s"
    )


def test_clearance_is_the_least_of_all_distances(
    scenario: MakeScenario, make_run: Callable[..., Run]
) -> None:
    world = make_run(drive(scenario, "always: clearance > 0")).world
    meter, model = ClearanceMeter(world), world.model
    own = [g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name.startswith("diff_bot/")]
    solid = [g for g in range(model.ngeom) if model.geom_contype[g] | model.geom_conaffinity[g]]
    others = [g for g in solid if g not in own and model.geom(g).name != "floor"]
    for _ in range(3):
        distances = [
            mujoco.mj_geomDistance(model, world.data, one, other, 10.0, None)
            for one in own
            if one in solid
            for other in others
        ]
        assert meter.clearance("diff_bot") == pytest.approx(min(distances), abs=1e-9)
        world.step(300)


def test_slip_is_how_fast_a_wheel_slides(scenario: MakeScenario, make_run: Callable[..., Run]) -> None:
    run = make_run(drive(scenario))
    world, slips = run.world, []
    meter, drive_of = SlipMeter(world), world.robots["diff_bot"].description.drive
    for _ in range(50):
        run.tick()
        slips.append(meter.slip("diff_bot") or 0.0)
    assert max(slips[10:]) < 5e-3, "it rolls"
    assert drive_of is not None
    wheel = world.model.joint(f"diff_bot/{drive_of.left_joints[0]}")
    world.data.qvel[wheel.dofadr[0]] += 4.0
    world.step()
    turning = float(world.data.qvel[wheel.dofadr[0]])
    assert meter.slip("diff_bot") == pytest.approx(turning * drive_of.wheel_radius - 0.2, abs=0.05)


def test_workers_tell_the_same(scenario: MakeScenario, tmp_path: Path) -> None:
    (tmp_path / "crossing.py").write_text(CROSSING, encoding="utf-8")
    checks = """
  - always: "a.speed < 1 and /b/odom.twist.twist.linear.x < 1 and c.clearance > 10 cm"
  - finally: a.localisation_error < 50 cm
  - always: a.time_in_recoveries < 1 s
"""
    one, two = (run(scenario(TRIO + checks.lstrip("\n")), record=False, workers=n) for n in (0, 2))
    assert one.checks == two.checks
    assert one.checks[-2].margin is not None
    assert math.isfinite(one.checks[-2].margin)
