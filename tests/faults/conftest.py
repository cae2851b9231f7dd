"""Small runs with faults, and what was said in them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from twin.geometry import Pose2
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.faults import FaultReport
from twin.scenario.schema import load

ROUND = """
name: round
seed: 1
duration: 1.5 s
world: {obstacles: [{name: wall, size: [0.1, 4, 1], pose: {x: 3}}]}
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 1.4 s, linear: 0.3, angular: 0.5}]}
checks: [no_collision: ]
"""
"""A robot that drives by itself, whatever its sensors say, before a wall."""


class Told(NamedTuple):
    """A message as it was published, or arrived."""

    time_ns: int
    message: Any

    @property
    def age_ns(self) -> int:
        """How old its stamp is."""
        stamp = self.message.header.stamp
        return self.time_ns - (stamp.sec * 10**9 + stamp.nanosec)


class Ended:
    """A run that is over."""

    def __init__(self, run: Run, said: dict[str, list[Told]], heard: dict[str, list[Any]]) -> None:
        self.run, self.said, self.heard = run, said, heard

    @property
    def reports(self) -> dict[str, FaultReport]:
        """What became of each fault, by name."""
        assert self.run.faults is not None
        return {report.name: report for report in self.run.faults.reports()}

    @property
    def pose(self) -> Pose2:
        """Where the robot is."""
        return self.run.world.pose("diff_bot/base_link").to_pose2()

    @property
    def odometry(self) -> Pose2:
        """Where it believes to be."""
        belief = next(iter(self.run.parts.stacks.values())).robot_pose.in_odom()
        assert belief is not None
        return belief

    @property
    def log(self) -> list[str]:
        """What `/faults` logged."""
        return [told.message.msg for told in self.said["/rosout"] if told.message.name == "faults"]


Drive = Callable[..., Ended]


_ENDED: dict[object, Ended] = {}
"""Runs without faults, which many tests compare with."""


@pytest.fixture
def drive(tmp_path: Path) -> Drive:
    """Return a function that runs a scenario with faults, given as YAML, to its end."""

    def go(
        faults: str = "", text: str = ROUND, listen: Sequence[tuple[type, str]] = (), **overrides: str
    ) -> Ended:
        key = None if faults or overrides else (text, tuple(listen))
        if key in _ENDED:
            return _ENDED[key]
        file = tmp_path / "scenario.yaml"
        file.write_text(text, encoding="utf-8")
        said: dict[str, list[Told]] = defaultdict(list)
        heard: dict[str, list[Any]] = defaultdict(list)

        def tap(sample: Any) -> None:
            said[sample.topic].append(Told(sample.time_ns, sample.message))

        dotted = {key.replace("__", "."): value for key, value in overrides.items()}
        scenario = load(file, {**({"faults": faults} if faults else {}), **dotted})
        parts = build(scenario, taps=[tap])
        try:
            node = parts.bus.create_node("listener")
            for kind, topic in listen:
                node.create_subscription(kind, topic, heard[topic].append, 100)
            run = Run(scenario, parts)
            while not run.over:
                run.tick()
        finally:
            parts.bus.close()
        ended = Ended(run, said, heard)
        if key is not None:
            _ENDED[key] = ended
        return ended

    return go
