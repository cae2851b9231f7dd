"""Who takes part in a run from outside, and how the run keeps time with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from twin.bridge.wire import DEFAULT_ENDPOINT
from twin.errors import ScenarioError

ClockMode = Literal["inproc", "lockstep", "free"]
"""Whose time counts: the run's alone, the run's with others that it waits for, everybody's own."""


@dataclass(frozen=True, kw_only=True)
class Outside:
    """What `twin run` was told about other processes and the user's own nodes."""

    nodes: tuple[str, ...] = ()
    """FILE.py:FACTORY: nodes to run in this process, after all others."""
    wait_for: tuple[str, ...] = ()
    """Nodes to step, topics to wait for ('/cmd_vel', '/cmd_vel@/scan'), in the order of their slots."""
    wait_timeout_s: float = 10.0
    """How long to wait for any answer [s] of wall time."""
    free: bool = False
    """Whether others take part at their own pace."""

    def __post_init__(self) -> None:
        """Refuse two clocks at once.

        Raises:
            ScenarioError: free and waiting, a name that is not absolute, a time-out that is not positive.
        """
        if self.free and self.wait_for:
            raise ScenarioError("--free and --wait-for: a run waits for others or does not; leave one out")
        wrong = [
            name for name in self.wait_for if not name.startswith("/") or ("@" in name and "@/" not in name)
        ]
        if wrong:
            raise ScenarioError(
                f"--wait-for {wrong[0]}: must be a node such as /controller, a topic such as /cmd_vel, or a "
                "topic and what it answers, such as /cmd_vel@/scan"
            )
        if not self.wait_timeout_s > 0.0:
            raise ScenarioError(f"--wait-timeout {self.wait_timeout_s:g}: must be more than 0 s")

    def clock(self, networked: bool) -> ClockMode:
        """Return how a run keeps time with others, whom a network may bring."""
        if self.wait_for:
            return "lockstep"
        return "free" if self.free or networked else "inproc"

    def endpoints(self, listen: Sequence[str]) -> tuple[str, ...]:
        """Return where to listen: where asked to, else where rmw_zenoh looks if others are to come."""
        return tuple(listen) or ((DEFAULT_ENDPOINT,) if self.free or self.wait_for else ())

    @property
    def session(self) -> str:
        """What the bus's ids depend on: in lock-step the same as in one process."""
        return "twin" if self.wait_for else ""


ALONE = Outside()
"""Nobody takes part."""
