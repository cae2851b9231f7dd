"""How odometry drifts with the speed, as a plot: `python examples/python/parameter_study.py drift.png`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import twin

SPEEDS = (0.2, 0.4, 0.6)
SEEDS = (1, 2)
SCENARIO = Path(__file__).with_name("rover.yaml")


def drift(speed: float, seed: int) -> float:
    """Return how far odometry is off after a quarter of a circle of 1 m radius [mm]."""
    overrides = {"robots.0.navigation": None, "robots.0.localisation": None}  # wheels alone
    with twin.Simulation(SCENARIO, overrides=overrides, seed=seed) as simulation:
        while simulation.time < 0.5 * np.pi / speed:
            simulation.publish("/cmd_vel", {"linear": {"x": speed}, "angular": {"z": speed}})
            simulation.step()
        simulation.run_until(simulation.time + 1.0)
        believed = simulation.wait_for_message("/odom").pose.pose.position
        return 1e3 * float(np.hypot(*(simulation.truth.pose("rover").xyz[:2] - (believed.x, believed.y))))


def main() -> None:
    """Run every speed with every seed, and plot mean and range."""
    try:
        import matplotlib
    except ImportError:
        sys.exit("the plot needs the package matplotlib, which is not installed: pip install matplotlib")
    matplotlib.use("agg")
    from matplotlib import pyplot

    drifts = np.array([[drift(speed, seed) for seed in SEEDS] for speed in SPEEDS])
    for speed, row in zip(SPEEDS, drifts, strict=True):
        print(f"{speed:.1f} m/s: {row.mean():.1f} mm")
    figure, axes = pyplot.subplots()
    axes.errorbar(SPEEDS, drifts.mean(axis=1), yerr=np.ptp(drifts, axis=1) / 2.0, marker="o", capsize=4)
    axes.set(xlabel="speed [m/s]", ylabel="drift [mm]", title="Odometry after a quarter of a circle")
    file = Path(sys.argv[1] if len(sys.argv) > 1 else "drift.png")
    figure.savefig(file)
    print(f"written to {file}")


if __name__ == "__main__":
    main()
