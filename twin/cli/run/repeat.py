"""Run one scenario many times and compare the digests."""

from __future__ import annotations

import json
import sys
from typing import Any

from twin.cli.console import stderr, stdout
from twin.cli.run.child import run_in_child
from twin.cli.run.folders import results_folder
from twin.cli.run.options import RunOptions


def run_repeatedly(options: RunOptions) -> int:
    """Run some times in fresh processes, print the digests, and return the exit code."""
    from twin.scenario import schema

    runs = max(2, options.repeat)  # one run has nothing to be compared with
    name = "" if options.out else schema.load(options.scenario, options.overrides).name
    verdicts: list[dict[str, Any]] = []
    with results_folder(options.out, name) as parent, stderr().status("") as status:
        for number in range(1, runs + 1):
            status.update(f"run {number} of {runs}")
            verdicts.append(run_in_child(options, parent / str(number)))
    digests = sorted({verdict["digest"] or "none" for verdict in verdicts})
    codes = [{"pass": 0, "fail": 1, "error": 2}[verdict["verdict"]] for verdict in verdicts]
    if options.json:
        sys.stdout.write(json.dumps({"runs": verdicts, "digests": digests}, indent=2) + "\n")
    else:
        _report(verdicts, digests)
    differ = options.expect_one_hash and (len(digests) > 1 or digests == ["none"])
    return max(*codes, 1 if differ else 0)


def _report(verdicts: list[dict[str, Any]], digests: list[str]) -> None:
    from rich.text import Text

    from twin.cli.run.verdict_table import many_report

    console = stdout()
    console.print(many_report(verdicts))
    if len(digests) == 1:
        console.print(Text(f"one digest: {digests[0]}", style="green"))
    else:
        console.print(Text(f"{len(digests)} different digests:", style="red"))
        found = [verdict["digest"] or "none" for verdict in verdicts]
        for digest in digests:
            numbers = [str(number) for number, other in enumerate(found, 1) if other == digest]
            console.print(f"  {digest}  run {', '.join(numbers)}")
