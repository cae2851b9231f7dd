"""One run of a sweep, in whatever process or machine: its folder appears whole, with its verdict, or not."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from twin.errors import RecordingError, TwinError
from twin.plugins import execution
from twin.scenario.schema import load
from twin.scenario.verdict import VERDICT, Verdict


@dataclass(frozen=True, kw_only=True)
class Job:
    """What a process is given to do."""

    scenario: Path
    """Absolute."""
    name: str
    overrides: Mapping[str, str]
    """With the seed."""
    folder: Path
    """That is to appear."""
    workshop: Path
    """On the same disk: where it is made."""
    record: bool = False
    """Whether there is to be a recording in it."""


def perform(job: Job) -> dict[str, Any]:
    """Run, put the run's folder in its place, and return its verdict.

    Raises:
        RecordingError: The folder cannot be written; no run is to blame.
    """
    with appearing(job) as made:
        return _written(_verdict(job, made), made)


@contextmanager
def appearing(job: Job) -> Iterator[Path]:
    """Yield a folder that is the run's afterwards, with all that was written into it.

    If somebody else was faster, that folder stays; it gets a recording that it lacks.

    Raises:
        RecordingError: It cannot be written.
    """
    made = None
    try:
        job.workshop.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=f"{job.folder.name}-", dir=job.workshop))
        yield made
        made.chmod(0o755)
        if job.folder.is_dir():
            for recording in made.glob("*.rrd"):
                recording.replace(job.folder / recording.name)
            return
        try:
            made.rename(job.folder)
        except OSError:
            if not job.folder.is_dir():
                raise
    except OSError as fault:
        raise RecordingError(f"{job.folder.parent}: cannot be written: {fault.strerror}") from None
    finally:
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)


def _written(verdict: Verdict, folder: Path) -> dict[str, Any]:
    text = verdict.to_json()
    (folder / VERDICT).write_text(text, encoding="utf-8")
    content: dict[str, Any] = json.loads(text)
    return content


def _verdict(job: Job, made: Path) -> Verdict:
    from twin.runtime.open_run import run  # who plans and waits does without

    try:
        with execution():
            scenario = load(job.scenario, job.overrides, execute=True)
            return run(scenario, out=made if job.record else None, record=job.record)
    except (RecordingError, OSError):
        raise
    except TwinError as fault:
        reason = str(fault)
    except Exception as fault:  # a bug, ours or of a user's node: the other runs go on
        reason = f"{type(fault).__name__}: {fault}"
    return _broken(job, reason)


def lost(job: Job, reason: str) -> dict[str, Any]:
    """Put the folder of a run that gave no result, and return its verdict; raises RecordingError."""
    with appearing(job) as made:
        return _written(_broken(job, reason), made)


def _broken(job: Job, reason: str) -> Verdict:
    return Verdict(scenario=job.name, seed=int(job.overrides["seed"]), error=reason)


def carried(job: Job) -> dict[str, bytes]:
    """Run on a machine that need not share a disk with who asked; return the files of the run's folder."""
    os.chdir(job.scenario.parent)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / job.folder.name
        perform(Job(**{**vars(job), "folder": folder, "workshop": Path(place) / "workshop"}))
        return {file.name: file.read_bytes() for file in folder.iterdir()}
