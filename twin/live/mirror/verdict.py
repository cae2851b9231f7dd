"""What a mirror's time with physical robots comes to: label, divergence, alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from twin.live.divergence.monitor import Report
from twin.live.mirror.label import LABELS, Label
from twin.scenario.checks import CheckResult
from twin.scenario.provenance import cpu_class, versions
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Verdict

_UNITS = {"position": "m", "yaw": "rad", "prediction": "m"}


def mirror_verdict(
    scenario: Scenario,
    reports: Mapping[str, Report],
    resets: Mapping[str, int],
    label: Label,
    seconds: Mapping[Label, float],
    *,
    is_live: bool,
) -> Verdict:
    """Return the verdict: passed if a robot was heard, no alarm raised, and nothing put elsewhere at once.

    Args:
        scenario: That was mirrored.
        reports: Divergence of each robot.
        resets: How often each virtual robot was put elsewhere at once.
        label: At the end.
        seconds: For how long it was called what [s].
        is_live: Whether the robots were there, or those of a bag.
    """
    checks: list[CheckResult] = []
    metrics = {"sim_time_s": sum(seconds.values())} | {f"{name}_s": seconds.get(name, 0.0) for name in LABELS}
    for robot, report in reports.items():
        checks += _checks(robot, report, resets[robot])
        for name, summary in report.series.items():
            metrics |= {f"{robot}_{name}_{key}": getattr(summary, key) for key in ("rmse", "p95", "max")}
    return Verdict(
        scenario=scenario.name,
        seed=scenario.seed,
        checks=tuple(checks),
        metrics=metrics,
        deterministic=not is_live,
        clock="free" if is_live else "inproc",
        label=label,
        versions=versions(),
        cpu=cpu_class(),
    )


def _checks(robot: str, report: Report, resets: int) -> Sequence[CheckResult]:
    found = [
        CheckResult(
            name=f"divergence_{name}({robot})",
            passed=True,
            value=round(report.series[name].p95, 4),
            unit=unit,
        )
        for name, unit in _UNITS.items()
        if name in report.series
    ]
    alarms = "; ".join(dict.fromkeys(alarm.text for alarm in report.alarms))
    return [
        CheckResult(
            name=f"mirrored({robot})",
            passed="position" in report.series,
            value="position" in report.series,
            reason="" if "position" in report.series else "no pose of a physical robot was heard",
        ),
        *found,
        CheckResult(
            name=f"alarms({robot})",
            passed=not report.alarm_count,
            value=report.alarm_count,
            limit=0,
            reason=alarms,
        ),
        CheckResult(
            name=f"resets({robot})",
            passed=not resets,
            value=resets,
            limit=0,
            reason="the virtual robot was put where the physical one is, at once" if resets else "",
        ),
    ]
