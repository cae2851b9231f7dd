"""What a longer physics step costs in truth: driving, docking, a grasp and energy, at 1, 2, 4 and 5 ms.

`python -m benchmarks.measures.time_step` prints the tables of docs/fidelity.md. Contacts are as twin makes
them for each step: their time constant is 4 ms, or two steps if that is longer, as MuJoCo asks for. Runs of
one seed have the same noise; after some seconds they are different runs all the same, as every rounding
steers the robot elsewhere: so they are compared by what came of many, and only drives without feedback pose
by pose.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import mujoco
import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.models import load as load_robot
from twin.runtime.open_run import run as run_scenario
from twin.runtime.run import Run
from twin.scenario.schema import load
from twin.sim.drive_check import check_drive
from twin.sim.physics import Physics
from twin.warehouse import arena as arenas
from twin.warehouse.skills import SkillsConfig

SCENARIOS = Path(__file__).parents[2] / "scenarios"
STEPS_MS = (1, 2, 4, 5)
ROBOTS = ("warehouse_bot", "diff_bot", "sp1s")
PENDULUM_S = 10.0
ARENA = arenas.load("warehouse")


@dataclass(frozen=True)
class Trial:
    """One run of a scenario."""

    scenario: str
    seed: int
    step_ms: int
    failed: tuple[str, ...]
    """Reasons of the checks that failed."""
    docked_mm: tuple[float, ...]
    """True distances from where the base was to stand, of each docking in turn."""
    docked_deg: tuple[float, ...]
    slip_mm: float | None
    """Of the tote in the gripper; None: there is no such check."""
    work_J: float | None
    localisation_mm: float
    simulated_s: float


def trial(scenario: str, seed: int, step_ms: int) -> Trial:
    """Run a scenario of the warehouse, and look where the robot really docks."""
    overrides = {"seed": str(seed), "physics.timestep": f"{step_ms} ms"}
    docked: list[Pose2] = []
    before = ""

    def watch(run: Run) -> bool:
        nonlocal before
        state = run.parts.mission.state
        if state != before and "dock at" in before and "undock" not in before:
            (stack,) = run.parts.stacks.values()
            docked.append(_dock(before).inverse() @ run.world.pose(stack.handle.base).to_pose2())
        before = state
        return False

    verdict = run_scenario(load(SCENARIOS / f"{scenario}.yaml", overrides), record=False, watch=watch)
    values = {check.name: check.value for check in verdict.checks}
    slip = values.get("tote_slip")
    return Trial(
        scenario=scenario,
        seed=seed,
        step_ms=step_ms,
        failed=tuple(check.reason for check in verdict.checks if not check.passed),
        docked_mm=tuple(math.hypot(pose.x, pose.y) * 1e3 for pose in docked),
        docked_deg=tuple(abs(math.degrees(wrap_angle(pose.yaw))) for pose in docked),
        slip_mm=None if slip is None else slip * 1e3,
        work_J=values.get("energy"),
        localisation_mm=(values["localisation_error"] or math.inf) * 1e3,
        simulated_s=verdict.metrics["sim_time_s"],
    )


def _dock(state: str) -> Pose2:
    """Return where the base is to stand in the state 'dock at charger', or 'tote_a: dock at rack_a/1/7'."""
    name = state.rpartition("dock at ")[2]
    if name == "charger":
        return Pose2(-9.05, -2.6, math.pi)
    return ARENA.slot(name).approach(0.0) @ Pose2(-SkillsConfig().docked_distance, 0.0, 0.0)


def trials(
    scenarios: Sequence[str], seeds: Sequence[int], steps: Sequence[int], log: Path | None
) -> Iterator[Trial]:
    """Yield all trials; those that are in the log are not run again."""
    lines = log.read_text(encoding="utf-8").splitlines() if log is not None and log.exists() else []
    known = {
        (one.scenario, one.seed, one.step_ms): one for one in (Trial(**json.loads(line)) for line in lines)
    }
    for seed in seeds:
        for scenario in scenarios:
            for step in steps:
                one = known.get((scenario, seed, step))
                if one is None:
                    one = trial(scenario, seed, step)
                    if log is not None:
                        with log.open("a", encoding="utf-8") as file:
                            print(json.dumps(asdict(one)), file=file)
                yield one


def figure8(robot: str, step_ms: int) -> Array:
    """Return the true positions, shape (n, 3), at each control tick of two circles driven open loop."""
    overrides = {
        "robots.0.model": robot,
        "mission.robot": robot,
        "physics.timestep": f"{step_ms} ms",
        "checks": "[mission_succeeded: ]",
    }
    positions = []

    def watch(run: Run) -> bool:
        positions.append(run.world.pose(run.parts.stacks[robot].handle.base).xyz.copy())
        return False

    run_scenario(load(SCENARIOS / "diff_bot_figure8.yaml", overrides), record=False, watch=watch)
    return np.array(positions)


def pendulum_drift(step_ms: int) -> float:
    """Return by which part of what it swings with a frictionless pendulum's energy changes, from level on."""
    spec = mujoco.MjSpec()
    Physics(timestep=step_ms * 1e-3).apply(spec)
    spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    rod = spec.worldbody.add_body()
    rod.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 1.0, 0.0])
    rod.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0, 0, 0, 0.5, 0, 0], size=[0.02, 0, 0], mass=1.0)
    model = spec.compile()
    data = mujoco.MjData(model)

    def energy() -> float:
        mujoco.mj_forward(model, data)
        return float(data.energy.sum())

    level = energy()
    data.qpos[0] = math.pi / 2.0
    lowest = energy()
    data.qpos[0] = 0.0
    mujoco.mj_step(model, data, round(PENDULUM_S * 1e3 / step_ms))
    return (energy() - level) / (level - lowest)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def open_loop(steps: Sequence[int]) -> str:
    """Return the table of drives without noise, and of the pendulum."""
    rows = []
    reference = {robot: figure8(robot, STEPS_MS[0]) for robot in ROBOTS}
    for step in steps:
        for robot in ROBOTS:
            report = check_drive(load_robot(robot), timestep=step * 1e-3)
            worst: dict[str, float] = {}
            for manoeuvre in report.manoeuvres:
                kind = manoeuvre.name.split()[0]
                worst[kind] = max(worst.get(kind, 0.0), manoeuvre.error or 0.0)
            away = np.linalg.norm(figure8(robot, step) - reference[robot], axis=1)
            rows.append(
                [
                    f"{step} ms",
                    f"`{robot}`",
                    f"{worst['straight'] * 1e3:.2g}",
                    f"{worst['spin']:.2g}",
                    f"{worst['circle']:.2g}",
                    f"{away.max() * 1e3:.2g}, {away[-1] * 1e3:.2g}",
                    f"{pendulum_drift(step):+.2%}",
                ]
            )
    heads = [
        "Step", "Robot", "5 m [mm]", "spin [degrees]", "circle [%]",
        "two circles off those at 1 ms: most, at the end [mm]", "pendulum's energy",
    ]  # fmt: skip
    return table(heads, rows)


