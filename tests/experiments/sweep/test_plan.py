"""What is going to run, and what makes a run another one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.experiments.sweep.conftest import SPEED, MakePlan
from twin.errors import ScenarioError
from twin.experiments.sweep.plan import make_plan
from twin.models.catalogue import ROBOTS


def keys(plan: MakePlan, *words: str, **options: object) -> set[str]:
    return {run.key for run in plan(*words, **options).in_turn()}


def test_all_points_run_with_the_first_seed_before_any_with_the_next(plan: MakePlan) -> None:
    planned = plan(f"{SPEED}=0.1,0.2", seeds=(5, 6))
    assert [(run.point, run.seed) for run in planned.in_turn()] == [(0, 5), (1, 5), (0, 6), (1, 6)]
    assert planned.overrides(planned.run(1, 0)) == {SPEED: "0.2", "seed": "5"}
    assert len({run.key for run in planned.in_turn()}) == planned.size == 4


def test_without_seeds_it_is_the_scenarios_own(plan: MakePlan) -> None:
    assert plan().seeds == (3,)


def test_a_key_that_does_not_exist_is_told_once_with_the_nearest(plan: MakePlan) -> None:
    with pytest.raises(ScenarioError) as told:
        plan("mission.stesp.0.linear=1,2,3", "duratoin=1,2")
    first, second = map(str, told.value.problems)
    assert "unknown key 'stesp' in mission; did you mean 'steps'?" in first
    assert "unknown key 'duratoin'; did you mean 'duration'?" in second


def test_each_value_that_cannot_be_is_told(plan: MakePlan) -> None:
    with pytest.raises(ScenarioError) as told:
        plan("duration=1,-1,0", f"{SPEED}=0.1,x")
    assert len(told.value.problems) == 3


def test_a_run_is_another_one_if_anything_of_it_is(plan: MakePlan, scenario: Path) -> None:
    before = keys(plan, f"{SPEED}=0.1,0.2", seeds=(1, 2))
    assert keys(plan, f"{SPEED}=0.2,0.1", seeds=(2, 1)) == before
    assert len(keys(plan, f"{SPEED}=0.2,0.3", seeds=(2, 3)) & before) == 1
    text = scenario.read_text()
    scenario.write_text(f"description: Another word.\npass_rate: {{min: 0.5}}\n{text}")
    assert keys(plan, f"{SPEED}=0.1,0.2", seeds=(1, 2)) == before
    scenario.write_text(text.replace("1 m", "2 m"))
    assert not keys(plan, f"{SPEED}=0.1,0.2", seeds=(1, 2)) & before


def test_files_count_by_what_is_in_them_wherever_they_are(tmp_path: Path, scenario: Path) -> None:
    """A robot of two files, of which the included one is changed."""

    def key(folder: str, radius: str) -> str:
        place = tmp_path / folder
        shutil.copytree(ROBOTS / "diff_bot", place)
        (place / "radius.xacro").write_text(
            f'<r xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="r" value="{radius}"/></r>'
        )
        robot = place / "diff_bot.urdf.xacro"
        text = robot.read_text()
        end = text.index(">", text.index("<robot")) + 1
        robot.write_text(
            f'{text[:end]}<xacro:include filename="radius.xacro"/><link name="l_${{r}}"/>'
            f'<joint name="j" type="fixed"><parent link="base_link"/><child link="l_${{r}}"/></joint>'
            f"{text[end:]}"
        )
        file = place / "moment.yaml"
        file.write_text(
            scenario.read_text().replace("model: diff_bot", "model: ./diff_bot.urdf.xacro, name: diff_bot")
        )
        return make_plan(file).identity

    first = key("a", "1")
    assert key("b", "1") == first
    assert key("c", "2") != first


def test_a_pass_rate_comes_from_the_file_or_the_command(plan: MakePlan, scenario: Path) -> None:
    assert plan().claim is None
    with pytest.raises(ScenarioError, match="say which"):
        plan(confidence=0.9)
    with pytest.raises(ScenarioError, match="between 0 and 1"):
        plan(pass_rate=95.0)
    scenario.write_text(f"{scenario.read_text()}pass_rate: {{min: 0.8, confidence: 0.99}}\n")
    assert plan().claim.model_dump() == {"min": 0.8, "confidence": 0.99}
    assert plan(pass_rate=0.5).claim.model_dump() == {"min": 0.5, "confidence": 0.99}
    assert plan(confidence=0.9).claim.model_dump() == {"min": 0.8, "confidence": 0.9}
