"""The folder of a sweep's results: it is the checkpoint, and where several processes or machines meet.

sweep.json         which sweep this is
runs/KEY/          a run that is over: its verdict, of some its recording; appears whole
locks/KEY          who is at a run now
results.jsonl      a line per run, as they end
results.parquet, costs.parquet, summary.json, report.html   when all runs are there
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import time
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from twin.errors import RecordingError
from twin.experiments.sweep.one_run import Job
from twin.experiments.sweep.plan import Plan, PlannedRun
from twin.files.writing import make_folder, write_whole
from twin.scenario.verdict import VERDICT

SWEEP = "sweep.json"
_TOUCHED_S = 20.0
"""Locks are touched so often [s] ..."""
_STALE_S = 300.0
"""... and one of another machine that was not for so long belongs to nobody [s]."""


class ResultFolder:
    """Where the runs of one plan are, and which of them are taken."""

    def __init__(self, path: Path, plan: Plan) -> None:
        """Make the folder, or take up the one that is there.

        Raises:
            RecordingError: It holds something else, or cannot be written.
        """
        self.path, self._plan = make_folder(path), plan
        self._runs, self._locks = path / "runs", path / "locks"
        self._held: set[str] = set()
        self._touched = time.monotonic()
        told = {
            "sweep": plan.identity,
            "scenario": plan.name,
            "set": {axis.key: axis.values or (axis.low, axis.high) for axis in plan.axes},
            "points": len(plan.points),
            "seeds": len(plan.seeds),
            "twin": version("twin"),
        }
        there = self._there()
        if there is None:
            if any(path.iterdir()):
                raise RecordingError(f"{path}: holds something else than a sweep; name a new folder")
            write_whole(path / SWEEP, json.dumps(told, indent=2) + "\n")
            there = self._there() or {}
        if there.get("sweep") != plan.identity:
            raise RecordingError(
                f"{path}: holds another sweep: {_difference(there, told)}; name a new folder"
            )
        make_folder(self._runs)
        make_folder(self._locks)

    def _there(self) -> dict[str, Any] | None:
        try:
            told = json.loads((self.path / SWEEP).read_bytes())
        except FileNotFoundError:
            return None
        except (OSError, ValueError):
            return {}
        return told if isinstance(told, dict) else {}

    def job(self, run: PlannedRun, *, record: bool) -> Job:
        """Return a run as a process is given it."""
        return Job(
            scenario=self._plan.file,
            name=self._plan.name,
            overrides=self._plan.overrides(run),
            folder=self._runs.resolve() / run.key,
            workshop=self.path.resolve() / "workshop",
            record=record,
        )

    def verdict(self, run: PlannedRun) -> dict[str, Any] | None:
        """Return the verdict of a run; None: it is not over."""
        try:
            found = json.loads((self._runs / run.key / VERDICT).read_bytes())
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) and found.get("seed") == run.seed else None

    def known(self) -> set[str]:
        """Return the keys of all runs that seem to be over."""
        return {entry.name for entry in os.scandir(self._runs)}

    def recording(self, run: PlannedRun) -> Path | None:
        """Return the recording of a run, if there is one."""
        return next(iter(sorted((self._runs / run.key).glob("*.rrd"))), None)

    def take(self, run: PlannedRun) -> bool:
        """Take a run for this process; False: another one is at it.

        Raises:
            OSError: The folder cannot be written.
        """
        lock = self._locks / run.key
        for _ in range(2):
            try:
                descriptor = os.open(lock, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
            except FileExistsError:
                if not _is_stale(lock):
                    return False
                lock.unlink(missing_ok=True)
                continue
            with os.fdopen(descriptor, "w") as stream:
                stream.write(f"{os.getpid()} {socket.gethostname()}")
            self._held.add(run.key)
            return True
        return False

    def release(self, run: PlannedRun) -> None:
        """Let go of a run."""
        self._held.discard(run.key)
        (self._locks / run.key).unlink(missing_ok=True)

    def keep(self) -> None:
        """Tell other machines, now and then, that this process is still at its runs."""
        if time.monotonic() - self._touched > _TOUCHED_S:
            self._touched = time.monotonic()
            for key in self._held:
                with suppress(OSError):
                    os.utime(self._locks / key)

    def close(self) -> None:
        """Let go of all runs."""
        for key in self._held:
            (self._locks / key).unlink(missing_ok=True)
        self._held.clear()

    def tidy(self) -> None:
        """Remove what killed processes have left, when nobody is at a run any more."""
        shutil.rmtree(self.path / "workshop", ignore_errors=True)
        with suppress(OSError):
            self._locks.rmdir()


def _is_stale(lock: Path) -> bool:
    try:
        age, text = time.time() - lock.stat().st_mtime, lock.read_text()
    except OSError:
        return False  # released meanwhile; it is asked for again
    pid, _, host = text.partition(" ")
    if host != socket.gethostname() or not pid.isdecimal():  # or just being written
        return age > _STALE_S
    return not _lives(int(pid))


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # somebody else's
    return True


def _difference(there: dict[str, Any], told: dict[str, Any]) -> str:
    for key, what in (("scenario", "of"), ("set", "over"), ("points", "points:"), ("seeds", "seeds:")):
        if there.get(key) != told[key]:
            was = ", ".join(there[key]) or "seeds alone" if key == "set" and key in there else there.get(key)
            return f"{what} {was}"
    if there.get("twin") != told["twin"]:
        return f"made by twin {there.get('twin')}"
    return "its scenario, a file that it names or its seeds have changed since"
