"""A sweep as a table for people: a row per point, the worst ones where there are many."""

from __future__ import annotations

from typing import TYPE_CHECKING

from twin.cli.run.verdict_table import STYLE
from twin.experiments.short_names import short_names

if TYPE_CHECKING:
    from rich.console import Group, RenderableType
    from rich.text import Text

    from twin.experiments.sweep.result import SweepResult
    from twin.experiments.sweep.summary import PointSummary, SweepSummary

_ROWS = 24
"""More points than these are not all shown."""
_MEDIANS = 3
"""Checks whose median has a column."""
_WIDTH = 10
"""Characters of such a column, whose name is folded: with two keys the table fits a terminal of 100."""
_AGAIN = 3
"""Commands that are shown."""
_WORST = ("error", "fail", "inconclusive", "pass")


def sweep_report(result: SweepResult, summary: SweepSummary) -> Group:
    """Return the table, what the sweep says, and where more is."""
    from rich.console import Group
    from rich.text import Text

    shown = _shown(summary)
    lines: list[RenderableType] = [_table(result, summary, shown)]
    if len(shown) < len(summary.points):
        lines.append(Text(f"these are the worst of {len(summary.points)} points", style="dim"))
    lines.append(_said(summary))
    if result.different:
        again = f"{len(result.different)} of the runs that were made again had another digest"
        lines.append(Text(f"not deterministic: {again}", style="yellow"))
    lines += [Text(f"fails: {command}", style="dim") for command in summary.failing[:_AGAIN]]
    lines.append(Text(f"written to {result.folder.path}", style="dim"))
    return Group(*lines)


def share_report(result: SweepResult) -> Text:
    """Return what a share of a sweep says that others have to end."""
    from rich.text import Text

    there = f"{len(result.runs)} of {result.plan.size} runs are there"
    return Text(
        f"{result.made} runs made; {there}, the same command without --shard makes the rest and the table"
    )


def _shown(summary: SweepSummary) -> list[PointSummary]:
    points = list(summary.points)
    if len(points) <= _ROWS:
        return points
    worst = sorted(points, key=lambda point: (_WORST.index(point.outcome), point.rate or 0.0))[:_ROWS]
    return [point for point in points if any(point is one for one in worst)]


def _table(result: SweepResult, summary: SweepSummary, shown: list[PointSummary]) -> RenderableType:
    from rich.table import Table
    from rich.text import Text

    table = Table(title=summary.scenario, title_justify="left", title_style="bold", box=None)
    table.add_column("", no_wrap=True)
    for name in short_names(list(summary.points[0].values)).values():
        table.add_column(name, justify="right", no_wrap=True)
    sure = summary.claim["confidence"] if summary.claim else 0.95
    table.add_column("passed", justify="right", no_wrap=True)
    table.add_column(f"{100 * sure:.4g} % interval", justify="right", no_wrap=True)
    checks = list(dict.fromkeys(name for point in shown for name in point.medians))[:_MEDIANS]
    for name in checks:
        table.add_column(Text(name), justify="right", overflow="fold", max_width=_WIDTH)
    table.add_column("failed", overflow="fold", min_width=_WIDTH)
    for point in shown:
        failures = ", ".join(f"{name} {count}" for name, count in point.failures.items())
        table.add_row(
            Text(point.outcome.upper(), style=STYLE[point.outcome]),
            *map(Text, point.values.values()),
            f"{point.passed} of {point.runs}",
            f"{100.0 * point.least:.1f} to {100.0 * point.most:.1f} %",
            *(result.table.shown(name, point.medians.get(name)) for name in checks),
            Text(failures, style="red"),
        )
    return table


def _said(summary: SweepSummary) -> Text:
    from rich.text import Text

    passed = sum(point.passed for point in summary.points)
    text = Text(summary.outcome.upper(), style=STYLE[summary.outcome])
    parts = [f"  {passed} of {summary.runs} runs passed"]
    if summary.runs < summary.planned:
        parts.append(f"{summary.planned - summary.runs} more were not needed")
    if summary.made < summary.runs:
        parts.append(f"{summary.runs - summary.made} were there before")
    if summary.claim:
        claim = summary.claim
        parts.append(f"asked for: at least {claim['min']:.4g}, with confidence {claim['confidence']:.4g}")
    text.append("; ".join(parts), style="not bold default")
    return text
