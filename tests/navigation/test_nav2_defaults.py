"""A parameter that nobody sets is what it is in Nav2 (tests/oracles/nav2_defaults.py), but for some."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim import RotationShimConfig
from twin.navigation.docking.collision_check import DockCollisionConfig
from twin.navigation.docking.line_approach import LineApproachConfig
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.recovery import BehaviorConfig

GOLDENS = Path(__file__).parents[1] / "oracles" / "nav2_defaults.json"


@pytest.mark.parametrize(
    ("component", "config", "least", "ours"),
    [
        (
            "amcl",
            AmclConfig(),
            29,
            {
                *("alpha1", "alpha2", "alpha3", "alpha4", "alpha5", "sigma_hit"),  # of the robots here
                *("recovery_alpha_fast", "recovery_alpha_slow"),  # a robot carried away is to find itself
            },
        ),
        ("behaviors", BehaviorConfig(), 9, {"deceleration_limit", "minimum_speed"}),
        ("docking controller", LineApproachConfig(), 3, {"v_angular_max", "v_linear_min"}),
        ("docking controller", DockCollisionConfig(), 4, set()),
        ("regulated pure pursuit", RegulatedPurePursuitConfig(), 27, {"max_linear_decel"}),
        ("rotation shim", RotationShimConfig(), 9, set()),
    ],
    ids=lambda value: type(value).__name__ if hasattr(value, "__dataclass_fields__") else "",
)
def test_defaults_are_nav2s(component: str, config: Any, least: int, ours: set[str]) -> None:
    theirs = json.loads(GOLDENS.read_text("utf-8"))[component]
    shared = {name for name in theirs if hasattr(config, name)}
    assert len(shared) >= least
    assert {name for name in shared if getattr(config, name) != theirs[name]} == ours
