"""`make soak`: kilometres of random goals among people, with what went wrong and how memory grew.

python -m benchmarks.measures.soak --km 60 --leg-km 4 --workers 2
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

SCENARIO = Path(__file__).parents[2] / "scenarios" / "warehouse_patrol.yaml"
MAX_RECOVERIES_PER_KM = 1.0
MAX_GROWTH_MB = 30.0
"""Of a leg's resident memory between its first tenth and its end."""


@dataclass(frozen=True)
class Leg:
    """One run of some kilometres, in a process of its own."""

    seed: int
    km: float
    hours: float
    recoveries: int
    collision_N: float
    localisation_mm: float
    real_time_factor: float
    early_mb: float
    late_mb: float
    digest: str
    reasons: tuple[str, ...]


def drive(seed: int, km: float) -> Leg:
    """Run one leg."""
    from twin.runtime import Progress, run
    from twin.scenario import schema

    overrides = {
        "seed": str(seed),
        "mission.distance": f"{km * 1000:g} m",
        "mission.max_failed": "1000000",
        "duration": f"{km * 6000:g} s",
    }
    memory: list[float] = []

    def note(_progress: Progress) -> None:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        memory.append(pages * 4096 / 1e6)

    verdict = run(schema.load(SCENARIO, overrides), record=False, progress=note)
    checks = {check.name: check for check in verdict.checks}
    return Leg(
        seed=seed,
        km=(checks["driven_distance"].value or 0.0) / 1000.0,
        hours=verdict.metrics["sim_time_s"] / 3600.0,
        recoveries=int(verdict.metrics["recoveries"]),
        collision_N=checks["no_collision"].value or 0.0,
        localisation_mm=(checks["localisation_error"].value or 0.0) * 1e3,
        real_time_factor=verdict.metrics["real_time_factor"],
        early_mb=memory[len(memory) // 10],
        late_mb=memory[-1],
        digest=(verdict.digest or "")[:12],
        reasons=tuple(check.reason for check in verdict.checks if not check.passed),
    )


def main() -> int:
    """Drive all legs; 1 if anything was touched, too much recovered, a way not driven, or memory grew."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--km", type=float, default=60.0)
    parser.add_argument("--leg-km", type=float, default=4.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=1)
    options = parser.parse_args()
    legs: list[Leg] = []
    seeds = range(options.first_seed, options.first_seed + round(options.km / options.leg_km))
    print("seed     km  hours  recoveries  collision  localisation  real time  memory  digest")
    with ProcessPoolExecutor(options.workers) as pool:
        for future in as_completed([pool.submit(drive, seed, options.leg_km) for seed in seeds]):
            leg = future.result()
            legs.append(leg)
            print(
                f"{leg.seed:4d} {leg.km:6.2f} {leg.hours:6.2f} {leg.recoveries:11d} {leg.collision_N:8.0f} N "
                f"{leg.localisation_mm:10.1f} mm {leg.real_time_factor:9.1f}x {leg.early_mb:5.0f} -> "
                f"{leg.late_mb:.0f} MB  {leg.digest}  {'; '.join(leg.reasons)}",
                flush=True,
            )
    km, recoveries = sum(leg.km for leg in legs), sum(leg.recoveries for leg in legs)
    collisions = sum(leg.collision_N > 0.0 for leg in legs)
    growth = max(leg.late_mb - leg.early_mb for leg in legs)
    hours = sum(leg.hours for leg in legs)
    print(
        f"{km:.1f} km in {hours:.1f} h: {recoveries / km:.2f} recoveries/km, {collisions} legs with a "
        f"collision, memory grew by {growth:.0f} MB at most"
    )
    whole = km > 0.99 * len(legs) * options.leg_km
    return int(
        not whole or recoveries / km > MAX_RECOVERIES_PER_KM or collisions > 0 or growth > MAX_GROWTH_MB
    )


if __name__ == "__main__":
    sys.exit(main())
