"""What the tables of the physics step say of runs that are known."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.measures.time_step import Trial, closed_loop, pendulum_drift

KNOWN = Trial(
    scenario="warehouse",
    seed=1,
    step_ms=2,
    failed=(),
    docked_mm=(3.0, 1.0),
    docked_deg=(0.1, 0.2),
    slip_mm=0.5,
    work_J=300.0,
    localisation_mm=10.0,
    simulated_s=70.0,
)


def test_a_row_counts_what_passed_and_shows_the_worst() -> None:
    slipped = replace(KNOWN, seed=2, failed=("slipped",), docked_mm=(4.0, 1.0), slip_mm=2.5, work_J=310.0)
    row = closed_loop("warehouse", [KNOWN, slipped, replace(KNOWN, step_ms=4)]).splitlines()[2]
    assert row == "| 2 ms | 1 of 2 | 3.5, 4.0; 1.0, 1.0 | 0.20 | 2.50 | 305 | 10.0 | 70.0 |"


def test_a_free_pendulum_loses_more_energy_in_longer_steps() -> None:
    assert -0.01 < pendulum_drift(4) < pendulum_drift(2) < 0.0
