"""What is asked of localisation, and whether it was reached."""

from __future__ import annotations

from dataclasses import dataclass

from twin_benchmarks.amcl.relocation import Relocation
from twin_benchmarks.amcl.tracking import Tracking

MAX_RMS_M, MAX_RMS_DEG, MIN_REAL_TIME, MIN_RIGHT = 0.03, 0.5, 30.0, 0.95
NEES = (1.5, 5.0)


@dataclass(frozen=True)
class Row:
    """One measure; `bar` is empty where nothing is asked."""

    measure: str
    value: str
    bar: str = ""
    passed: bool = True


def rows(tracking: Tracking, anywhere: Relocation, carried: Relocation) -> tuple[Row, ...]:
    """Return the measures in the order to show them."""
    low, high = NEES
    return (
        Row("position, rms", f"{tracking.rms_m:.4f} m", f"<= {MAX_RMS_M} m", tracking.rms_m <= MAX_RMS_M),
        Row("position, max", f"{tracking.max_m:.4f} m"),
        Row("yaw, rms", f"{tracking.rms_deg:.3f}°", f"<= {MAX_RMS_DEG}°", tracking.rms_deg <= MAX_RMS_DEG),
        Row("yaw, max", f"{tracking.max_deg:.3f}°"),
        Row("NEES", f"{tracking.nees:.2f}", f"{low:g} ... {high:g}", low <= tracking.nees <= high),
        Row(
            "filter, x real time",
            f"{tracking.amcl_real_time:.0f}",
            f">= {MIN_REAL_TIME:g}",
            tracking.amcl_real_time >= MIN_REAL_TIME,
        ),
        Row("whole run, x real time", f"{tracking.real_time:.1f}"),
        Row("recoveries", f"{tracking.recoveries}"),
        Row(
            "global localisation",
            f"{anywhere.right}/{anywhere.trials}",
            f">= {MIN_RIGHT:.0%}",
            anywhere.right >= MIN_RIGHT * anywhere.trials,
        ),
        Row("  known after, median / p95 / max", _times(anywhere)),
        Row("kidnapped", f"{carried.right}/{carried.trials}", "all", carried.right == carried.trials),
        Row("  known after, median / p95 / max", _times(carried)),
    )


def _times(found: Relocation) -> str:
    return f"{found.median_s:.1f} / {found.p95_s:.1f} / {found.max_s:.1f} s"
