"""Several robots in one run, each with a mission and checks of its own."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.runtime.conftest import MakeRun
from twin.errors import ScenarioError
from twin.nodes.missions.mission_node import MissionNode
from twin.runtime.open_run import run
from twin.runtime.run import Run
from twin.runtime.stacks.missions import Missions
from twin.scenario.schema import Scenario

MakeScenario = Callable[[str], Scenario]
PAIR = """
name: pair
duration: 5 s
robots:
  - {model: diff_bot, name: left, pose: {y: 1}}
  - {model: diff_bot, name: right, pose: {y: -1}}
missions:
  - {type: velocity_profile, robot: left, steps: [{duration: 1 s, linear: 0.3}]}
  - {type: behaviors, robot: right, steps: [{backup: {distance: 0.2, speed: 0.2}}, {wait: {duration: 0.5}}]}
checks:
  - mission_succeeded:
  - driven_distance: {robot: left, min: 0.2, max: 0.35}
  - driven_distance: {robot: right, min: 0.15, max: 0.25}
"""


def test_each_robot_does_its_own_mission_and_the_run_ends_with_the_last(scenario: MakeScenario) -> None:
    verdict = run(scenario(PAIR), record=False)
    assert verdict.verdict == "pass", [check.reason for check in verdict.checks]
    assert 2.0 < verdict.metrics["sim_time_s"] < 4.0


def test_one_mission_that_fails_fails_them_all_once_all_are_over(
    scenario: MakeScenario, make_run: MakeRun
) -> None:
    ticked: Run = make_run(scenario(PAIR))
    all_of_them, (left, right) = ticked.parts.mission, missions_of(ticked)
    left.note("the wheel came off")
    left.finish(succeeded=False)
    assert not all_of_them.done
    right.finish(succeeded=True)
    assert all_of_them.done
    assert all_of_them.succeeded is False
    assert all_of_them.reason == "left: start: the wheel came off"


def missions_of(run: Run) -> list[MissionNode]:
    assert isinstance(run.parts.mission, Missions)
    return list(run.parts.mission.of.values())


def test_the_state_tells_of_every_robot(scenario: MakeScenario, make_run: MakeRun) -> None:
    ticked: Run = make_run(scenario(PAIR))
    for _ in range(60):
        ticked.tick()
    assert ticked.parts.mission.state.startswith("left: ")
    assert "; right: " in ticked.parts.mission.state
    assert not ticked.parts.mission.done


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("robot: right,", "robot: left,", "robot 'left' has a mission already"),
        ("robot: right,", "robot: rihgt,", "unknown robot 'rihgt'; did you mean 'right'"),
        (
            "missions:",
            "mission: {type: explore, robot: left}\nmissions:",
            "either a mission or a list of missions",
        ),
    ],
)
def test_missions_that_do_not_fit_are_refused(old: str, new: str, fault: str, scenario: MakeScenario) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario(PAIR.replace(old, new))
    assert fault in str(caught.value)
