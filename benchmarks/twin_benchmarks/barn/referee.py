"""Who watches a run and says how it ended, by the rules of the challenge (its `run.py`)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from twin.geometry import Array, Pose2
from twin.runtime.defaults import from_description as derive
from twin.runtime.run import Run
from twin_benchmarks.barn.clearance import clearance
from twin_benchmarks.barn.worlds import BarnSet, BarnWorld

MOVED_M = 0.1
"""The clock starts when the robot is so far from its start."""
_LOOK_NS = 100_000_000
"""The goal is looked at ten times a second."""
SLOWEST, FASTEST = 8.0, 2.0
"""Bounds of the actual time, in optimal times, since 2024; before, the lower one was 4."""

Outcome = Literal["success", "collision", "timeout"]


def score(outcome: Outcome, time_s: float, optimal_time: float) -> float:
    """Return success · OT / clip(AT, 2 OT, 8 OT), 0.5 at best."""
    if outcome != "success":
        return 0.0
    return optimal_time / min(max(time_s, FASTEST * optimal_time), SLOWEST * optimal_time)


@dataclass(frozen=True, kw_only=True)
class Trial:
    """How one world went."""

    world: int
    seed: int
    outcome: Outcome
    reason: str
    """Empty for a success."""
    score: float
    time_s: float
    """From 0.1 m after the start to the end [s]."""
    optimal_time: float
    """[s]"""
    length: float
    """Of the driven path [m]."""
    min_clearance: float
    """Between the robot and the nearest cylinder [m]."""
    max_speed: float
    """[m/s]"""
    drift: float
    """Of odometry at the end [m]."""
    recoveries: int
    real_time_factor: float
    trajectory: tuple[tuple[float, float], ...] = field(default=(), repr=False)
    """True positions, ten a second."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self)


class Referee:
    """Called after every tick of a run; its truth reaches no node."""

    def __init__(self, world: BarnWorld, rules: BarnSet) -> None:
        self._world, self._rules = world, rules
        self._centres = np.array(world.obstacles).reshape(-1, 2)
        self._corners: Array | None = None
        self._began_ns: int | None = None
        self._last: Pose2 | None = None
        self._tick_ns = 0
        self.outcome: Outcome = "timeout"
        self.reason = "the run ended"
        self.time_s = 0.0
        self.length = 0.0
        self.min_clearance = math.inf
        self.max_speed = 0.0
        self.drift = 0.0
        self.trajectory: list[tuple[float, float]] = []

    def watch(self, run: Run) -> bool:
        """Look at the robot; return True when the trial is over."""
        (stack,) = run.parts.stacks.values()
        pose = run.world.pose(stack.handle.base).to_pose2()
        now = run.world.time_ns
        if self._corners is None:
            self._corners = derive.footprint(stack.handle.description, padding=0.0)
        if self._last is not None:
            step = pose.distance(self._last)
            self.length += step
            self.max_speed = max(self.max_speed, step / ((now - self._tick_ns) * 1e-9))
        self._last, self._tick_ns = pose, now
        gap = clearance(pose, self._corners, self._centres, self._rules.radius)
        self.min_clearance = min(self.min_clearance, gap)
        if self._began_ns is None and pose.distance(self._rules.start) > MOVED_M:
            self._began_ns = now
        elapsed = (now - (self._began_ns or 0)) * 1e-9
        contacts = run.world.contacts()
        if contacts or gap <= 0.0:
            other = f"{contacts[0].body1} hit {contacts[0].body2}" if contacts else "overlap"
            return self._end("collision", f"{other} at ({pose.x:.2f}, {pose.y:.2f})", elapsed, run)
        if now % _LOOK_NS == 0:
            self.trajectory.append((round(pose.x, 4), round(pose.y, 4)))
            if math.dist(pose[:2], self._rules.goal) <= self._rules.goal_radius:
                return self._end("success", "", elapsed, run)
        if elapsed >= self._rules.timeout_s:
            return self._end(
                "timeout", f"after {elapsed:.0f} s at ({pose.x:.2f}, {pose.y:.2f})", elapsed, run
            )
        if run.parts.mission.done:
            return self._end("timeout", f"gave up: {run.parts.mission.reason}", elapsed, run)
        return False

    def _end(self, outcome: Outcome, reason: str, elapsed: float, run: Run) -> bool:
        self.outcome, self.reason, self.time_s = outcome, reason, elapsed
        (stack,) = run.parts.stacks.values()
        believed, true = stack.robot_pose.in_map(), self._last
        if believed is not None and true is not None:
            self.drift = believed.distance(true)
        return True

    def trial(self, *, seed: int, recoveries: int, real_time_factor: float) -> Trial:
        """Return the result."""
        optimal = self._world.optimal_time
        return Trial(
            world=self._world.id,
            seed=seed,
            outcome=self.outcome,
            reason=self.reason,
            score=score(self.outcome, self.time_s, optimal),
            time_s=self.time_s,
            optimal_time=optimal,
            length=self.length,
            min_clearance=self.min_clearance,
            max_speed=self.max_speed,
            drift=self.drift,
            recoveries=recoveries,
            real_time_factor=real_time_factor,
            trajectory=tuple(self.trajectory),
        )
