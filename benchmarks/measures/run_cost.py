"""What the whole run costs, as a ratio to its limit: its own physics steps and rays alone.

`make bench` prints it. It is CPU time of one process; runs and replays take turns on the same machine, and
the best of some rounds counts: so the ratios hold on a noisy machine, while the absolute figures do not. A
second table, and a picture, split one more run by layer.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from pathlib import Path

from benchmarks.measures.layers import Layers, picture
from benchmarks.measures.replay import Replay
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario, load

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


def cost(scenario: Scenario, *, record: bool) -> float:
    """Return the CPU time of a run from its first tick to its last [s]."""
    with tempfile.TemporaryDirectory() as folder:
        run = OpenRun(scenario, out=Path(folder), record=record)
        try:
            run.advance_to_end()
            return run.finish().metrics["cpu_time_s"]
        finally:
            run.close()


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
    limit, mppi_limit = replay(scenario), None if other is None else replay(other)
    best: dict[str, float] = defaultdict(lambda: float("inf"))
    for _ in range(options.rounds):
        taken = {"limit": limit.cost(), "run": cost(scenario, record=False)}
        taken |= {"recorded": cost(scenario, record=True), "limit again": limit.cost()}
        if other is not None and mppi_limit is not None:
            taken |= {"MPPI": cost(other, record=False), "limit of MPPI": mppi_limit.cost()}
        best.update({name: min(spent, best[name]) for name, spent in taken.items()})
    raw = min(best["limit"], best["limit again"])
    rows = [
        ("its physics and rays alone", limit, raw, raw),
        ("run", limit, best["run"], raw),
        ("run with recording", limit, best["recorded"], raw),
    ]
    if mppi_limit is not None:
        rows.append(("run with MPPI", mppi_limit, best["MPPI"], best["limit of MPPI"]))
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
