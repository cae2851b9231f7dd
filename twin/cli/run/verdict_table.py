"""A verdict as a table for people; works on the content of `verdict.json`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.scenario.quantities import seconds
from twin.scenario.verdict_text import numbers_of, reasons

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

_LONGEST = 60
"""Characters of a check's name on a terminal; what fails is named in full below."""

STYLE = {"pass": "bold green", "fail": "bold red", "error": "bold magenta", "inconclusive": "bold yellow"}


def verdict_report(verdict: Mapping[str, Any], folder: Path | None, *, short: bool = False) -> Group:
    """Return the table of the checks of one run, then the verdict, then what was written.

    Args:
        verdict: As in its file.
        folder: Of the run.
        short: Whether long names of checks are cut, as a terminal needs it.
    """
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    table = Table(title=f"{verdict['scenario']}, seed {verdict['seed']}", title_justify="left", box=None)
    table.add_column("")
    table.add_column("check", max_width=_LONGEST if short else None)
    for column in ("value", "limit", "margin", "at"):
        table.add_column(column, justify="right", no_wrap=True)
    for check in verdict["checks"]:
        mark = Text("ok", style="green") if check["passed"] else Text("FAIL", style="bold red")
        called = Text(check["name"], no_wrap=True, overflow="ellipsis")
        table.add_row(mark, called, *numbers_of(check))
    lines: list[Table | Text] = [table] if verdict["checks"] else []
    lines += [_faults(verdict["faults"])] if verdict["faults"] else []
    lines += [Text(reason, style="red") for reason in reasons(verdict)]
    lines.append(_summary(verdict))
    if losses := verdict["metrics"].get("pace_losses"):
        times = "once" if losses == 1 else f"{losses:.0f} times"
        lost = f"the pace was lost {times}, {verdict['metrics']['pace_lost_s']:.1f} s in all"
        lines.append(Text(lost, style="yellow"))
    if folder is not None:
        lines.append(Text(f"written to {folder}", style="dim"))
    return Group(*lines)


_OUTCOME = {"landed": "green", "no_effect": "yellow", "not_reached": "yellow"}


def _faults(faults: Sequence[Mapping[str, Any]]) -> Table:
    """Return the table of what became of each fault."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None)
    for name, justify in (("outcome", "left"), ("fault", "left"), ("from", "right"), ("to", "right")):
        table.add_column(name, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    table.add_column("effect")
    for fault in faults:
        outcome = Text(fault["outcome"].replace("_", " "), style=_OUTCOME[fault["outcome"]])
        times = (seconds(fault[key], 2) for key in ("at_s", "end_s"))
        table.add_row(outcome, Text(fault["name"]), *times, Text(fault["effect"]))
    return table


def many_report(verdicts: Sequence[Mapping[str, Any]], folder: Path | None = None) -> Group:
    """Return one line per run, why some did not pass and how to make these again, and what was written."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None)
    for name in ("", "test"):
        table.add_column(name, no_wrap=True)
    for name in ("seed", "simulated", "wall", "digest"):
        table.add_column(name, no_wrap=True, justify="right")
    for verdict in verdicts:
        metrics = verdict["metrics"]
        table.add_row(
            Text(verdict["verdict"].upper(), style=STYLE[verdict["verdict"]]),
            Text(_name(verdict)),
            str(verdict["seed"]),
            seconds(metrics.get("sim_time_s")),
            seconds(metrics.get("wall_time_s")),
            (verdict["digest"] or "")[:12],
        )
    said = []
    idle: dict[tuple[str, str, str], list[str]] = {}
    for verdict in verdicts:
        said += [Text(f"{_name(verdict)}: {reason}", style="red") for reason in reasons(verdict)]
        if verdict["verdict"] != "pass" and verdict["command"]:
            said.append(Text(f"  run it again: {verdict['command']}", style="dim"))
        for fault in verdict["faults"]:
            if fault["outcome"] != "landed":
                which = (fault["name"], _told(fault), _OUTCOME[fault["outcome"]])
                idle.setdefault(which, []).append(_name(verdict))
    for (fault, told, style), names in idle.items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        said.append(Text(f"{names[0]}{more}: the fault {fault} {told}", style=style))
    passed = sum(verdict["verdict"] == "pass" for verdict in verdicts)
    style = STYLE["pass" if passed == len(verdicts) else "fail"]
    lines = [*said, Text(f"{passed} of {len(verdicts)} passed", style=style)]
    if folder is not None:
        lines.append(Text(f"written to {folder}; `twin report {folder}` makes a page of it", style="dim"))
    return Group(table, *lines)


def _told(fault: Mapping[str, Any]) -> str:
    return "did not happen" if fault["outcome"] == "not_reached" else f"had no effect: {fault['effect']}"


def _name(verdict: Mapping[str, Any]) -> str:
    return str(verdict["test"] or verdict["scenario"])


def _summary(verdict: Mapping[str, Any]) -> Text:
    from rich.text import Text

    metrics = verdict["metrics"]
    parts = [f"{metrics['sim_time_s']:.1f} s simulated"] if "sim_time_s" in metrics else []
    if "wall_time_s" in metrics:
        parts.append(f"in {metrics['wall_time_s']:.1f} s")
    if "real_time_factor" in metrics:
        parts.append(f"({metrics['real_time_factor']:.1f}x real time)")
    text = Text(verdict["verdict"].upper(), style=STYLE[verdict["verdict"]])
    text.append("  " + " ".join(parts), style="not bold default")
    if verdict["digest"] is not None:
        text.append(f"  digest {verdict['digest'][:12]}", style="not bold dim default")
    if verdict["clock"] != "inproc":
        text.append(f"  clock {verdict['clock']}", style="not bold default")
    if not verdict["deterministic"]:
        text.append("  not deterministic", style="not bold yellow")
    return text
