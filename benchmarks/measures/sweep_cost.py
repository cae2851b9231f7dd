"""What a sweep costs: CPU time of many short runs in it, to that of the same runs in turn in a warm process.

Both begin with nothing: starts of processes, imports, reading, results and their table are in it. Rounds take
turns, and of each the best counts, so the ratio holds on a noisy machine. The page, which takes as long for
200 runs as for 20 000, is measured apart.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import resource
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

SCENARIO = Path(__file__).parents[2] / "scenarios" / "diff_bot_figure8.yaml"
_PR_SET_CHILD_SUBREAPER = 36
"""Linux: what outlives the process that started it becomes this process's child."""
_IN_TURN = """
import sys
from pathlib import Path
from twin.runtime.open_run import run
from twin.scenario.schema import load

for seed in range(int(sys.argv[2])):
    for linear in ("0.1", "0.2"):
        over = {"duration": sys.argv[3], "mission.steps.0.linear": linear, "seed": str(seed)}
        verdict = run(load(Path(sys.argv[1]), over), record=False)
        folder = Path(sys.argv[4]) / f"{linear}-{seed}"
        folder.mkdir()
        verdict.write(folder)
"""


def cpu(command: list[str]) -> float:
    """Return the CPU time of a command and of all processes that it starts [s], also those it leaves."""
    warm = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, check=False, env=warm, stdout=subprocess.DEVNULL)
    assert done.returncode in (0, 1), done
    with suppress(ChildProcessError):
        while True:
            os.wait()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def in_turn(seeds: int, duration: str) -> float:
    """Return what the runs take in one process [s]."""
    with tempfile.TemporaryDirectory() as folder:
        return cpu([sys.executable, "-c", _IN_TURN, str(SCENARIO), str(seeds), duration, folder])


def swept(seeds: int, duration: str, jobs: int, *options: str) -> float:
    """Return what they take in a sweep [s]."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["--seeds", f"0:{seeds}", "--set", f"duration={duration}", "--record", "none", *options]
        words += ["--set", "mission.steps.0.linear=0.1,0.2", "-j", str(jobs), "--out", f"{folder}/out"]
        return cpu([sys.executable, "-m", "twin.cli", "sweep", str(SCENARIO), *words])


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--duration", default="4 s", help="of each run, simulated (default: 4 s)")
    parser.add_argument("--rounds", type=int, default=2, help="best of so many (default: 2)")
    options = parser.parse_args()
    seeds, duration = options.runs // 2, options.duration
    best: dict[str, float] = {}

    def took(name: str, seconds: float) -> None:
        best[name] = min(seconds, best.get(name, seconds))

    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    for _ in range(options.rounds):
        took("in turn", in_turn(seeds, duration))
        took("one process", swept(seeds, duration, 1, "--no-page"))
        took("two processes", swept(seeds, duration, 2, "--no-page"))
        took("two, and a page", swept(seeds, duration, 2))
    print(f"{2 * seeds} runs of {duration} of {SCENARIO.stem}, best of {options.rounds}")
    print(f"{'':20}{'CPU s':>8}{'ms per run':>12}{'x in turn':>12}")
    for name, seconds in best.items():
        print(f"{name:20}{seconds:8.2f}{seconds / seeds / 2 * 1e3:12.1f}{seconds / best['in turn']:12.3f}")


if __name__ == "__main__":
    main()
