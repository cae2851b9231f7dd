"""How much memory a run holds, and whether that grows: a patrol of ten times the warehouse run's length.

`make bench` prints it: resident memory (RSS) at the end of each tenth, with and without recording, each in a
process of its own. What the recording holds until it is sent, and what the allocator keeps, is in it.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

SCENARIO = Path(__file__).parents[2] / "scenarios" / "warehouse_patrol.yaml"
WAREHOUSE_S = 70.0
"""Simulated time of the warehouse scenario."""
TENTHS = 10


def resident_mb() -> float:
    """Return the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    return pages * resource.getpagesize() / 1e6


def patrol(simulated_s: float, record: bool) -> tuple[list[float], float, float]:
    """Run so long; return resident memory after each tenth, its peak, and what was written [MB]."""
    from twin.runtime.open_run import OpenRun
    from twin.scenario.schema import load

    overrides = {"duration": f"{simulated_s:g} s", "mission.distance": "100 km"}
    found = []
    with tempfile.TemporaryDirectory() as folder:
        opened = OpenRun(load(SCENARIO, overrides), out=Path(folder), record=record)
        try:
            for tenth in range(1, TENTHS + 1):
                end_ns = simulated_s * 1e9 * tenth / TENTHS
                opened.advance(lambda end_ns=end_ns: opened.run.world.time_ns >= end_ns)  # type: ignore[misc]
                found.append(resident_mb())
            opened.finish()
        finally:
            opened.close()
        written = sum(file.stat().st_size for file in Path(folder).iterdir()) / 1e6
    return found, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6, written


def main() -> None:
    """Print one line for each run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=float, default=10.0, help="the warehouse run's length (default: 10)")
    simulated_s = parser.parse_args().times * WAREHOUSE_S
    print(f"resident memory [MB] of {simulated_s:g} s of patrol, after each tenth")
    print(f"{'':12}{''.join(f'{tenth:6}' for tenth in range(1, TENTHS + 1))}{'peak':>7}{'written':>9}")
    for record in (False, True):
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            found, peak, written = pool.submit(patrol, simulated_s, record).result()
        name = "recorded" if record else "run"
        print(f"{name:12}{''.join(f'{mb:6.0f}' for mb in found)}{peak:7.0f}{written:9.1f}", flush=True)


if __name__ == "__main__":
    main()