def closed_loop(scenario: str, done: Sequence[Trial]) -> str:
    """Return the table of what came of many runs of a scenario."""
    rows = []
    steps = sorted({one.step_ms for one in done})
    for step in steps:
        ones = [one for one in done if one.scenario == scenario and one.step_ms == step]
        docks = np.array([one.docked_mm for one in ones if len(one.docked_mm) == len(ones[0].docked_mm)])
        slips = [one.slip_mm for one in ones if one.slip_mm is not None]
        works = [one.work_J for one in ones if one.work_J is not None]
        rows.append(
            [
                f"{step} ms",
                f"{sum(not one.failed for one in ones)} of {len(ones)}",
                "; ".join(f"{np.sqrt((d**2).mean()):.1f}, {d.max():.1f}" for d in docks.T),
                f"{max(max(one.docked_deg) for one in ones):.2f}",
                f"{max(slips):.2f}" if slips else "",
                f"{statistics.mean(works):.0f}" if works else "",
                f"{statistics.mean(one.localisation_mm for one in ones):.1f}",
                f"{statistics.mean(one.simulated_s for one in ones):.1f}",
            ]
        )
    heads = [
        "Step", "passed", "docked off: rms, worst [mm]", "worst [degrees]", "worst slip [mm]", "work [J]",
        "believed position off, rms [mm]", "simulated [s]",
    ]  # fmt: skip
    return table(heads, rows)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--steps", type=int, nargs="+", default=STEPS_MS, help="[ms]")
    parser.add_argument("--scenarios", nargs="*", default=("warehouse", "warehouse_charger"))
    parser.add_argument("--log", type=Path, help="a line for each run; what it has is not run again")
    options = parser.parse_args()
    print(open_loop(options.steps))
    done = list(trials(options.scenarios, range(1, options.seeds + 1), options.steps, options.log))
    for scenario in options.scenarios:
        print(f"\n{scenario}, {options.seeds} seeds\n\n{closed_loop(scenario, done)}")


if __name__ == "__main__":
    main()
