"""One robot of a scenario of several."""

from __future__ import annotations

import pytest

from twin.errors import ScenarioError
from twin.live.one_robot import one_robot
from twin.live.perturbations import perturbed
from twin.scenario.schema import Scenario, load

SCENARIO = """
name: two
duration: 20 s
robots:
  - {model: diff_bot, pose: {y: 1.5}}
  - {name: right, model: diff_bot, pose: {y: -1.5}}
mission: {type: velocity_profile, robot: right, steps: [{duration: 1 s, linear: 0.2 m/s}]}
faults:
  - wheel_radius: {robot: right, factor: 0.9}
  - loss: {share: 5 %}
  - mass: {robot: diff_bot, factor: 1.2}
checks: [{driven_distance: {robot: right, min: 1 m}}]
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    file = tmp_path_factory.mktemp("scenario") / "two.yaml"
    file.write_text(SCENARIO, encoding="utf-8")
    return load(file)


@pytest.mark.parametrize(
    ("name", "faults", "mission"),
    [("diff_bot", ["loss", "mass"], "idle"), ("right", ["wheel_radius", "loss"], "velocity_profile")],
)
def test_it_keeps_what_is_about_it_and_what_is_about_none(
    scenario: Scenario, name: str, faults: list[str], mission: str
) -> None:
    alone = one_robot(scenario, name)
    assert [robot.id for robot in alone.robots] == [name]
    assert [fault.kind for fault in alone.faults] == faults
    assert [task.type for task in alone.tasks] == [mission]
    changed, _ = perturbed(alone, "friction=0.8")
    assert [fault.kind for fault in changed.faults] == [*faults, "friction"]


def test_a_robot_that_is_not_there_is_told_with_those_that_are(scenario: Scenario) -> None:
    with pytest.raises(ScenarioError, match="has no robot 'rigt'; did you mean 'right'"):
        one_robot(scenario, "rigt")
