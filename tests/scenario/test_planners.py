from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from twin.models import load
from twin.models.catalogue import catalogue
from twin.navigation.planning.config import HybridConfig, PlannerConfig, ThetaStarConfig
from twin.nodes.navigation.robot_pose import Frames
from twin.runtime.defaults.navigation import NavigationParameters, navigation_parameters
from twin.scenario.navigation import NavigationConfig


def parameters(**planner: object) -> NavigationParameters:
    drive = load(catalogue()["warehouse_bot"]).drive
    assert drive is not None
    config = NavigationConfig.model_validate({"planner": planner})
    return navigation_parameters(config, drive, np.array([[0.2, 0.2], [-0.2, 0.2], [0.0, -0.2]]), Frames())


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, ThetaStarConfig(tolerance=0.1, allow_unknown=False)),
        (
            {"plugin": "grid_based", "cost_factor": 5.0},
            PlannerConfig(tolerance=0.1, allow_unknown=False, cost_factor=5.0),
        ),
        (
            {"plugin": "smac_hybrid", "motion_model_for_search": "REEDS_SHEPP", "tolerance": 0.3},
            HybridConfig(tolerance=0.3, allow_unknown=False, motion_model_for_search="REEDS_SHEPP"),
        ),
    ],
)
def test_a_scenario_chooses_the_planner_and_its_parameters(
    given: dict[str, object], expected: object
) -> None:
    assert parameters(**given).planner == expected


def test_alternatives_are_the_servers() -> None:
    assert parameters(compute_alternatives=2).planner_server.compute_alternatives == 2


def test_a_parameter_of_another_planner_is_refused() -> None:
    with pytest.raises(ValidationError, match="cost_factor is a parameter of grid_based; theta_star has"):
        NavigationConfig.model_validate({"planner": {"cost_factor": 2.0}})
