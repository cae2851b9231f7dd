"""The pages: of one run, and of many with the failures first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from html import escape
from pathlib import Path
from typing import Any

from twin.errors import RecordingError, SimulationError
from twin.experiments.report.html import badge, cell, name_cell, page, table
from twin.experiments.report.told import Moment, Told, read_run
from twin.files.writing import check_file, write_whole
from twin.scenario.quantities import seconds
from twin.scenario.verdict import VERDICT, runs_in
from twin.scenario.verdict_text import numbers_of, reasons

_MOST_PHOTOS, _MOST_LINES = 6, 200
_MOST_SHOWN = 8
"""Of many runs, those that are shown with pictures."""
_APART_S = 1.0
"""Moments that are nearer to each other are shown in one picture [s]."""


def write_report(folder: Path, file: Path) -> int:
    """Write the page of a run, or of all runs in a folder; return how many runs are in it.

    Raises:
        RecordingError: The folder holds no run, or the file cannot be written.
    """
    if not folder.is_dir():
        raise RecordingError(f"{folder}: no such folder; `twin run` and `twin test` write runs into `runs/`")
    check_file(file)
    if (folder / VERDICT).is_file():
        told = read_run(folder)
        title, body, count = f"{told.title}: {told.word.upper()}", run_section(told, whole=True), 1
    else:
        runs = runs_in(folder)
        title, body, count = f"{len(runs)} runs in {folder.name}", many_section(folder, runs), len(runs)
    made = datetime.now().strftime("%Y-%m-%d %H:%M")
    write_whole(file, page(title, body, f"Written by <code>twin report</code>, {made}."))
    return count


def many_section(folder: Path, runs: Sequence[Path]) -> str:
    """Return what there is to say of many runs: how many passed, a table, then those that did not pass."""
    told = [read_run(run) for run in runs]
    order = {"error": 0, "fail": 1, "pass": 2}
    count = {word: sum(each.word == word for each in told) for word in order}
    sorted_ = sorted(range(len(told)), key=lambda i: order[told[i].word])
    worst = next(word for word in order if count[word])
    bar = "".join(
        f'<span class="{word}" style="width:{100.0 * count[word] / len(told):.2f}%"></span>'
        for word in ("pass", "fail", "error")
        if count[word]
    )
    words = ", ".join(f"{count[word]} {word}" for word in ("pass", "fail", "error") if count[word])
    head = f"<h1>{badge(worst)}{len(told)} runs</h1><p>{words}; in <code>{escape(str(folder))}</code></p>"
    parts = [head, f'<div class="bar" role="img" aria-label="{words}">{bar}</div>']
    shown = [i for i in sorted_ if told[i].word != "pass"][:_MOST_SHOWN]
    rows = [_row_of_run(told[i], f"#run-{i + 1}" if i in shown else "") for i in sorted_]
    parts.append(
        table("All runs, failures first", ["", "run", "seed", "simulated", "took", "what happened"], rows)
    )
    parts += [
        f'<section class="run" id="run-{i + 1}">{run_section(told[i], whole=False)}</section>' for i in shown
    ]
    hidden = sum(each.word != "pass" for each in told) - len(shown)
    if hidden > 0:
        parts.append(f"<p>{hidden} more did not pass; `twin report` shows the page of each folder.</p>")
    return "\n".join(parts)


def run_section(told: Told, *, whole: bool) -> str:
    """Return what there is to say of a run.

    Args:
        told: The run.
        whole: Whether it is the only one of the page.
    """
    level, below = ("h1", "h2") if whole else ("h2", "h3")
    verdict, metrics = told.verdict, told.verdict["metrics"]
    parts = [f"<{level}>{badge(told.word)}{escape(told.title)}</{level}>"]
    facts = [
        ("seed", str(verdict["seed"])),
        ("simulated", seconds(metrics.get("sim_time_s"))),
        ("took", seconds(metrics.get("wall_time_s"))),
        ("finished", told.written),
    ]
    parts.append(
        "<ul class=facts>"
        + "".join(f"<li>{name} <b>{escape(value)}</b></li>" for name, value in facts if value)
        + "</ul>"
    )
    if verdict["error"]:
        parts.append(
            f"<p>The run could not be made or finished:</p><pre>{escape(str(verdict['error']))}</pre>"
        )
    if verdict["checks"]:
        parts += [f"<{below}>Verdict</{below}>", _checks(verdict["checks"])]
    if verdict.get("faults"):
        parts += [f"<{below}>Faults</{below}>", _faults(verdict["faults"])]
    if command := verdict.get("command"):
        parts.append(f"<p>Run it again:</p><pre>{escape(command)}</pre>")
    if told.recording is None:
        parts.append(
            f'<p class="quiet">{escape(told.missing)} Path, speeds and pictures need a recording.</p>'
        )
    else:
        parts += _pictures(told, below)
    if whole:
        parts.append(_made_with(verdict))
    return "\n".join(parts)


def _pictures(told: Told, level: str) -> list[str]:
    from twin.experiments.report.drawing import time_series, trajectory

    parts, moments = [], told.moments
    if told.robots:
        parts += [f"<{level}>Path</{level}>", f"<figure>{trajectory(told, moments)}<figcaption>"]
        parts.append("Where the robot truly was, and where it believed to be. Numbers are the moments below.")
        parts.append("</figcaption></figure>")
    if moments:
        parts += [f"<{level}>Moments worth a look</{level}>", _moments(told, moments)]
    parts += _photos(told, level)
    if series := time_series(told, moments):
        parts += [f"<{level}>Over time</{level}>", f"<figure>{series}</figure>"]
    if told.states:
        times = [[seconds(time, 2) for time in (s.start_s, s.end_s - s.start_s)] for s in told.states]
        rows = [["", *map(_number, two), cell(s.name)] for two, s in zip(times, told.states, strict=True)]
        parts.append(f"<{level}>Mission</{level}>")
        parts.append(table("States of the mission", ["from", "lasts", "state"], rows))
    if told.log:
        parts.append(_log(told))
    return parts


def _photos(told: Told, level: str) -> list[str]:
    """Return pictures of the start, of the moments and of the end, or why there are none."""
    from twin.experiments.report.photos import photo

    if not told.robots:
        return []
    times: dict[float, str] = {}
    for time, name in told.sights:
        near = next((other for other in times if abs(other - time) < _APART_S), None)
        if near is None and len(times) < _MOST_PHOTOS:
            times[time] = name
        elif near is not None and name != told.state_at(near):
            times[near] += f"; {name}"
    figures = []
    for time, name in sorted(times.items()):
        try:
            picture = photo(told, told.robots[0], time)
        except SimulationError as fault:
            return [f'<p class="quiet">{escape(f"Pictures are left out: {fault}.")}</p>']
        if picture is not None:
            text = escape(f"{time:.2f} s, {name}")
            figures.append(
                f'<figure><img src="{picture}" width="640" height="400" alt="The robot at {text}">'
                f"<figcaption>{text}</figcaption></figure>"
            )
    if not figures:
        return []
    return [f"<{level}>Pictures</{level}>", f'<div class="photos">{"".join(figures)}</div>']


def _checks(checks: Sequence[Mapping[str, Any]]) -> str:
    has_margin = any(check.get("margin") is not None for check in checks)
    rows = []
    for check in checks:
        value, limit, margin, at = numbers_of(check)
        numbers = [value, limit, margin, at] if has_margin else [value, limit, at]
        mark = cell("✓ holds", "mark pass") if check["passed"] else cell("✗ fails", "mark fail")
        kind = "" if check["passed"] else "bad"
        rows.append([kind, mark, name_cell(check["name"]), *map(_number, numbers), cell(check["reason"])])
    heads = ["", "check", "value", "limit", *(["margin"] if has_margin else []), "at", "why"]
    return table("Every check must hold for the run to pass", heads, rows)


def _faults(faults: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for fault in faults:
        kind = "mark pass" if fault["outcome"] == "landed" else "mark fail"
        mark = cell(fault["outcome"].replace("_", " "), kind)
        times = (seconds(fault[key], 2) for key in ("at_s", "end_s"))
        rows.append(["", mark, name_cell(fault["name"]), *map(_number, times), cell(fault["effect"])])
    heads = ["", "fault", "from", "to", "effect"]
    return table("What was let go wrong, and what came of it where it acted", heads, rows)


def _made_with(verdict: Mapping[str, Any]) -> str:
    rows = [("digest", verdict["digest"] or "none: the run was not finished"), ("CPU", verdict["cpu"])]
    rows.append(("versions", ", ".join(f"{name} {version}" for name, version in verdict["versions"].items())))
    rows += [(f"plugin {name}", version) for name, version in verdict["plugins"].items()]
    cells = [
        ["", name_cell(name), f"<td><code>{escape(str(value))}</code></td>"] for name, value in rows if value
    ]
    says = (
        "Equal files, seed, versions and class of CPU give an equal digest, to the last bit of every message."
    )
    if not verdict["deterministic"]:
        says = "Other processes could change this run: its digest need not come again."
    return "<h2>Made with</h2>" + table(says, ["what", "which"], cells)


def _moments(told: Told, moments: Iterable[Moment]) -> str:
    rows = []
    for number, moment in enumerate(moments, 1):
        colour = "fail" if moment.bad else "quiet"
        mark = f'<td class="{colour}"><span class="number-mark">{number}</span></td>'
        said = name_cell(moment.title), cell(moment.text), cell(told.state_at(moment.time_s))
        rows.append(["", mark, _number(seconds(moment.time_s, 2)), *said])
    return table("", ["", "at", "what", "why", "mission"], rows)


def _log(told: Told) -> str:
    kinds = {"WARN": "warn", "ERROR": "fail", "CRITICAL": "fail"}
    rows = [
        [
            "",
            _number(seconds(line.time_s, 2)),
            cell(line.level, kinds.get(line.level, "quiet")),
            cell(line.text),
        ]
        for line in told.log[:_MOST_LINES]
    ]
    more = len(told.log) - len(rows)
    caption = f"and {more} lines more, in the recording" if more > 0 else ""
    lines = table(caption, ["at", "level", "text"], rows)
    return f"<details><summary>{len(told.log)} lines of the nodes</summary>{lines}</details>"


def _row_of_run(told: Told, link: str) -> list[str]:
    verdict, metrics = told.verdict, told.verdict["metrics"]
    reason = "; ".join(reasons(verdict)).partition("\n")[0]
    title = escape(told.title)
    if link:
        title = f'<a href="{link}">{title}</a>'
    return [
        "" if told.word == "pass" else "bad",
        cell(told.word.upper(), f"mark {told.word}"),
        f'<th scope="row">{title}</th>',
        *map(_number, (verdict["seed"], *(seconds(metrics.get(f"{of}_time_s")) for of in ("sim", "wall")))),
        cell(reason),
    ]


def _number(text: object) -> str:
    return cell(text, "number")
