"""Nav2's parameter files: what the scenario gives goes first, whatever the file calls it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.runtime.parameter_files.nav2 import robot as nav2_robot
from twin.runtime.defaults.navigation import NavigationParameters


def applied(tmp_path: Path, text: str, config: dict[str, Any]) -> NavigationParameters:
    return nav2_robot.applied(tmp_path, text, config)[0]


SMOOTHER = """\
velocity_smoother:
  ros__parameters: {max_velocity: [0.4, 0.0, 1.3], max_accel: [2.5, 0.0, 3.2], max_decel: [-2.6, 0.0, -3.3]}
"""


def test_limits_that_the_file_has_in_lists(tmp_path: Path) -> None:
    got = applied(tmp_path, SMOOTHER, {"max_linear_acceleration": 0.5}).smoother
    assert (got.linear.max_acceleration, got.linear.max_deceleration) == (0.5, 2.6)
    got = applied(tmp_path, SMOOTHER, {"max_linear_deceleration": 0.6}).smoother
    assert (got.linear.max_acceleration, got.linear.max_deceleration) == (2.5, 0.6)
    got = applied(
        tmp_path, SMOOTHER, {"max_angular_acceleration": 0.7, "max_linear_speed": "0.3 m/s"}
    ).smoother
    assert (got.angular.max_acceleration, got.angular.max_deceleration) == (0.7, 0.7), "also when braking"
    assert (got.linear.max_velocity, got.angular.max_velocity) == (0.3, 1.3)


def test_a_frequency_that_is_a_duration_in_the_file(tmp_path: Path) -> None:
    text = "bt_navigator: {ros__parameters: {bt_loop_duration: 10, default_server_timeout: 20}}\n"
    navigator = applied(tmp_path, text, {"navigator": {"bt_loop_frequency": "20 Hz"}}).navigator
    assert (navigator.bt_loop_duration, navigator.default_server_timeout) == (50, 20)


CONTROLLERS = """\
controller_server:
  ros__parameters:
    FollowPath:
      plugin: nav2_mppi_controller::MPPIController
      vx_max: 0.45
      CostCritic: {cost_weight: 2.0, consider_footprint: true}
    Precise: {vx_max: 0.4, wz_max: 0.7}
"""
MPPI = {"plugin": "mppi", "rotation_shim": False}


def test_further_controllers_have_their_own_keys(tmp_path: Path) -> None:
    config = {
        "controller": {**MPPI, "vx_max": "0.8 m/s"},
        "controllers": {"Precise": {**MPPI, "wz_max": "0.5 rad/s"}},
    }
    controllers: Any = applied(tmp_path, CONTROLLERS, config).controller_server.controllers
    assert controllers["FollowPath"].vx_max == 0.8
    assert controllers["Precise"].wz_max == 0.5
    assert controllers["Precise"].vx_max == 0.4, "what the scenario says of FollowPath is not of Precise"


def test_a_plugin_that_both_name_has_the_files_section(tmp_path: Path) -> None:
    """Where the file has no shim, the scenario's default shim is none either, unless it is asked for."""
    for config, vx_max in (({"plugin": "mppi"}, 0.45), ({"plugin": "mppi", "vx_max": "0.8 m/s"}, 0.8)):
        controllers: Any = applied(
            tmp_path, CONTROLLERS, {"controller": config}
        ).controller_server.controllers
        assert controllers["FollowPath"].vx_max == vx_max
    asked = {"controller": {"plugin": "mppi", "rotation_shim": True}}
    controllers = applied(tmp_path, CONTROLLERS, asked).controller_server.controllers
    assert type(controllers["FollowPath"]).__name__ == "RotationShimConfig"


def test_goal_checkers_of_further_controllers(tmp_path: Path) -> None:
    text = (
        "controller_server: {ros__parameters: {general_goal_checker: {xy_goal_tolerance: 0.2}, "
        "Precise: {xy_goal_tolerance: 0.3, yaw_goal_tolerance: 0.4}}}\n"
    )
    config = {"controllers": {"Precise": {"plugin": "dwb", "xy_goal_tolerance": "2 cm"}}}
    checkers: Any = applied(tmp_path, text, config).controller_server.goal_checkers
    assert checkers["general_goal_checker"].xy_goal_tolerance == 0.2
    assert checkers["Precise"].xy_goal_tolerance == 0.02
    assert checkers["Precise"].yaw_goal_tolerance == 0.4


def test_of_a_critic_only_the_keys_that_are_given(tmp_path: Path) -> None:
    config = {"controller": {**MPPI, "CostCritic": {"cost_weight": 6}}}
    controllers: Any = applied(tmp_path, CONTROLLERS, config).controller_server.controllers
    critic = controllers["FollowPath"].CostCritic
    assert (critic.cost_weight, critic.consider_footprint) == (6.0, True)


def test_maneuvers_that_the_scenario_forbids(tmp_path: Path) -> None:
    text = "controller_server: {ros__parameters: {maneuver: {reach: 2.5, speed: 0.1}}}\n"
    maneuver = applied(tmp_path, text, {"controller": {"maneuvers": False}}).controller_server.maneuver
    assert (maneuver.reach, maneuver.speed) == (0.0, 0.1)


def test_types_of_docks(tmp_path: Path) -> None:
    text = """\
docking_server:
  ros__parameters:
    dock_plugins: [charger]
    charger:
      plugin: opennav_docking::SimpleChargingDock
      docking_threshold: 0.09
      staging_x_offset: -0.9
"""
    config = {"docking": {"types": {"charger": {"docking_threshold": "2 cm"}}}}
    charger = applied(tmp_path, text, config).docking.database.types["charger"]
    assert (charger.docking_threshold, charger.staging_x_offset) == (0.02, -0.9)


def test_a_radius_goes_before_the_files_outline(tmp_path: Path) -> None:
    outline = "footprint: '[[0.4, 0.2], [0.4, -0.2], [-0.4, -0.2], [-0.4, 0.2]]'"
    text = f"local_costmap: {{local_costmap: {{ros__parameters: {{{outline}}}}}}}\n"
    layers = applied(tmp_path, text, {"local_costmap": {"robot_radius": "0.3 m"}}).local_costmap.layers
    assert (layers.footprint, layers.robot_radius) == ((), 0.3)


def test_the_smoother_of_paths(tmp_path: Path) -> None:
    text = "smoother_server: {ros__parameters: {simple_smoother: {w_smooth: 0.4, w_data: 0.1}}}\n"
    smoothers = applied(tmp_path, text, {"smoother": {"w_smooth": 0.25}}).path_smoother.smoothers
    assert (smoothers["simple_smoother"].w_smooth, smoothers["simple_smoother"].w_data) == (0.25, 0.1)
