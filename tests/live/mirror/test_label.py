"""What a virtual robot may call itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from twin.live.mirror.label import Evidence, judge

TWIN = Evidence(
    age_s=0.05, position=0.01, yaw=0.01, clock_bound_s=0.005, acknowledged=True, commands="obeyed in 0.1 s"
)


def test_a_twin_is_one_that_flows_both_ways_and_lacks_nothing() -> None:
    judgement = judge(TWIN)
    assert judgement.label == "twin"
    assert judgement.why == ()


def test_without_a_physical_robot_it_is_a_model() -> None:
    judgement = judge(Evidence())
    assert judgement.label == "model"
    assert judgement.why == ("nothing was heard of a physical robot",)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"age_s": 0.5}, "the latest data are 0.5 s old"),
        ({"position": 0.3}, "it is 0.30 m from the physical robot"),
        ({"yaw": -0.4}, "it is turned -0.40 rad from the physical robot"),
        ({"clock_bound_s": None}, "the robot's clock is not known"),
        ({"clock_bound_s": 0.13}, "the robot's clock is known to 130 ms only"),
        ({"acknowledged": False, "commands": "not obeyed"}, "not obeyed"),
        ({"doubts": ("two robots",)}, "two robots"),
    ],
)
def test_each_thing_that_it_lacks_makes_it_a_shadow_and_is_said(changed: dict[str, Any], said: str) -> None:
    judgement = judge(replace(TWIN, **changed))
    assert judgement.label == "shadow"
    assert judgement.why == (said,)


def test_a_silent_robot_makes_it_a_shadow_at_once_and_a_model_later() -> None:
    labels = [judge(replace(TWIN, age_s=age)).label for age in (0.39, 0.41, 4.9, 5.1)]
    assert labels == ["twin", "shadow", "shadow", "model"]
