from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.errors import ScenarioError
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim_config import RotationShimConfig
from twin.runtime.defaults.controllers import controller_server_config
from twin.scenario.controllers import ControllerParameters, FurtherControllerParameters
from twin.scenario.navigation import NavigationConfig
from twin.scenario.schema import load
from twin.strict_yaml import Faults

ROOT = Path(__file__).parents[2]

LIMITS = VelocitySmootherConfig(
    linear=AxisLimits(max_velocity=0.8, max_acceleration=0.7, max_deceleration=1.1),
    angular=AxisLimits(max_velocity=1.4, max_acceleration=2.0),
)


def configured(**keys: object) -> object:
    server = controller_server_config(ControllerParameters.whole().model_validate(keys), LIMITS)
    return server.controllers["FollowPath"]


def test_a_plugin_takes_the_robots_limits_and_is_in_the_rotation_shim() -> None:
    assert isinstance(configured(), RegulatedPurePursuitConfig)
    shim = configured(plugin="mppi")
    assert isinstance(shim, RotationShimConfig)
    mppi = shim.primary_controller
    assert isinstance(mppi, MPPIConfig)
    assert (mppi.vx_max, mppi.ax_max, mppi.ax_min, mppi.az_max) == (0.8, 0.7, -1.1, 2.0)
    assert isinstance(configured(plugin="dwb", rotation_shim=False), DWBConfig)
    assert isinstance(configured(rotation_shim=True, rotate_to_goal_heading=False), RotationShimConfig)


def test_overrides_reach_plugin_critic_and_shim() -> None:
    shim = configured(
        plugin="mppi",
        vx_max=0.4,
        batch_size=99,
        angular_dist_threshold=0.5,
        CostCritic={"cost_weight": 7.0},
    )
    assert isinstance(shim, RotationShimConfig)
    mppi = shim.primary_controller
    assert isinstance(mppi, MPPIConfig)
    assert (mppi.vx_max, mppi.batch_size, mppi.CostCritic.cost_weight) == (0.4, 99, 7.0)
    assert mppi.CostCritic.critical_cost == 300.0
    assert shim.angular_dist_threshold == 0.5


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        (
            {"plugin": "mppi", "desired_linear_vel": 0.5},
            "'desired_linear_vel' is not of mppi with rotation shim; "
            "valid with `plugin: regulated_pure_pursuit`",
        ),
        ({"vx_max": 0.5}, "not of regulated_pure_pursuit without rotation shim; valid with `plugin: mppi`"),
        ({"angular_dist_threshold": 0.5}, "valid with `rotation_shim: true`"),
        ({"required_movement_angle": 0.5}, "needs 'progress_checker: pose' beside it"),
        (
            {"goal_checker": "position", "yaw_goal_tolerance": 0.5},
            "needs 'goal_checker: simple' or 'goal_checker: stopped' beside it",
        ),
    ],
)
def test_a_key_of_another_plugin_is_refused(keys: dict[str, object], told: str) -> None:
    with pytest.raises(ValidationError, match=told):
        ControllerParameters.whole().model_validate(keys)


def test_an_unknown_key_is_told_with_the_few_that_it_may_mean(tmp_path: Path) -> None:
    text = (ROOT / "scenarios" / "warehouse_patrol.yaml").read_text("utf-8")
    file = tmp_path / "demo.yaml"
    file.write_text(
        text.replace("navigation: {}", "navigation: {controller: {desired_linear_velocity: 1.0}}")
    )
    with pytest.raises(ScenarioError) as caught:
        load(file)
    said = caught.value.problems[0].message
    assert "did you mean 'desired_linear_vel'? Valid: desired_linear_vel, " in said
    assert said.count(",") <= 6
    assert said.endswith(" more")


def test_more_controllers_are_there_by_id_with_a_goal_checker_each() -> None:
    precise = FurtherControllerParameters.whole()(plugin="mppi", xy_goal_tolerance=0.02)
    server = controller_server_config(
        ControllerParameters.whole()(controller_frequency=20.0), LIMITS, {"Precise": precise}
    )
    assert list(server.controllers) == ["FollowPath", "Precise"]
    shim = server.controllers["Precise"]
    assert isinstance(shim, RotationShimConfig)
    assert isinstance(shim.primary_controller, MPPIConfig)
    assert shim.primary_controller.model_dt == 0.05, "of the server's frequency"
    tolerances = {name: one.xy_goal_tolerance for name, one in server.goal_checkers.items()}
    assert tolerances == {"general_goal_checker": 0.05, "Precise": 0.02}


@pytest.mark.parametrize(
    ("controllers", "told"),
    [
        ({"FollowPath": {}}, "is what `controller` describes"),
        ({"a b": {}}, "pattern"),
        ({"Slow": {"controller_frequency": 10.0}}, "give it under `controller`"),
        (
            {"Slow": {"plugin": "dwb", "vx_max": 0.1}},
            "'vx_max' is not of dwb with rotation shim; valid with `plugin: mppi`",
        ),
    ],
)
def test_ids_and_keys_of_more_controllers_are_checked(controllers: object, told: str) -> None:
    with pytest.raises((ValidationError, Faults), match=told):
        NavigationConfig.model_validate({"controllers": controllers})
