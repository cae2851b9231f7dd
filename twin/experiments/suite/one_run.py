"""One run of a suite, in whatever process: its verdict, what it printed, and what is told of its test."""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from twin.errors import TwinError
from twin.experiments.suite.cases import Case
from twin.files.writing import make_folder
from twin.plugins import execution
from twin.runtime.open_run import run
from twin.scenario.schema import load
from twin.scenario.verdict import VERDICT, Verdict

OUTPUT = "output.txt"
"""What a run printed, in its folder."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """What a process is given to do."""

    number: int
    case: Case
    folder: Path
    """Of the results; it is there."""
    record: bool = False


def perform(job: Job) -> Mapping[str, Any]:
    """Run, write the verdict into the run's folder, and return it; what is printed goes to a file there."""
    output = job.folder / OUTPUT
    with output.open("w", encoding="utf-8") as file:
        for number in (1, 2):
            os.dup2(file.fileno(), number)
    (job.folder / VERDICT).unlink(missing_ok=True)
    verdict = _verdict(job)
    sys.stdout.flush()
    sys.stderr.flush()
    return written(verdict, job)


def _verdict(job: Job) -> Verdict:
    name, seed = job.case.scenario, job.case.seed
    with execution() as executed:
        try:
            scenario = load(job.case.file, job.case.overrides, execute=True)
            name, seed = scenario.name, scenario.seed
            return run(scenario, out=job.folder, record=job.record)
        except TwinError as fault:
            error = str(fault)
        except Exception as bug:  # ours, or one of a user's node
            traceback.print_exc()
            error = f"{type(bug).__name__}: {bug} (all of it: {job.folder / OUTPUT})"
    return Verdict(scenario=name, seed=seed, error=error, plugins=executed.versions)


def broken(job: Job, error: str) -> Mapping[str, Any]:
    """Write and return the verdict of a run that was not made, or did not come back."""
    return written(Verdict(scenario=job.case.scenario, seed=job.case.seed, error=error), job)


def written(verdict: Verdict, job: Job) -> Mapping[str, Any]:
    """Write a verdict with what is told of its test, and return the content of `verdict.json`."""
    output = make_folder(job.folder) / OUTPUT
    if output.exists() and output.stat().st_size == 0:
        output.unlink()
    verdict = replace(verdict, test=job.case.name, command=job.case.command)
    verdict.write(job.folder)
    content: dict[str, Any] = json.loads(verdict.to_json())
    return content
