from __future__ import annotations

import pytest
from pydantic import ValidationError

from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.regulated_pure_pursuit import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim import RotationShimConfig
from twin.runtime.controller_config import controller_server_config
from twin.scenario.controllers import ControllerParameters

LIMITS = VelocitySmootherConfig(
    linear=AxisLimits(max_velocity=0.8, max_acceleration=0.7, max_deceleration=1.1),
    angular=AxisLimits(max_velocity=1.4, max_acceleration=2.0),
)


def configured(**keys: object) -> object:
    server = controller_server_config(ControllerParameters.model_validate(keys), LIMITS)
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
            "'desired_linear_vel' is of another plugin, not of mppi",
        ),
        ({"vx_max": 0.5}, "not of regulated_pure_pursuit without rotation shim"),
        ({"angular_dist_threshold": 0.5}, "'angular_dist_threshold' is of the rotation shim"),
    ],
)
def test_a_key_of_another_plugin_is_refused(keys: dict[str, object], told: str) -> None:
    with pytest.raises(ValidationError, match=told):
        ControllerParameters.model_validate(keys)
