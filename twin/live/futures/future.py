"""One future of a run, in a process of its own."""

from __future__ import annotations

import time
from typing import Literal

from twin.bridge.actions.client import ClientGoal
from twin.bridge.actions.goal import GoalHandle
from twin.bridge.msgs import GoalStatus
from twin.live.futures.outcome import Outcome
from twin.runtime.open_run import OpenRun
from twin.runtime.run import Run
from twin.runtime.stacks.missions import IdleMission
from twin.runtime.stacks.robot import RobotStack
from twin.sim.clearance import ClearanceMeter
from twin.sim.noise import NoiseStream

_PERIOD_NS = 100_000_000
"""Between two looks at where the robot is."""
_WORDS = {
    GoalStatus.STATUS_ABORTED: "the goal was aborted",
    GoalStatus.STATUS_CANCELED: "the goal was cancelled",
}


class Awaited:
    """What a future waits for: a goal that was sent, else the one under way, else the end of the mission."""

    def __init__(self, run: Run, stack: RobotStack, sent: ClientGoal | None) -> None:
        self._mission = run.parts.mission
        self._goal: ClientGoal | GoalHandle | None = sent
        if sent is None and stack.navigator is not None:
            self._goal = next(iter(stack.navigator.under_way), None)

    @property
    def what(self) -> str:
        """What it is, in words; empty: nothing."""
        if isinstance(self._goal, ClientGoal):
            return "the goal"
        if self._goal is not None:
            return "the goal under way"
        return "" if isinstance(self._mission, IdleMission) else "the end of the mission"

    @property
    def end(self) -> Literal["arrived", "failed", "under way"]:
        """What became of it so far."""
        goal = self._goal
        if goal is None:
            succeeded = self._mission.succeeded
            return "under way" if succeeded is None else "arrived" if succeeded else "failed"
        if isinstance(goal, GoalHandle):
            over, succeeded = not goal.is_active, goal.status == GoalStatus.STATUS_SUCCEEDED
        else:
            over, succeeded = goal.done, goal.succeeded
        return "under way" if not over else "arrived" if succeeded else "failed"

    @property
    def reason(self) -> str:
        """Why it failed."""
        goal = self._goal
        if isinstance(goal, ClientGoal):
            told = goal.error or (goal.result.error_msg if goal.result is not None else "")
            return told or _WORDS.get(goal.status, "")
        return self._mission.reason or ("" if goal is None else _WORDS.get(goal.status, ""))


def live(run: OpenRun, stack: RobotStack, awaited: Awaited, number: int, horizon_s: float) -> Outcome:
    """Go on until what is awaited has come, a check has failed, or so long [s]; return what became of it.

    This process is one future from then on.

    Raises:
        TwinError: The run cannot go on.
    """
    NoiseStream.branch = number - 1
    parts, world = run.run, run.run.world
    begin_ns, cpu_s = world.time_ns, time.process_time()
    end_ns = begin_ns + round(horizon_s * 1e9)
    meter = ClearanceMeter(world)
    clearance = meter.clearance(stack.name)
    path: list[tuple[float, float, float, float]] = []
    due_ns = begin_ns

    def is_over() -> bool:
        nonlocal due_ns, clearance
        now_ns = world.time_ns
        if now_ns >= due_ns:
            due_ns += _PERIOD_NS
            clearance = min(clearance, meter.clearance(stack.name))
            pose = world.pose(stack.handle.base).to_pose2()
            elapsed = (now_ns - begin_ns) * 1e-9
            path.append((round(elapsed, 3), round(pose.x, 4), round(pose.y, 4), round(pose.yaw, 4)))
        decided = awaited.end != "under way" or any(check.decided is False for check in parts.checks)
        return decided or now_ns >= end_ns

    if not is_over():
        run.advance(is_over)
    end = awaited.end
    failed = [c for c in parts.checks if c.decided is False or (parts.over and not c.result().passed)]
    elapsed_s = round((world.time_ns - begin_ns) * 1e-9, 3)
    return Outcome(
        number=number,
        end="failed" if failed else end,
        reason=awaited.reason if end == "failed" else "; ".join(c.result().reason for c in failed),
        arrival_s=elapsed_s if end == "arrived" else None,
        end_s=elapsed_s,
        clearance_m=round(clearance, 4),
        failed_checks=tuple(check.name for check in failed),
        path=tuple(path),
        digest=run.digest.finish(world.state_digest()),
        cpu_s=time.process_time() - cpu_s,
    )
