"""Does a verdict ever flip? 200 runs as of `twin test`, half of them beside processes that hog the CPU.

    python -m benchmarks.measures.flips

The shipped scenarios with the tag `quick`, and one with lidar, AMCL and navigation, in warm processes side by
side. Prints how many runs passed and the digests of each test; exits 1 if a verdict or digest differed.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from twin.experiments.suite.cases import Case, cases_in
from twin.experiments.suite.run import run_all
from twin.experiments.suite.selection import selected

RUNS = 100
"""In each of the two conditions."""
NAVIGATING = 5
"""Of them with navigation."""
SCENARIOS = Path(__file__).parents[2] / "scenarios"


def hog() -> None:
    """Compute for ever."""
    value = 1.0
    while True:
        value = value * 1.0000001 % 3.0


@contextmanager
def hogs(count: int) -> Iterator[None]:
    """Let so many processes compute during the block."""
    processes = [multiprocessing.Process(target=hog, daemon=True) for _ in range(count)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.terminate()
            process.join()


def cases() -> list[Case]:
    """Return the tests of one condition."""
    quick = selected(cases_in(sorted(SCENARIOS.glob("*.yaml"))), tags="quick")
    (navigating,) = cases_in([SCENARIOS / "warehouse_charger.yaml"])
    many = [quick[i % len(quick)] for i in range(RUNS - NAVIGATING)]
    step = len(many) // NAVIGATING
    return [case for i, each in enumerate(many) for case in ([navigating, each] if i % step == 0 else [each])]


def main() -> int:
    """Run, print, and return the exit code."""
    cores = len(os.sched_getaffinity(0))
    seen: dict[str, set[tuple[str, str | None]]] = defaultdict(set)
    for name, count in (("alone", 0), (f"beside {cores} hogs", cores)):
        with hogs(count), tempfile.TemporaryDirectory() as folder:
            passed = 0
            tests = cases()
            for case, result in zip(tests, run_all(tests, Path(folder), jobs=cores), strict=True):
                passed += result["verdict"] == "pass"
                seen[case.name].add((result["verdict"], result["digest"]))
        print(f"{name}: {passed} of {len(tests)} passed", flush=True)
    for name, outcomes in seen.items():
        told = sorted(f"{word} {str(digest)[:12]}" for word, digest in outcomes)
        print(f"{name}: {', '.join(told)}")
    return int(any(len(outcomes) > 1 for outcomes in seen.values()))


if __name__ == "__main__":
    sys.exit(main())
