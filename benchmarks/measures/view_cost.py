"""What `twin run --view` costs the run's own process: CPU time of a run with a viewer over one without.

Both are recorded, and go on side by side, each in a process of its own with all of its threads, so that the
ratio holds on a noisy machine. The viewer is another process, which is not counted; it draws in memory.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from benchmarks.measures.run_cost import SCENARIOS, advance

BEGIN_S = 4.0
"""Simulated time after which is measured: the viewer is there then, and all code is loaded."""


def cost(scenario: Path, pace: float | None, seconds: float, watched: bool) -> tuple[float, int]:
    """Return the CPU time of a run in this process [s], and how many blocks a viewer did not get."""
    from twin.recording.live_screen import LiveScreen
    from twin.runtime.open_run import OpenRun
    from twin.scenario.schema import load

    with tempfile.TemporaryDirectory() as folder, ExitStack() as ending:
        screen = LiveScreen(sys.stderr.write, headless=True) if watched else None
        run = OpenRun(load(scenario), out=Path(folder), pace=pace, screen=screen)
        ending.callback(run.close)
        if screen is not None:
            ending.callback(screen.close)
        advance(run, BEGIN_S)
        began = time.process_time()
        advance(run, BEGIN_S + seconds)
        time.sleep(1.0)  # threads of the recording and of the screen end what they are at
        return time.process_time() - began, 0 if screen is None else screen.dropped


def main() -> None:
    """Print a line for each pace."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="?", type=Path, default=SCENARIOS / "warehouse.yaml")
    parser.add_argument("--seconds", type=float, default=40.0, help="of simulated time (default: 40)")
    parser.add_argument("--rounds", type=int, default=2, help="sum of so many (default: 2)")
    options = parser.parse_args()
    for pace in (1.0, 2.0, None):
        measured = partial(cost, options.scenario, pace, options.seconds)
        spent, dropped = [0.0, 0.0], 0
        for _ in range(options.rounds):
            with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
                for i, (cpu_s, lost) in enumerate(pool.map(measured, (False, True))):
                    spent[i] += cpu_s
                    dropped += lost
        alone, watched = spent
        sys.stdout.write(f"pace {pace or 'max'}: {alone:.2f} s of CPU alone, {watched:.2f} s watched, ")
        sys.stdout.write(f"{watched / alone - 1.0:+.0%}; {dropped} blocks dropped\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
