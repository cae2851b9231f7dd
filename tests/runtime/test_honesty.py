"""What must break when somebody cheats: truth to the filter, a mirrored wheel, a welded tote."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from twin import runtime
from twin.geometry import wrap_angle
from twin.models import load as load_robot
from twin.runtime.run import Run
from twin.scenario.schema import Scenario, load
from twin.scenario.verdict import Verdict

ROOT = Path(__file__).parents[2]
MakeScenario = Callable[[str], Scenario]
MakeRun = Callable[..., Run]

# (a) AMCL gets the true pose

LOCALISED = """
name: localised
seed: 1
duration: 30 s
world: {arena: warehouse}
robots:
  - model: warehouse_bot
    start: start
    localisation: {type: amcl, map: warehouse, initial_pose_error: {xy: 30 cm, yaw: 8 deg}}
    navigation: {}
mission: MISSION
checks: [{localisation_error: {rms: 1 m}}]
"""
IDLE = "{type: idle}"
DRIVE = "{type: behaviors, robot: warehouse_bot, steps: [{navigate_to_pose: {x: -4 m, y: -5.4 m}}]}"


def localisation_errors(run: Run, until_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Tick, and return the position [m] and heading errors [rad] of every tick that has an estimate."""
    (stack,) = run.parts.stacks.values()
    errors = []
    while run.world.time_ns < until_s * 1e9:
        run.tick()
        estimate = stack.robot_pose.in_map()
        if estimate is not None:
            truth = run.world.pose(stack.handle.base).to_pose2()
            errors.append((estimate.distance(truth), abs(wrap_angle(estimate.yaw - truth.yaw))))
    return tuple(np.array(errors).T)


def test_a_blind_filter_stays_as_wrong_as_its_first_guess(scenario: MakeScenario, make_run: MakeRun) -> None:
    run = make_run(scenario(LOCALISED.replace("MISSION", IDLE)))
    (stack,) = run.parts.stacks.values()
    for publisher in stack.sensors:
        if publisher.sensor.spec.topic == "scan":
            sample = publisher.sensor.sample

            def blind(time_ns: int, sample: Callable = sample) -> object:
                reading = sample(time_ns)
                return replace(reading, ranges=np.full_like(reading.ranges, np.inf))

            publisher.sensor.sample = blind
    distance, yaw = localisation_errors(run, 3.0)
    assert len(distance) > 100
    assert distance == pytest.approx(0.30, abs=0.05), "without a scan there is nothing to correct it by"
    assert np.degrees(yaw) == pytest.approx(8.0, abs=1.5)


def test_a_seeing_filter_finds_its_place_but_never_exactly(scenario: MakeScenario, make_run: MakeRun) -> None:
    run = make_run(scenario(LOCALISED.replace("MISSION", DRIVE)))
    distance, yaw = localisation_errors(run, 12.0)
    (stack,) = run.parts.stacks.values()
    assert run.world.pose(stack.handle.base).xyz[0] > -6.0, "it drove on what it believes"
    assert distance[0] > 0.01
    assert distance[-100:].max() < 0.06
    assert yaw[-100:].max() < math.radians(3.0)
    assert distance.min() > 1e-6, "sensors never give the truth itself"
    assert np.median(distance) > 1e-3
    assert len(np.unique(distance.round(9))) > 100


def test_no_message_carries_the_truth(scenario: MakeScenario, make_run: MakeRun) -> None:
    """Whatever pose travels on the bus, none follows the robot's true one."""
    poses: dict[str, list[tuple[int, float, float]]] = {}

    def note(name: str, time_ns: int, position: object) -> None:
        poses.setdefault(name, []).append((time_ns, position.x, position.y))  # type: ignore[attr-defined]

    def tap(sample: object) -> None:
        message, topic, now = sample.message, sample.topic, sample.time_ns  # type: ignore[attr-defined]
        if topic == "/tf":
            for transform in message.transforms:
                note(transform.child_frame_id, now, transform.transform.translation)
        elif hasattr(getattr(message, "pose", None), "covariance"):
            note(topic, now, message.pose.pose.position)
        elif hasattr(getattr(message, "pose", None), "position"):
            note(topic, now, message.pose.position)

    run = make_run(scenario(LOCALISED.replace("MISSION", DRIVE)), taps=[tap])
    (stack,) = run.parts.stacks.values()
    truth = {}
    while run.world.time_ns < 8_000_000_000:
        run.tick()
        truth[run.world.time_ns] = run.world.pose(stack.handle.base).xyz[:2].copy()
    assert {"/odom", "/amcl_pose", "odom"} <= set(poses)
    for name, track in poses.items():
        moving = [(x, y, truth[t]) for t, x, y in track if t in truth and abs(truth[t][0] + 8.5) > 0.2]
        away = [math.hypot(x - at[0], y - at[1]) for x, y, at in moving]
        assert not away or np.median(away) > 1e-4, name


# (b) a wheel is mirrored

STRAIGHT = """
name: straight
seed: 1
duration: 10 s
robots: [{model: MODEL, name: bot}]
mission: {type: velocity_profile, robot: bot, steps: [{duration: 4 s, linear: 0.3 m/s}]}
checks:
  - mission_succeeded:
  - driven_distance: {min: 1 m, max: 1.3 m}
  - final_pose: {x: 1.17 m, y: 0 m, yaw: 0 deg, tolerance: 5 cm, yaw_tolerance: 3 deg}
  - odometry_drift: {max: 5 cm}
"""


