"""What many robots cost: CPU time of a run for each number of them, all driving with AMCL and navigation.

The hall is the same for any number. Runs take turns in one process, block by block, and of each block the
best of several rounds counts, as in `benchmarks/measures/run_cost.py`. What a run costs whatever drives in it
is shared, so the cost of a robot should fall with their number.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from benchmarks.measures.fleet import fleet
from benchmarks.measures.run_cost import advance
from twin.runtime.open_run import OpenRun
from twin.savings import seldom_collected
from twin.scenario.verdict import Verdict

BLOCK_S = 1.0
WARM_UP_S = 2.0
"""What is done once, such as fields of distances of the map, is not what a robot costs as it drives."""


def round_of(folder: Path, robots: Sequence[int], blocks: int, seconds: float) -> dict[int, list[float]]:
    """Return the CPU time [s] of each run, block by block in turns; raises if a robot does not drive well."""
    taken: dict[int, list[float]] = {n: [] for n in robots}
    with ExitStack() as ending:
        runs: dict[int, OpenRun] = {}
        for n in robots:
            runs[n] = OpenRun(fleet(folder, n, blocks=blocks, duration=WARM_UP_S + seconds), record=False)
            ending.callback(runs[n].close)
            advance(runs[n], WARM_UP_S)
        ending.enter_context(seldom_collected())  # as a run does
        for block in range(math.ceil(seconds / BLOCK_S)):
            for n, run in runs.items():
                began = time.process_time()
                advance(run, WARM_UP_S + (block + 1) * BLOCK_S)
                taken[n].append(time.process_time() - began)
        for n, run in runs.items():
            _judge(n, run.finish())
    return taken


def _judge(robots: int, verdict: Verdict) -> None:
    failed = [f"{check.name}: {check.reason}" for check in verdict.checks if not check.passed]
    if failed:
        raise SystemExit(f"{robots} robots: {'; '.join(failed)}")


def picture(title: str, costs: dict[int, float]) -> str:
    """Return the cost of a robot over their number as SVG; `costs` in CPU seconds per simulated second."""
    left, wide, high = 60, 420, 190
    most, top = max(costs), 1.15 * max(cost / n for n, cost in costs.items())
    points = [
        (left + 10 + wide * math.log(n) / math.log(max(2, most)), 34 + high * (1.0 - cost / n / top))
        for n, cost in costs.items()
    ]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    marks = [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="#1f6f8b"/>'
        f'<text x="{x:.1f}" y="{y - 8:.1f}" text-anchor="middle">{cost / n * 1e3:.0f}</text>'
        f'<text x="{x:.1f}" y="{34 + high + 16}" text-anchor="middle">{n}</text>'
        for (x, y), (n, cost) in zip(points, costs.items(), strict=True)
    ]
    body = "\n".join(marks)
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="{left + wide + 40}" height="{34 + high + 40}"
 viewBox="0 0 {left + wide + 40} {34 + high + 40}" font-family="sans-serif" font-size="12">
<rect width="100%" height="100%" fill="#ffffff"/>
<text x="8" y="18" font-weight="bold">{title}</text>
<path d="M{left} 34 V{34 + high} H{left + wide + 20}" fill="none" stroke="#888"/>
<polyline points="{line}" fill="none" stroke="#1f6f8b" stroke-width="2"/>
{body}
<text x="{left + wide / 2}" y="{34 + high + 34}" text-anchor="middle">robots (logarithmic)</text>
</svg>
"""


def main() -> None:
    """Print a table; draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--robots", type=int, nargs="+", default=[1, 2, 5, 10], help="how many (default: 1 2 5 10)"
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time (default: 20)")
    parser.add_argument("--rounds", type=int, default=2, help="best of so many (default: 2)")
    parser.add_argument(
        "--blocks", type=int, default=50, help="for how many robots there is room (default: 50)"
    )
    parser.add_argument("--picture", type=Path, help="where to draw the cost of a robot, as SVG")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rounds = [
            round_of(Path(folder), options.robots, options.blocks, options.seconds)
            for _ in range(options.rounds)
        ]
    costs = {
        n: float(np.min([taken[n] for taken in rounds], axis=0).sum()) / options.seconds
        for n in options.robots
    }
    alone = costs[options.robots[0]] / options.robots[0]
    print(f"{options.seconds:g} s simulated, best of {options.rounds}, room for {options.blocks}")
    print(f"{'robots':>6}{'CPU ms per s':>14}{'per robot':>11}{'x one':>8}{'x real time':>13}")
    for n, cost in costs.items():
        print(f"{n:6}{cost * 1e3:14.1f}{cost / n * 1e3:11.1f}{cost / alone:8.2f}{1.0 / cost:13.2f}")
    if options.picture is not None:
        title = "CPU time of each robot [ms per simulated s]"
        options.picture.write_text(picture(title, costs), encoding="utf-8")


if __name__ == "__main__":
    main()
