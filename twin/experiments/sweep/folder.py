"""The folder of a sweep's results: it is the checkpoint, and where several processes or machines meet.

- `sweep.json`: which sweep this is.
- `runs/KEY/`: a run that is over, its verdict, of some its recording; it appears whole.
- `locks/KEY`: who is at a run now.
- `results.jsonl`: a line per run, as they end. `output.log`: what they print.
- `results.parquet`, `costs.parquet`, `summary.json`, `report.html`: written when all runs are there.
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
OUTPUT = "output.log"
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
        self._workshop = path.resolve() / "workshop" / f"{socket.gethostname()}-{os.getpid()}"
        self._held: set[str] = set()
        self._touched = time.monotonic()
        told = {
            "sweep": plan.identity,
            "scenario": plan.name,
            "set": {axis.key: [*(axis.values or (axis.low, axis.high))] for axis in plan.axes},
            "points": len(plan.points),
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
            workshop=self._workshop,
            record=record,
        )

    def verdict(self, run: PlannedRun) -> dict[str, Any] | None:
        """Return the verdict of a run; None: it is not over."""
        try:
            found = json.loads((self._runs / run.key / VERDICT).read_bytes())
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) and found.get("seed") == run.seed else None

    def forget(self, run: PlannedRun) -> None:
        """Remove what has become of a run.

        Raises:
            OSError: It cannot be removed.
        """
        shutil.rmtree(self._runs / run.key)

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
        for _ in range(3):
            try:
                descriptor = os.open(lock, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
            except FileNotFoundError:  # tidied by a process that needs nothing any more
                self._locks.mkdir(exist_ok=True)
                continue
            except FileExistsError:
                if not _is_stale(lock):
                    return False
                lock.unlink(missing_ok=True)
                continue
            self._held.add(run.key)  # from now on: a disk that is full leaves no lock of nobody
            with os.fdopen(descriptor, "w") as stream:
                stream.write(f"{socket.gethostname()}-{os.getpid()}")
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
        shutil.rmtree(self._workshop, ignore_errors=True)
        for key in self._held:
            (self._locks / key).unlink(missing_ok=True)
        self._held.clear()

    def tidy(self) -> None:
        """Remove what killed processes of this machine have left, and folders that are empty now."""
        for left in [*self._workshop.parent.glob("*"), *self._locks.glob("*")]:
            if left.is_dir() and not _lives(*left.name.rsplit("-", 1)):
                shutil.rmtree(left, ignore_errors=True)
            elif left.is_file() and _is_stale(left):
                left.unlink(missing_ok=True)
        with suppress(OSError):
            if not (self.path / OUTPUT).stat().st_size:
                (self.path / OUTPUT).unlink()
        for folder in (self._workshop, self._workshop.parent, self._locks):
            with suppress(OSError):
                folder.rmdir()


def _is_stale(lock: Path) -> bool:
    try:
        age, text = time.time() - lock.stat().st_mtime, lock.read_text()
    except OSError:
        return False  # released meanwhile; it is asked for again
    host, _, pid = text.rpartition("-")
    if host != socket.gethostname():  # or just being written
        return age > _STALE_S
    return not _lives(host, pid)


def _lives(host: str, pid: str = "") -> bool:
    """Return whether a process may be alive; it is, if it is not of this machine."""
    try:
        if host == socket.gethostname():
            os.kill(int(pid), 0)
    except (ProcessLookupError, ValueError):
        return False
    except OSError:
        pass  # somebody else's
    return True


def _difference(there: dict[str, Any], told: dict[str, Any]) -> str:
    if there.get("scenario") != told["scenario"]:
        return f"of {there.get('scenario')}"
    was, now = there.get("set") or {}, told["set"]
    if list(was) != list(now):
        return f"over {', '.join(was) or 'seeds alone'}"
    if was != now or there.get("points") != told["points"]:
        return (
            f"with other values of {', '.join(key for key in was if was[key] != now[key]) or 'its samples'}"
        )
    if there.get("twin") != told["twin"]:
        return f"made by twin {there.get('twin')}"
    return "its scenario, or a file that it names, has changed since"
