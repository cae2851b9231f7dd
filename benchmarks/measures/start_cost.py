"""What a start costs, as ratios of CPU time that hold on a noisy machine: each to its own limit, in turns.

- From `twin run` to the first tick, with recording and warm caches, to the bare imports of those libraries
  that the run has loaded by then, and of those that it has loaded two simulated seconds later.
- Another run in the same process, of the same and of another scenario, to that one's own first start. One
  that needs libraries that the other did not loads them then, as in its own first start.
- `twin --help` to the imports of typer and rich.

Processes that are started on the way count, too.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

SCENARIOS = Path(__file__).parents[2] / "scenarios"
LIBRARIES = (
    "numpy",
    "yaml",
    "pydantic",
    "typer",
    "rich.progress",
    "mujoco",
    "zenoh",
    "rosbags.typesys",
    "rerun",
    "numba",
    "scipy.ndimage",
    "scipy.sparse.csgraph",
    "scipy.spatial",
)
"""What twin builds on, of which a scenario loads a part."""

_TOLD = """
import json, os, resource, sys

def cpu():
    both = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in both)

def tell(*more):
    print(json.dumps([cpu(), *more]), flush=True)
    os._exit(0)
"""
_STARTED = f"""{_TOLD}
from twin.api.simulation import Simulation
from twin.cli import main

def stop(simulation, start=Simulation._start):
    start(simulation)
    for _ in range(TICKS):
        simulation._run.run.tick()
    tell([name for name in {LIBRARIES} if name in sys.modules])

Simulation._start = stop  # imports come when twin would have them
main()
"""
_FIRST_TICK = f"TICKS = 1{_STARTED}"
_LATER = f"TICKS = 100{_STARTED}"
_AGAIN = f"""{_TOLD}
from pathlib import Path
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import load

def start(file):
    began = cpu()
    run = OpenRun(load(Path(file)), out=Path(sys.argv[3]))
    run.run.tick()
    took = cpu() - began
    run.close()
    return took

start(sys.argv[1])
first = cpu()
tell(first, start(sys.argv[1]), start(sys.argv[2]))
"""


def told(code: str, *args: str) -> list[Any]:
    """Return what a process says of itself: its CPU time [s], and more."""
    warm = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-c", code, *args]
    run = subprocess.run(command, capture_output=True, check=True, text=True, env=warm)
    answer: list[Any] = json.loads(run.stdout.splitlines()[-1])
    return answer


def imports(libraries: Sequence[str]) -> float:
    """Return the CPU time [s] of bare imports."""
    took: float = told(f"import {', '.join(libraries)}\n{_TOLD}\ntell()")[0]
    return took


def help_text() -> float:
    """Return the CPU time [s] of `twin --help`."""
    code = f"import atexit\n{_TOLD}\natexit.register(tell)\nfrom twin.cli import main\nmain()"
    took: float = told(code, "--help")[0]
    return took


def table(rows: Sequence[tuple[str, float, float]]) -> None:
    """Print what each thing took, and its ratio to its limit."""
    for name, took, limit in rows:
        print(f"{name:48}{took:8.2f}{limit:8.2f}{took / limit:8.2f}")


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    names = ["warehouse.yaml", "diff_bot_figure8.yaml", "warehouse_patrol.yaml"]
    parser.add_argument("scenarios", nargs="*", type=Path, default=[SCENARIOS / name for name in names])
    parser.add_argument("--rounds", type=int, default=5, help="best of so many (default: 5)")
    options = parser.parse_args()
    files = [str(file) for file in options.scenarios]
    others = [*files[1:], files[0]]
    with tempfile.TemporaryDirectory() as folder:
        # This also fills the caches.
        needed = {file: told(_FIRST_TICK, "run", file, "--out", folder)[1] for file in files}
        later = {file: told(_LATER, "run", file, "--out", folder)[1] for file in files}
        best: dict[str, float] = {}

        def took(name: str, cpu: float) -> None:
            best[name] = min(cpu, best.get(name, cpu))

        for _ in range(options.rounds):
            for file, libraries in needed.items():
                took(f"imports {file}", imports(libraries))
                took(f"later {file}", imports(later[file]))
                took(f"start {file}", told(_FIRST_TICK, "run", file, "--out", folder)[0])
            for file, other in zip(files, others, strict=True):
                _, first, again, further = told(_AGAIN, file, other, folder)
                took(f"first {file}", first)
                took(f"again {file}", again)
                took(f"other {other} {file}", further)
            took("typer, rich", imports(["typer", "rich"]))
            took("help", help_text())
    print(f"{f'best of {options.rounds}':48}{'CPU s':>8}{'limit':>8}{'ratio':>8}")
    for file, libraries in needed.items():
        name = Path(file).stem
        rows = [(f"{name}: to the first tick", best[f"start {file}"], best[f"imports {file}"])]
        rows += [(f"{name}: to all that it loads later", best[f"start {file}"], best[f"later {file}"])]
        rows += [(f"{name}: again, to the first", best[f"again {file}"], best[f"first {file}"])]
        before = files[others.index(file)]
        rows += [
            (f"{name}: after {Path(before).stem}", best[f"other {file} {before}"], best[f"first {file}"])
        ]
        table(rows)
        print(f"    libraries: {', '.join(libraries)}")
        print(f"    and later: {', '.join(name for name in later[file] if name not in libraries)}")
    table([("twin --help", best["help"], best["typer, rich"])])


if __name__ == "__main__":
    main()
