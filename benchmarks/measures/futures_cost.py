"""What futures cost: CPU time of eight to that of one, forks and all; how long the run stands still.

One costs what a future of the eight does in the mean, and what is around a single one: its forks. So speed
and noise of the machine, and that cores in use slow each other down, are in both; the ratio holds anywhere.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from statistics import fmean, median

from twin.live.futures import Futures, WhatIf
from twin.live.futures.futures import Answer
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load

SCENARIO = Path(__file__).parents[2] / "scenarios" / "diff_bot_figure8.yaml"
_LIMIT = 8.5


def main() -> None:
    """Measure, and fail if eight cost too much."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", type=Path, default=SCENARIO)
    parser.add_argument("--at", type=float, default=1.0, metavar="S", help="When the run is forked.")
    parser.add_argument("--horizon", type=float, default=30.0, metavar="S")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    run = OpenRun(load(given.scenario), record=False)
    world = run.run.world
    run.advance(lambda: world.time_ns >= given.at * 1e9)
    rounds: list[tuple[Answer, Answer]] = []
    for _ in range(given.rounds):
        one, eight = (_answer(run, n, given.horizon) for n in (1, 8))
        rounds.append((one, eight))
        print(f"one {one.cpu_s:.2f} s, eight {eight.cpu_s:.2f} s of CPU in {eight.wall_s:.2f} s", flush=True)
    run.close()
    ratio = median(_ratio(one, eight) for one, eight in rounds)
    stall = min(answer.stall_s for both in rounds for answer in both)
    ends = sorted({outcome.end_s for _, eight in rounds for outcome in eight.outcomes})
    print(f"futures of {ends[0]:g} to {ends[-1]:g} s: eight cost {ratio:.2f} times one (at most {_LIMIT})")
    print(f"the run stands still for {stall * 1e3:.1f} ms")
    if ratio > _LIMIT:
        raise SystemExit(1)


def _ratio(one: Answer, eight: Answer) -> float:
    around = one.cpu_s - one.outcomes[0].cpu_s
    return eight.cpu_s / (fmean(outcome.cpu_s for outcome in eight.outcomes) + around)


def _answer(run: OpenRun, n: int, horizon_s: float) -> Answer:
    with Futures(run, WhatIf(n=n, horizon=horizon_s)) as futures:
        return futures.wait()


if __name__ == "__main__":
    main()
