"""What the whole run costs, as a ratio to its limit: its own physics steps and rays alone.

`make bench` prints it. It is CPU time of one process, in which the runs and the replay take turns every two
simulated seconds; each such block is the same work in every round, and its best time counts. So the ratios
hold on a noisy machine, while the absolute figures do not. A second table, and a picture, split one more run
by layer.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.measures.layers import Layers, picture
from benchmarks.measures.replay import Replay
from twin.runtime.open_run import OpenRun
from twin.savings import seldom_collected
from twin.scenario.schema import Scenario, load

BLOCK_S = 2.0
"""Simulated time that limit and runs are driven in turns."""
SETTLE_S = 0.05
"""After each block, for the threads of a recording to end what they are at: it is their block's cost."""
SCENARIOS = Path(__file__).parents[2] / "scenarios"


def with_mppi(path: Path) -> Scenario | None:
    """Return a scenario with every robot that navigates under MPPI; None if none does."""
    robots = [i for i, robot in enumerate(load(path).robots) if robot.navigation is not None]
    plugin = {f"robots.{i}.navigation.controller.plugin": "mppi" for i in robots}
    return load(path, plugin) if robots else None


def replay(scenario: Scenario) -> Replay:
    """Run once; return how its physics and rays are done again."""
    run = OpenRun(scenario, record=False)
    try:
        return Replay(run)
    finally:
        run.close()


def costs(scenario: Scenario, limit: Replay, *, record: bool) -> dict[str, list[float]]:
    """Return the CPU time [s] of limit, run and, if wanted, recorded run, block by block in turns."""
    limit.rewind()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as ending:
        turns: dict[str, Callable[[float], object]] = {"limit": limit.advance}
        for name in ("run", "recorded") if record else ("run",):
            run = OpenRun(scenario, out=Path(folder), record=name == "recorded")
            ending.callback(run.close)
            turns[name] = partial(advance, run)
        ending.enter_context(seldom_collected())  # as a run does
        taken: dict[str, list[float]] = {name: [] for name in turns}
        for block in range(1, math.ceil(limit.simulated_s / BLOCK_S) + 1):
            for name, until in turns.items():
                began = time.process_time()
                until(block * BLOCK_S)
                time.sleep(SETTLE_S)
                taken[name].append(time.process_time() - began)
    return taken


def advance(run: OpenRun, until_s: float) -> None:
    """Tick a run up to a simulated time [s]."""
    run.advance(lambda: run.run.world.time_ns >= until_s * 1e9)


def best_of(rounds: int, measure: Callable[[], dict[str, list[float]]]) -> dict[str, float]:
    """Return the CPU times [s] of several rounds: of each block the best."""
    taken = [measure() for _ in range(rounds)]
    return {name: float(np.min([one[name] for one in taken], axis=0).sum()) for name in taken[0]}


def by_layer(scenario: Scenario) -> dict[str, float]:
    """Return the CPU time of each layer of a recorded run [s]."""
    layers = Layers()
    with tempfile.TemporaryDirectory() as folder, layers.wrapped():
        run = OpenRun(scenario, out=Path(folder))
        try:
            layers.restart()
            run.advance_to_end()
            return layers.seconds()
        finally:
            run.close()


def main() -> None:
    """Print two tables; draw the second."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="?", type=Path, default=SCENARIOS / "warehouse.yaml")
    parser.add_argument("--rounds", type=int, default=2, help="best of so many (default: 2)")
    parser.add_argument("--picture", type=Path, help="where to draw the layers, as SVG")
    options = parser.parse_args()
    scenario, other = load(options.scenario), with_mppi(options.scenario)
    limit = replay(scenario)
    best = best_of(options.rounds, lambda: costs(scenario, limit, record=True))
    raw = best["limit"]
    rows = [
        ("its physics and rays alone", limit, raw, raw),
        ("run", limit, best["run"], raw),
        ("run with recording", limit, best["recorded"], raw),
    ]
    if other is not None:
        mppi_limit = replay(other)
        mppi = best_of(options.rounds, lambda: costs(other, mppi_limit, record=False))
        rows.append(("run with MPPI", mppi_limit, mppi["run"], mppi["limit"]))
    print(f"{scenario.name}, {limit.simulated_s:.1f} s simulated, best of {options.rounds}")
    print(f"{'':28}{'CPU s':>8}{'x real time':>13}{'x its limit':>13}")
    for name, its, spent, least in rows:
        print(f"{name:28}{spent:8.2f}{its.simulated_s / spent:13.1f}{spent / least:13.2f}")
    print(f"recording costs {best['recorded'] / best['run']:.2f}x")

    spent = by_layer(scenario)
    whole = sum(spent.values())
    print(f"\nby layer, recorded; the clocks add {whole / best['recorded'] - 1.0:.0%}")
    print(f"{'':28}{'ms per simulated s':>20}{'share':>8}{'x limit':>9}")
    layers = {name: seconds / whole * best["recorded"] for name, seconds in spent.items()}
    for name, seconds in layers.items():
        share = seconds / best["recorded"]
        print(f"{name:28}{seconds / limit.simulated_s * 1e3:20.1f}{share:8.1%}{seconds / raw:9.2f}")
    if options.picture is not None:
        title = f"{scenario.name}, recorded: CPU time over that of its physics and rays alone"
        drawn = picture(title, {name: seconds / raw for name, seconds in layers.items()})
        options.picture.write_text(drawn, encoding="utf-8")


if __name__ == "__main__":
    main()
