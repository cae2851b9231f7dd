"""Run a scenario in a process of its own: a crash or a leftover of one run cannot touch the next."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from twin.cli.options import RunOptions


def run_in_child(options: RunOptions, out: Path) -> dict[str, Any]:
    """Return the content of the run's `verdict.json`; a process that dies gives a verdict of error."""
    command = [sys.executable, "-m", "twin.cli", *options.arguments(out)]
    child = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    if child.returncode == 130:
        raise KeyboardInterrupt
    try:
        verdict: dict[str, Any] = json.loads(child.stdout)
    except json.JSONDecodeError:
        from twin.scenario.verdict import Verdict

        said = child.stderr.strip() or "nothing"
        error = f"the run's process ended with code {child.returncode} and said: {said}"
        return Verdict(scenario=options.scenario.stem, seed=0, error=error).to_dict()
    return verdict
