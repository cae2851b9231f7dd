"""The report of a sweep: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib.metadata import version
from itertools import islice

from twin.errors import RecordingError
from twin.experiments.short_names import short_names
from twin.experiments.sweep.plan import PlannedRun
from twin.experiments.sweep.plots import paths, plots
from twin.experiments.sweep.result import SweepResult
from twin.experiments.sweep.summary import PointSummary, SweepSummary, command
from twin.scenario.verdict_text import reasons

_MOST_POINTS, _MOST_FAILURES = 500, 40
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1c1c1c; margin: 2rem auto }
body { max-width: 72rem; padding: 0 1.5rem }
h1 { font-size: 1.6rem; margin: 0 } h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem }
.outcome { display: inline-block; color: white; border-radius: .3rem; padding: .1rem .7rem; font-weight: 600 }
.pass { background: #2a9d5c } .fail { background: #c8372d } .error { background: #8a3ffc }
.inconclusive { background: #b58105 }
table { border-collapse: collapse; font-variant-numeric: tabular-nums } .wide { overflow-x: auto }
th, td { padding: .25rem .8rem; border-bottom: 1px solid #e4e4e4; text-align: right; white-space: nowrap }
th { font-weight: 600; color: #555 } td.text, th.text { text-align: left; white-space: normal }
td.few { text-align: left; color: #c8372d }
.bar { display: inline-block; width: 7rem; height: .7rem; background: #eee; position: relative }
.bar i { position: absolute; top: 0; bottom: 0; background: #9cb8d3 }
.bar b { position: absolute; top: -.15rem; bottom: -.15rem; width: 3px; background: #1f4e79 }
.bar s { position: absolute; top: -.25rem; bottom: -.25rem; width: 1px; background: #c8372d }
code { background: #f4f4f4; padding: .1rem .35rem; border-radius: .2rem; font-size: .85rem; user-select: all }
svg { max-width: 100%; height: auto }
figure { margin: 0; display: inline-block; width: 22rem; vertical-align: top }
figure { margin-bottom: 1.5rem }
figcaption { font-size: .85rem; color: #555 } .dim { color: #777 }
"""


def report_page(result: SweepResult, summary: SweepSummary) -> str:
    """Return the page of a sweep whose runs are all there: HTML with everything in it."""
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(summary.scenario)}: sweep</title>',
        '<meta name="viewport" content="width=device-width">',
        f"<style>{_STYLE}</style></head><body>",
        *_head(result, summary),
        *_points(summary),
        *_plots(result),
        *_failures(result),
        *_made(result),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _outcome(outcome: str) -> str:
    return f'<span class="outcome {outcome}">{outcome.upper()}</span>'


def _head(result: SweepResult, summary: SweepSummary) -> Iterable[str]:
    yield f"<h1>{escape(summary.scenario)} {_outcome(summary.outcome)}</h1>"
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


def _points(summary: SweepSummary) -> Iterable[str]:
    points = summary.points[:_MOST_POINTS]
    keys = list(points[0].values)
    checks = list(dict.fromkeys(name for point in points for name in point.medians))
    sure = summary.claim["confidence"] if summary.claim else 0.95
    yield "<h2>Pass rates</h2><div class=wide><table><tr><th></th>"
    yield from (f"<th title='{escape(key)}'>{escape(name)}</th>" for key, name in short_names(keys).items())
    yield f"<th>runs</th><th>passed</th><th></th><th>{100 * sure:g} % interval</th>"
    yield "<th class=text>failed</th>"
    yield from (f"<th>{escape(name)}</th>" for name in checks)
    yield "</tr>"
    for point in points:
        yield f"<tr><td class=text>{_outcome(point.outcome)}</td>"
        yield from (f"<td>{escape(value)}</td>" for value in point.values.values())
        rate = f"{100 * point.passed / point.runs:.4g} %"
        yield f"<td>{point.runs}</td><td>{rate}</td><td>{_bar(point, summary)}</td>"
        yield f"<td>{100 * point.least:.1f} to {100 * point.most:.1f} %</td>"
        failures = "<br>".join(escape(f"{name} {count}") for name, count in point.failures.items())
        yield f"<td class=few>{failures}</td>"
        yield from (f"<td>{_number(point.medians.get(name))}</td>" for name in checks)
        yield "</tr>"
    yield "</table></div>"
    what = "bounds of the pass rate that hold at any time, each" if summary.claim else "Clopper-Pearson,"
    medians = " Columns with names of checks: medians of what they measured." if checks else ""
    yield f"<p class=dim>Interval: {what} at {100 * sure:g} %.{medians}</p>"
    if len(summary.points) > len(points):
        shown = f"The first {len(points)} of {len(summary.points)} points"
        yield f"<p class=dim>{shown}; all are in summary.json.</p>"


def _bar(point: PointSummary, summary: SweepSummary) -> str:
    rate = point.passed / point.runs
    inside = f"<i style='left:{100 * point.least:.1f}%;right:{100 - 100 * point.most:.1f}%'></i>"
    inside += f"<b style='left:calc({100 * rate:.1f}% - 1px)'></b>"
    if summary.claim:
        inside += f"<s style='left:{100 * summary.claim['min']:.1f}%'></s>"
    return f"<span class=bar>{inside}</span>"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


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
    yield "<div class=wide><table><tr><th class=text>why</th><th class=text>again</th></tr>"
    for run, verdict in shown[:_MOST_FAILURES]:
        again = escape(command(result.plan, run))
        why = escape("; ".join(reasons(verdict)))
        yield f"<tr><td class=text>{why}</td><td class=text><code>{again}</code></td></tr>"
    yield "</table></div>"
    if len(shown) > _MOST_FAILURES:
        yield f"<p class=dim>The first {_MOST_FAILURES}; all are in results.parquet.</p>"


def _pictures(result: SweepResult, runs: Iterable[PlannedRun]) -> Iterable[str]:
    for run in runs:
        recording = result.folder.recording(run)
        if recording is None:
            continue
        try:
            svg = paths(recording)
        except RecordingError:
            continue  # it is there for people; the run's verdict stands
        if svg is not None:
            values = ", ".join(f"{key}={value}" for key, value in result.plan.points[run.point].items())
            where = f"twin play {recording.relative_to(result.folder.path)}"
            caption = f"{values}{', ' if values else ''}seed {run.seed}<br>"
            yield f"<figure>{svg}<figcaption>{caption}<code>{escape(where)}</code></figcaption></figure>"


def _made(result: SweepResult) -> Iterable[str]:
    plan = result.plan
    yield f"<h2>How it was made</h2><p class=dim>twin {escape(version('twin'))}, {escape(plan.file.name)}; "
    seeds = f"{len(plan.seeds)} seeds: {plan.seeds[0]} to {plan.seeds[-1]}"
    yield f"{len(plan.points)} points, each with up to {seeds}. "
    yield "The table of all runs is results.parquet, what they cost is in costs.parquet beside this page.</p>"
