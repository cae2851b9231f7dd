"""What the whole run costs, as a ratio to the raw limit: the same model, as many steps and rays, no more.

`make bench` prints it. It is CPU time of one process, run and raw limit in turns on the same machine: so the
ratios hold on a noisy machine, while the absolute figures do not.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from twin import runtime
from twin.periods import next_due
from twin.runtime.build import build
from twin.scenario.schema import Scenario, load
from twin.sensors.lidar import LidarSpec

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def raw_limit(scenario: Scenario, simulated_s: float) -> float:
    """Return the CPU time [s] of the same physics steps and lidar rays alone."""
    parts = build(scenario)
    parts.bus.close()
    world = parts.world
    model, data = world.model, world.data
    substeps = parts.control_period_ns // world.timestep_ns
    lidars = [
        sensor
        for robot in world.robots.values()
        for sensor in robot.sensors
        if isinstance(sensor.spec, LidarSpec)
    ]
    casts = [
        _caster(model, data, robot.body(lidar.spec.link), lidar.spec)
        for robot in world.robots.values()
        for lidar in robot.sensors
        if isinstance(lidar.spec, LidarSpec)
    ]
    periods = [lidar.spec.period for lidar in lidars]
    due = [next_due(period, 0) for period in periods]
    ticks = round(simulated_s * 1e9 / parts.control_period_ns)
    start = time.process_time()
    for tick in range(1, ticks + 1):
        mujoco.mj_step(model, data, substeps)
        now = tick * parts.control_period_ns
        for i, cast in enumerate(casts):
            if now >= due[i]:
                cast()
                due[i] = next_due(periods[i], now)
    return time.process_time() - start


def _caster(model: mujoco.MjModel, data: mujoco.MjData, link: str, spec: LidarSpec) -> Callable[[], None]:
    body = model.body(link).id
    angles = np.linspace(spec.angle_min, spec.angle_max, spec.samples)
    local = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(spec.samples)])
    geomid, distance = np.zeros(spec.samples, np.int32), np.zeros(spec.samples)
    groups = np.array([1, 0, 0, 1, 0, 0], np.uint8)

    def cast() -> None:
        rays = (local @ data.xmat[body].reshape(3, 3).T).ravel()
        mujoco.mj_multiRay(
            model,
            data,
            data.xpos[body],
            rays,
            groups,
            1,
            body,
            geomid,
            distance,
            None,
            spec.samples,
            spec.range_max,
        )

    return cast


def with_mppi(path: Path) -> Scenario | None:
    """Return a scenario with every robot that navigates under MPPI; None if none does."""
    robots = [i for i, robot in enumerate(load(path).robots) if robot.navigation is not None]
    plugin = {f"robots.{i}.navigation.controller.plugin": "mppi" for i in robots}
    return load(path, plugin) if robots else None


def measure(scenario: Scenario, *, record: bool) -> tuple[float, float]:
    """Return simulated time and CPU time [s] of a run."""
    with tempfile.TemporaryDirectory() as folder:
        verdict = runtime.run(scenario, out=Path(folder), record=record)
    return verdict.metrics["sim_time_s"], verdict.metrics["cpu_time_s"]


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="?", type=Path, default=SCENARIOS / "warehouse.yaml")
    parser.add_argument("--rounds", type=int, default=2, help="best of so many (default: 2)")
    options = parser.parse_args()
    scenario, other = load(options.scenario), with_mppi(options.scenario)
    plain = recorded = raw = mppi = float("inf")
    driven = 0.0
    for _ in range(options.rounds):
        simulated, cpu = measure(scenario, record=False)
        plain = min(plain, cpu)
        recorded = min(recorded, measure(scenario, record=True)[1])
        raw = min(raw, raw_limit(scenario, simulated))
        if other is not None:
            driven, cpu = measure(other, record=False)
            mppi = min(mppi, cpu)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{scenario.name}: {simulated:.1f} s simulated, best of {options.rounds}")
    print(f"{'':24}{'CPU s':>8}{'x real time':>13}{'x raw limit':>13}")
    for name, cpu in (("raw: steps and rays", raw), ("run", plain), ("run with recording", recorded)):
        print(f"{name:24}{cpu:8.2f}{simulated / cpu:13.1f}{cpu / raw:13.2f}")
    if other is not None:  # another controller takes another time: per simulated second
        ratio = mppi / driven * simulated / raw
        print(f"{'run with MPPI':24}{mppi:8.2f}{driven / mppi:13.1f}{ratio:13.2f}")
    print(f"recording costs {recorded / plain:.2f}x; peak memory {memory:.0f} MB")


if __name__ == "__main__":
    main()
