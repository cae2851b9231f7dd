"""Run a scenario in a process of its own: a crash or a leftover of one run cannot touch the next."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from twin.cli.run.options import RunOptions

COMMAND = (sys.executable, "-m", "twin.cli")
"""How to start another `twin`."""


def run_in_child(options: RunOptions, out: Path) -> dict[str, Any]:
    """Return the content of the run's `verdict.json`; a process that dies gives a verdict of error."""
    child = subprocess.run(
        [*COMMAND, *options.arguments(out)],
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},  # whatever this process's terminal can show
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    if child.returncode == 130:
        raise KeyboardInterrupt
    try:
        verdict: dict[str, Any] = json.loads(child.stdout)
    except json.JSONDecodeError:
        from twin.scenario.verdict import Verdict

        out.mkdir(parents=True, exist_ok=True)
        (out / "stderr.txt").write_text(child.stderr, encoding="utf-8")
        last = (child.stderr.strip() or "no message").splitlines()[-1]
        error = (
            f"the run's process ended with code {child.returncode}: {last} (all of it: {out / 'stderr.txt'})"
        )
        return Verdict(scenario=options.scenario.stem, seed=0, error=error).to_dict()
    return verdict
