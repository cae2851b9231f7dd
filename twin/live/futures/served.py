"""The fork of a run at one moment, from which its futures are forked, a few at a time.

So the run stands still for one fork only, and all futures begin where it was then.
"""

from __future__ import annotations

import json
import os
import resource
import select
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from twin.errors import SimulationError, TwinError, nearest
from twin.live.futures.changes import change, send
from twin.live.futures.fork import Fork, write
from twin.live.futures.future import Awaited, live
from twin.live.futures.outcome import Outcome
from twin.live.futures.what_if import WhatIf
from twin.plugins.execution import told
from twin.runtime.open_run import OpenRun
from twin.runtime.stacks.robot import RobotStack

_CHUNK = 1 << 16
_NICE = 10


@dataclass
class _Running:
    fork: Fork
    number: int
    deadline: float
    heard: bytearray = field(default_factory=bytearray)


def watched(run: OpenRun, name: str) -> RobotStack:
    """Return the robot that is asked about; raises SimulationError if it is not clear which."""
    stacks = run.run.parts.stacks
    if name in stacks:
        return stacks[name]
    if name or len(stacks) != 1:
        what = f"there is no robot '{name}'" if name else "there are several robots"
        raise SimulationError(f"--robot: {what}; {nearest(name, stacks)}")
    return next(iter(stacks.values()))


def serve(run: OpenRun, asked: WhatIf, jobs: int, time_limit_s: float, politely: bool, pipe: int) -> None:
    """Be that fork: tell each outcome as a line of JSON, at last what it cost.

    Args:
        run: Between two ticks.
        asked: What is asked.
        jobs: Futures at a time.
        time_limit_s: Of one [s of wall time].
        politely: Whether other processes, such as the run itself, go before.
        pipe: To write to.
    """
    if politely:
        os.nice(_NICE)
    try:
        run.go_alone()
        stack = watched(run, asked.robot)
        change(run.run, asked.set)
        goal = asked.goal_pose
        if goal is None and stack.context.layout.autonomy != "all":
            raise SimulationError(
                f"what commands robot '{stack.name}' is not here, so nothing tells what it will do: "
                "ask with --goal X,Y,YAW, or start the mirror with --autonomy all"
            )
        awaited = Awaited(run.run, stack, None if goal is None else send(run.run, stack, goal))
    except Exception as error:
        _say(pipe, {"refused": _sentence(error)})
        return
    waiting = iter(range(1, asked.n + 1))
    running: list[_Running] = []
    while True:
        while len(running) < jobs and (number := next(waiting, None)) is not None:
            work = partial(_one, run, stack, awaited, number, asked.horizon)
            running.append(_Running(Fork(work), number, time.monotonic() + time_limit_s))
        if not running:
            break
        left = max(0.0, min(each.deadline for each in running) - time.monotonic())
        ready, _, _ = select.select([each.fork.pipe for each in running], [], [], left)
        for each in list(running):
            if each.fork.pipe in ready:
                if chunk := os.read(each.fork.pipe, _CHUNK):
                    each.heard += chunk
                    continue
                how = each.fork.wait()
                _say(pipe, _heard(each, f"its process has ended {how}"))
            elif time.monotonic() >= each.deadline:
                each.fork.end()
                _say(pipe, _lost(each.number, f"it took longer than {time_limit_s:g} s of wall time"))
            else:
                continue
            running.remove(each)
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    _say(pipe, {"awaited": awaited.what, "cpu_s": sum(each.ru_utime + each.ru_stime for each in used)})


def _one(run: OpenRun, stack: RobotStack, awaited: Awaited, number: int, horizon_s: float, pipe: int) -> None:
    outcome: Mapping[str, Any]
    try:
        outcome = live(run, stack, awaited, number, horizon_s).to_dict()
    except Exception as error:
        outcome = _lost(number, _sentence(error))
    _say(pipe, outcome)


def _heard(one: _Running, otherwise: str) -> Mapping[str, Any]:
    try:
        outcome: Mapping[str, Any] = json.loads(one.heard)
    except ValueError:
        return _lost(one.number, otherwise)
    return outcome


def _lost(number: int, reason: str) -> Mapping[str, Any]:
    return Outcome(number=number, end="lost", reason=reason).to_dict()


def _sentence(error: Exception) -> str:
    blamed = told(error)
    return str(blamed) if isinstance(blamed, TwinError) else f"{type(error).__name__}: {error}"


def _say(pipe: int, what: Mapping[str, Any]) -> None:
    write(pipe, json.dumps(what).encode() + b"\n")
