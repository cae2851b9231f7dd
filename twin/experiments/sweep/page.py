"""The report of a sweep: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib.metadata import version
from itertools import islice

from twin.experiments.report.drawing import trajectory
from twin.experiments.report.html import badge, cell, page, table
from twin.experiments.report.told import read_run
from twin.experiments.short_names import short_names
from twin.experiments.sweep.plan import PlannedRun
from twin.experiments.sweep.plots import plots
from twin.experiments.sweep.result import SweepResult
from twin.experiments.sweep.summary import PointSummary, SweepSummary, command
from twin.scenario.verdict_text import reasons

_MOST_POINTS, _MOST_FAILURES = 500, 40


def report_page(result: SweepResult, summary: SweepSummary) -> str:
    """Return the page of a sweep whose runs are all there: HTML with everything in it."""
    parts = [
        *_head(result, summary),
        *_points(result, summary),
        *_plots(result),
        *_failures(result),
        *_made(result),
    ]
    footer = f"Written by <code>twin sweep</code> of twin {escape(version('twin'))}."
    return page(f"{summary.scenario}: sweep", "\n".join(parts), footer)


def _head(result: SweepResult, summary: SweepSummary) -> Iterable[str]:
    yield f"<h1>{badge(summary.outcome)}{escape(summary.scenario)}</h1>"
    passed = sum(point.passed for point in summary.points)
    said = f"{passed} of {summary.runs} runs passed"
    if summary.claim:
        asked = f"at least {100 * summary.claim['min']:g} % of the runs of each point pass"
        said += f". Asked was whether {asked}, with a confidence of {100 * summary.claim['confidence']:g} %"
        if summary.runs < summary.planned:
            said += f"; {summary.planned - summary.runs} more runs were not needed for the answer"
    yield f"<p>{said}.</p>"
    if result.different:
        again = f"{len(result.different)} runs gave another digest when they were made again"
        yield f"<p><b>Not deterministic:</b> {again}.</p>"


def _points(result: SweepResult, summary: SweepSummary) -> Iterable[str]:
    points = summary.points[:_MOST_POINTS]
    keys = list(points[0].values)
    checks = list(dict.fromkeys(name for point in points for name in point.medians))
    sure = summary.claim["confidence"] if summary.claim else 0.95
    rows = []
    for point in points:
        numbers = [*map(escape, point.values.values()), str(point.runs)]
        numbers.append(f"{100 * point.passed / point.runs:.4g} %")
        failures = "<br>".join(escape(f"{name} {count}") for name, count in point.failures.items())
        cells = [
            f"<td>{badge(point.outcome)}</td>",
            *map(_number, numbers),
            f"<td>{_bar(point, summary)}</td>",
        ]
        cells.append(_number(f"{100 * point.least:.1f} to {100 * point.most:.1f} %"))
        cells.append(f"<td class=fail>{failures}</td>")
        cells += [_number(escape(result.table.shown(name, point.medians.get(name)))) for name in checks]
        rows.append(["", *cells])
    what = "bounds of the pass rate that hold at any time, each" if summary.claim else "Clopper-Pearson,"
    medians = " Columns with names of checks: medians of what they measured." if checks else ""
    says = f"Interval: {what} at {100 * sure:g} %.{medians}"
    heads = ["", *short_names(keys).values(), "runs", "passed", "", f"{100 * sure:g} % interval", "failed"]
    yield "<h2>Pass rates</h2>"
    yield table(says, [*heads, *checks], rows, right={*heads[1:-1], *checks})
    if len(summary.points) > len(points):
        shown = f"The first {len(points)} of {len(summary.points)} points"
        yield f"<p class=quiet>{shown}; all are in summary.json.</p>"


def _number(text: str) -> str:
    return f"<td class=number>{text}</td>"


def _bar(point: PointSummary, summary: SweepSummary) -> str:
    rate = point.passed / point.runs
    inside = f"<i style='left:{100 * point.least:.1f}%;right:{100 - 100 * point.most:.1f}%'></i>"
    inside += f"<b style='left:{100 * rate:.1f}%'></b>"
    if summary.claim:
        inside += f"<s style='left:{100 * summary.claim['min']:.1f}%'></s>"
    return f"<span class=rate>{inside}</span>"


def _plots(result: SweepResult) -> Iterable[str]:
    for title, svg in plots(result.table, [axis.key for axis in result.plan.axes]):
        yield f"<h2>{escape(title[:1].upper() + title[1:])}</h2>{svg}"


def _failures(result: SweepResult) -> Iterable[str]:
    failing = ((run, verdict) for run, verdict in result.runs if verdict["verdict"] != "pass")
    shown = list(islice(failing, _MOST_FAILURES + 1))
    if not shown:
        return
    yield "<h2>Runs that did not pass</h2>"
    yield from _pictures(result, [run for run, _ in shown])
    rows = [
        ["", cell("; ".join(reasons(verdict))), f"<td><code>{escape(command(result.plan, run))}</code></td>"]
        for run, verdict in shown[:_MOST_FAILURES]
    ]
    yield table("", ["why", "again"], rows)
    if len(shown) > _MOST_FAILURES:
        yield f"<p class=quiet>The first {_MOST_FAILURES}; all are in results.parquet.</p>"


def _pictures(result: SweepResult, runs: Iterable[PlannedRun]) -> Iterable[str]:
    yield "<div class=paths>"
    for run in runs:
        recording = result.folder.recording(run)
        told = None if recording is None else read_run(recording.parent)
        if recording is None or told is None or not told.robots:
            continue  # a recording is for people; the run's verdict stands without
        values = ", ".join(f"{key}={value}" for key, value in result.plan.points[run.point].items())
        where = f"twin play {recording.relative_to(result.folder.path)}"
        caption = escape(f"{values}{', ' if values else ''}seed {run.seed}")
        yield f"<figure>{trajectory(told, told.moments, (4.8, 3.8))}"
        yield f"<figcaption>{caption}<br><code>{escape(where)}</code></figcaption></figure>"
    yield "</div>"


def _made(result: SweepResult) -> Iterable[str]:
    plan = result.plan
    yield f"<h2>How it was made</h2><p class=quiet>twin {escape(version('twin'))}, {escape(plan.file.name)}; "
    seeds = f"{len(plan.seeds)} seeds: {plan.seeds[0]} to {plan.seeds[-1]}"
    varied = f"over {', '.join(escape(axis.key) for axis in plan.axes)}, " if plan.axes else ""
    yield f"{len(plan.points)} points, {varied}each with up to {seeds}. "
    yield "The table of all runs is results.parquet, what they cost is in costs.parquet beside this page.</p>"
