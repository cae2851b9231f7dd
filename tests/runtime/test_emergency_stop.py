"""The emergency stop of a simulated robot: latched beside its wheels, past everything that commands them."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.runtime.conftest import MakeRun
from tests.runtime.test_lost_tote import HALL, SCENARIO
from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionClient
from twin.bridge.msgs import DiagnosticArray, GoalStatus, PoseStamped, Twist, Vector3, header, new
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import Trigger
from twin.nodes.guard.status import GuardStatus
from twin.runtime.run import Run
from twin.scenario.schema import Scenario, load

_TICK_S = 0.02

FREE = """
name: free
seed: 1
duration: 60 s
robots:
  - {{model: diff_bot, emergency_deceleration: {deceleration} m/s²}}
checks: [no_collision: ]
"""


class Operator:
    """Presses and releases, hears the status, and measures what the robot really does."""

    def __init__(self, run: Run, base: str) -> None:
        self.run, self.base = run, base
        self.node = run.bus.create_node("operator")
        self.statuses: list[GuardStatus] = []
        self.node.create_subscription(DiagnosticArray, "/guard/status", self._on_status, LATCHED)

    def _on_status(self, message: DiagnosticArray) -> None:
        status = GuardStatus.of_message(message)
        assert status is not None
        self.statuses.append(status)

    def call(self, name: str) -> Any:
        future = self.node.create_client(Trigger, name).call_async(Trigger.Request())
        self.ticks(3)
        return future.result

    def ticks(self, count: int, each: Callable[[], None] = lambda: None) -> None:
        for _ in range(count):
            each()
            self.run.tick()

    @property
    def xy(self) -> np.ndarray:
        return np.array(self.run.world.pose(self.base).xyz[:2])

    def track(self, seconds: float, each: Callable[[], None] = lambda: None) -> np.ndarray:
        """Return true positions after every tick, shape (n, 2) [m]."""
        places = [self.xy]
        for _ in range(round(seconds / _TICK_S)):
            each()
            self.run.tick()
            places.append(self.xy)
        return np.array(places)

    def press(self, seconds: float, each: Callable[[], None] = lambda: None) -> tuple[float, float, float]:
        """Call `/guard/stop`; return speed before [m/s], time to standstill [s] and the way there [m]."""
        before = self.track(2 * _TICK_S, each)
        speed = math.dist(before[0], before[-1]) / (2 * _TICK_S)
        self.node.create_client(Trigger, "/guard/stop").call_async(Trigger.Request())
        places = self.track(seconds, each)
        speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / _TICK_S
        moving = np.flatnonzero(speeds > 0.02)
        return speed, (moving[-1] + 1) * _TICK_S, float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


@pytest.mark.parametrize("deceleration", [3.0, 0.5])
def test_it_stands_within_the_time_that_its_deceleration_takes_whatever_is_commanded(
    make_run: MakeRun, scenario: Callable[[str], Scenario], deceleration: float
) -> None:
    run = make_run(scenario(FREE.format(deceleration=deceleration)))
    operator = Operator(run, "diff_bot/base_footprint")
    publisher = operator.node.create_publisher(Twist, "cmd_vel", 1)
    fastest = Twist(Vector3(5.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))

    def drive() -> None:
        publisher.publish(fastest)

    operator.ticks(150, drive)
    speed, time, way = operator.press(3.0, drive)
    assert speed > 0.4
    assert time <= speed / deceleration + 0.1
    assert way <= speed**2 / (2.0 * deceleration) + 0.1 * speed
    assert time >= 0.8 * speed / deceleration, "it brakes as told, not at once"

    assert operator.statuses[0].stopped_by is None, "who comes later hears the state"
    assert (operator.statuses[-1].stopped_by, operator.statuses[-1].stops) == ("a service call", 1)
    assert operator.call("/guard/stop").success
    assert operator.statuses[-1].stops == 1, "pressing again is as good as once"

    assert operator.call("/guard/release").success
    assert operator.statuses[-1].stopped_by is None
    assert np.ptp(operator.track(1.0), axis=0).max() < 0.01, "a release moves nothing by itself"
    assert np.ptp(operator.track(1.0, drive), axis=0).max() > 0.1, "commands from then on count"


def test_goals_are_cancelled_and_what_is_carried_stays_in_the_gripper(
    make_run: MakeRun, tmp_path: Path
) -> None:
    (tmp_path / "hall.yaml").write_text(HALL, encoding="utf-8")
    (tmp_path / "run.yaml").write_text(SCENARIO, encoding="utf-8")
    run = make_run(load(tmp_path / "run.yaml"))
    operator = Operator(run, "warehouse_bot/base_footprint")
    while not run.parts.mission.state.startswith("tote: carry"):
        assert not run.over
        run.tick()
    while True:
        there = operator.xy
        run.tick()
        if math.dist(there, operator.xy) > 0.25 * _TICK_S:
            break
        assert not run.over
    speed, time, _ = operator.press(1.0)
    assert speed > 0.2
    assert time <= speed / 3.0 + 0.1

    client = ActionClient(operator.node, NavigateToPose, "navigate_to_pose")
    goal = new(NavigateToPose.Goal, pose=new(PoseStamped, header=header(0, "map")))
    sent = client.send_goal(goal)
    stood = operator.track(2.0)
    assert np.ptp(stood, axis=0).max() < 0.01
    assert sent.status == GoalStatus.STATUS_CANCELED, "a goal that is sent while it is stopped, too"
    assert run.world.data.joint("tote").qpos[2] > 0.3, "the tote is still up in the gripper"

    operator.call("/guard/release")
    assert np.ptp(operator.track(1.0), axis=0).max() < 0.01
    client.send_goal(goal)
    assert np.ptp(operator.track(4.0), axis=0).max() > 0.1
    assert run.world.data.joint("tote").qpos[2] > 0.3
