"""Runs on a Ray cluster: a task each, whose files come back to the folder of the results.

Ray is loaded here alone, when somebody asks for a cluster.
"""

from __future__ import annotations

import atexit
import json
import logging
import os
import socket
import sys
import time
from typing import Any

from twin.errors import SimulationError
from twin.experiments.processes import Lost
from twin.experiments.sweep.one_run import Job, appearing, carried
from twin.scenario.verdict import VERDICT

_ASKED_S = 5.0
"""How often is asked whether the head is still there [s]."""
_REACHED_S = 10.0
"""So long a head may take to answer [s]."""


class RayCluster:
    """As many runs at a time as there are cores; all machines need the scenario where it is here."""

    def __init__(self, address: str, most: int | None = None, *, time_limit_s: float | None = None) -> None:
        """Join.

        Args:
            address: Of the head: `auto` finds the one of this machine, `local` starts one for this sweep.
            most: Runs at a time; None: as many as there are cores.
            time_limit_s: Of a run, from its start in the cluster's queue [s of wall time].

        Raises:
            SimulationError: There is no Ray, or no such cluster.
        """
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        try:
            import ray
        except ImportError:
            raise SimulationError(
                "--ray needs Ray, which is not installed: pip install 'twin[ray]'"
            ) from None
        self._ray, self._time_limit_s = ray, time_limit_s
        try:
            _reach(address)
            ray.init(
                address=None if address == "local" else address,
                include_dashboard=False if address == "local" else None,
                log_to_driver=False,
                logging_level=logging.ERROR,
            )
        except Exception as fault:
            reason = (str(fault).strip() or type(fault).__name__).splitlines()[0]
            raise SimulationError(f"--ray {address}: no such Ray cluster: {reason}") from None
        self._head, self._asked = ray.get_runtime_context().gcs_address, time.monotonic()
        self._is_there = True
        self._count = most or int(ray.cluster_resources().get("CPU", 1))
        # A run that kills its process is told of, and not made four times.
        self._carried = ray.remote(num_cpus=1, max_retries=0)(carried)
        self._jobs: dict[Any, tuple[Job, float]] = {}

    @property
    def busy(self) -> int:
        """How many runs are under way."""
        return len(self._jobs)

    @property
    def free(self) -> int:
        """How many could be started now."""
        return self._count - self.busy

    def start(self, job: Job) -> None:
        """Start a run."""
        deadline = time.monotonic() + (self._time_limit_s or float("inf"))
        self._jobs[self._carried.remote(job)] = job, deadline

    def wait(self, timeout_s: float) -> list[tuple[Job, Any]]:
        """Return runs that have ended, each with its verdict or what was `Lost`.

        Raises:
            RecordingError: A run's files cannot be written here.
            SimulationError: The cluster is gone.
        """
        self._ask()
        ready, _ = self._ray.wait(list(self._jobs), timeout=timeout_s)
        late = [task for task, (_, deadline) in self._jobs.items() if deadline < time.monotonic()]
        return [self._end(task, too_late=task not in ready) for task in {*ready, *late}]

    def close(self) -> None:
        """Leave the cluster; tasks of this sweep end."""
        if self._is_there:
            self._ray.shutdown()
        else:  # Ray would wait for the head, then end this process as if a check had failed
            atexit.unregister(self._ray.shutdown)
            atexit.register(_leave)

    def _ask(self) -> None:
        """Raise SimulationError if the head is gone: Ray would end this process a minute later."""
        if time.monotonic() - self._asked > _ASKED_S:
            try:
                _reach(self._head)
            except OSError as fault:
                self._is_there = False
                raise SimulationError(f"the Ray cluster is gone: {self._head}: {fault.strerror}") from None
            self._asked = time.monotonic()

    def _end(self, task: Any, *, too_late: bool) -> tuple[Job, Any]:
        job, _ = self._jobs.pop(task)
        if too_late:
            self._ray.cancel(task, force=True)
            reason = f"the run took longer than {self._time_limit_s:g} s of wall time"
            return job, Lost(reason=reason, too_long=True)
        try:
            files: dict[str, bytes] = self._ray.get(task)
        except self._ray.exceptions.RayTaskError as fault:
            raise fault.cause from None
        except self._ray.exceptions.WorkerCrashedError:
            return job, Lost(reason="the run's process was killed; the system does so when memory runs out")
        except self._ray.exceptions.OutOfMemoryError:
            return job, Lost(reason="the run's process was killed, as memory ran out")
        except self._ray.exceptions.RayError as fault:
            raise SimulationError(f"the Ray cluster is gone: {str(fault).splitlines()[0]}") from None
        return job, _written(job, files)


def _reach(address: str) -> None:
    """Raise OSError if nobody listens there: Ray itself would wait for minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if colon:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=_REACHED_S):
            pass


def _leave() -> None:
    """End the process, which Ray's threads would let crash while it ends, as what is gone is an error."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(2)


def _written(job: Job, files: dict[str, bytes]) -> dict[str, Any]:
    with appearing(job) as made:
        for name, content in files.items():
            (made / name).write_bytes(content)
    verdict: dict[str, Any] = json.loads(files[VERDICT])
    return verdict