def verdict_of(scenario: Scenario) -> Verdict:
    return runtime.run(scenario, record=False)


def failed(verdict: Verdict) -> set[str]:
    return {check.name.partition("(")[0] for check in verdict.checks if not check.passed}


@pytest.mark.parametrize("robot", ["diff_bot", "warehouse_bot"])
def test_a_mirrored_wheel_fails_a_straight_drive(robot: str, scenario: MakeScenario, tmp_path: Path) -> None:
    assert failed(verdict_of(scenario(STRAIGHT.replace("MODEL", robot)))) == set()
    urdf = load_robot(robot).urdf
    joint = r'(<joint name="wheel_right_joint".*?<axis xyz=")0 1 0"'
    mirrored, count = re.subn(joint, r'\g<1>0 -1 0"', urdf, flags=re.DOTALL)
    assert count == 1
    path = tmp_path / "mirrored.urdf"
    path.write_text(mirrored, encoding="utf-8")
    verdict = verdict_of(scenario(STRAIGHT.replace("MODEL", str(path))))
    assert failed(verdict) >= {"final_pose", "odometry_drift"}


# (c) the tote is welded


def test_nothing_but_contact_can_hold_a_tote(scenario: MakeScenario, make_run: MakeRun) -> None:
    text = (ROOT / "scenarios" / "warehouse.yaml").read_text(encoding="utf-8")
    world = make_run(scenario(text)).world
    model = world.model
    goods = {model.body(good.name).id for good in world.scene.goods}
    assert goods
    for body in goods:
        (joint,) = [j for j in range(model.njnt) if model.jnt_bodyid[j] == body]
        assert model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        assert model.body_parentid[body] == 0
        assert model.body_gravcomp[body] == 0.0
        assert model.body_mocapid[body] == -1
    assert set(model.eq_type) <= {int(mujoco.mjtEq.mjEQ_JOINT)}, "fingers are coupled; nothing is welded"
    assert not np.any(model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY))


def slippery(tmp_path: Path) -> dict[str, str]:
    urdf, count = re.subn(
        r'(<gazebo reference="(?:left|right)_finger">)<mu1>1.0</mu1><mu2>1.0</mu2>',
        r"\g<1><mu1>0.02</mu1><mu2>0.02</mu2>",
        load_robot("warehouse_bot").urdf,
    )
    assert count == 2
    path = tmp_path / "slippery.urdf"
    path.write_text(urdf, encoding="utf-8")
    return {"robots.0.model": str(path), "robots.0.name": "warehouse_bot"}


BEFORE_THE_RACK = {"robots.0.start": "null", "robots.0.pose": "{x: 0 m, y: 2 m, yaw: 90 deg}"}


@pytest.mark.slow
@pytest.mark.parametrize("cheat", ["heavy tote", "slippery pads"])
def test_a_tote_that_friction_cannot_hold_is_not_delivered(cheat: str, tmp_path: Path) -> None:
    goods = {"world.goods": "[{name: tote_a, mass: 15 kg}]"}
    overrides = goods if cheat == "heavy tote" else slippery(tmp_path)
    verdict = verdict_of(load(ROOT / "scenarios" / "warehouse.yaml", {**overrides, **BEFORE_THE_RACK}))
    assert verdict.exit_code == 1
    assert "tote_slip" in failed(verdict), "it was taken hold of"
    (delivered,) = [check for check in verdict.checks if check.name.startswith("delivered")]
    assert not delivered.passed
    assert "tote_a" in delivered.reason


# (d) nodes see no truth

AUTONOMY = [
    *sorted((ROOT / "twin" / "nodes").rglob("*.py")),
    ROOT / "twin" / "warehouse" / "pick_and_place.py",
    ROOT / "twin" / "warehouse" / "skills.py",
]
PURE = [
    path
    for package in ("navigation", "controllers", "manipulation")
    for path in sorted((ROOT / "twin" / package).rglob("*.py"))
]
TRUTH = {
    "twin.sim",
    "twin.runtime",
    "twin.scenario",
    "twin.recording",
    "twin.convert",
    "mujoco",
    "gc",
    "inspect",
}
STATE = {"world", "_world", "qpos", "qvel", "xpos", "xquat", "mocap_pos", "body_poses", "contacts", "MjData"}


def imports(tree: ast.AST) -> set[str]:
    names: set[str] = set()
    for item in ast.walk(tree):
        if isinstance(item, ast.Import):
            names |= {alias.name for alias in item.names}
        elif isinstance(item, ast.ImportFrom):
            names |= {item.module or ""} | {f"{item.module}.{alias.name}" for alias in item.names}
    return names


@pytest.mark.parametrize("path", [*AUTONOMY, *PURE], ids=lambda path: str(path.relative_to(ROOT)))
def test_autonomy_imports_no_simulator_and_reads_no_truth(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    used = imports(tree)
    assert not {name for name in used for truth in TRUTH if name == truth or name.startswith(truth + ".")}
    touched = {item.attr for item in ast.walk(tree) if isinstance(item, ast.Attribute)}
    touched |= {item.id for item in ast.walk(tree) if isinstance(item, ast.Name)}
    assert not touched & STATE


def test_the_import_test_looks_at_something() -> None:
    assert len(AUTONOMY) > 20
    tree = ast.parse("from twin.sim.world import World\nimport mujoco")
    assert {"twin.sim.world", "mujoco"} <= imports(tree)
