"""Nav2's parameter files: what is taken, what is told, what is refused."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.runtime.parameter_files.nav2.robot import applied
from twin.controllers.limiter import AxisLimits
from twin.errors import NavigationError, ScenarioError
from twin.geometry import Pose2
from twin.navigation.control.collision_monitor_config import MonitorCloud
from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.navigation.costmaps.observation import ObservationSource
from twin.navigation.docking.docks import Dock
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.runtime.defaults.navigation import NavigationParameters
from twin.runtime.parameter_files.nav2.parameters import amcl_with_file, monitor_with_file
from twin.scenario.collision_monitor import CollisionMonitorParameters
from twin.scenario.estimators.amcl import AmclParameters
from twin.scenario.navigation import CostmapParameters, NavigationConfig
from twin.scenario.schema import load

ROOT = Path(__file__).parents[4]

FILE = """\
/**:
  ros__parameters:
    use_sim_time: true
    log_level: info
lifecycle_manager:
  ros__parameters:
    autostart: true
bt_navigator:
  ros__parameters:
    bt_loop_duration: 20
    error_code_names: [compute_path_error_code, follow_path_error_code]
controller_server:
  ros__parameters:
    controller_frequency: 25.0
    min_x_velocity_threshold: 0.001
    costmap_update_timeout: 0.3
    min_y_velocity_threshold: 0.5
    goal_checker_plugins: ["precise"]
    controller_plugins: ["FollowPath"]
    progress_checker:
      plugin: "nav2_controller::SimpleProgressChecker"
      movement_time_allowance: 7
    precise:
      plugin: "nav2_controller::SimpleGoalChecker"
      xy_goal_tolerance: 0.11
    FollowPath:
      plugin: "{plugin}"
      lookahead_dist: 0.55
local_costmap:
  local_costmap:
    ros__parameters:
      update_frequency: 4.0
      width: 3
      plugins: ["voxel_layer", "inflation_layer"]
      inflation_layer:
        plugin: "nav2_costmap_2d::InflationLayer"
        inflation_radius: 0.66
      voxel_layer:
        scan:
          obstacle_max_range: 2.4
planner_server:
  ros__parameters:
    planner_plugins: ["Smac"]
    Smac:
      plugin: "nav2_smac_planner::SmacPlanner2D"
      tolerance: 0.3
velocity_smoother:
  ros__parameters:
    max_velocity: [0.4, 0.0, 1.3]
    max_decel: [-1.1, 0.0, -3.3]
waypoint_follower:
  ros__parameters:
    stop_on_failure: false
    wait_at_waypoint: {{waypoint_pause_duration: 300}}
"""
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"


def _controller(got: NavigationParameters) -> Any:
    return got.controller_server.controllers["FollowPath"]


def test_names_that_the_nodes_have_are_taken(tmp_path: Path) -> None:
    got, told = applied(tmp_path, FILE.format(plugin=RPP))
    assert got.navigator.bt_loop_duration == 20
    assert got.navigator.error_code_name_prefixes == ("compute_path", "follow_path")
    assert got.controller_server.controller_period_ns == 40_000_000
    assert got.controller_server.costmap_update_timeout_ns == 300_000_000
    assert _controller(got).lookahead_dist == 0.55
    assert got.controller_server.goal_checkers["general_goal_checker"].xy_goal_tolerance == 0.11, (
        "whatever the plugin is called"
    )
    assert got.controller_server.progress_checkers["progress_checker"].movement_time_allowance == 7.0
    assert got.local_costmap.update_period_ns == 250_000_000
    assert got.local_costmap.layers.width == 3.0
    assert got.local_costmap.layers.inflation_radius == 0.66
    assert got.local_costmap.layers.obstacle_max_range == 2.4
    assert got.planner.tolerance == 0.3
    assert got.smoother.linear == AxisLimits(max_velocity=0.4, max_acceleration=0.8, max_deceleration=1.1)
    assert got.smoother.angular.max_velocity == 1.3
    assert not got.waypoints.stop_on_failure
    assert got.waypoints.wait_at_waypoint.waypoint_pause_duration == 300
    assert told == [
        "nav2.yaml: controller_server does not have min_y_velocity_threshold",
        "nav2.yaml: not read for lifecycle_manager",
    ]


def test_a_plugin_that_is_not_here_is_told_and_its_parameters_are_not_taken(tmp_path: Path) -> None:
    got, told = applied(tmp_path, FILE.format(plugin="teb_local_planner::TebLocalPlannerROS"))
    assert _controller(got).lookahead_dist != 0.55
    assert "does not have teb_local_planner::TebLocalPlannerROS (FollowPath.*)" in "\n".join(told)


def test_the_file_chooses_controller_and_planner(tmp_path: Path) -> None:
    text = """\
controller_server:
  ros__parameters:
    FollowPath:
      plugin: nav2_rotation_shim_controller::RotationShimController
      primary_controller: nav2_mppi_controller::MPPIController
      batch_size: 321
planner_server:
  ros__parameters:
    GridBased: {plugin: nav2_navfn_planner/NavfnPlanner, tolerance: 0.3}
    planner_plugins: [GridBased]
"""
    got, _ = applied(tmp_path, text.replace("nav2_navfn_planner/", "nav2_navfn_planner::"))
    assert type(_controller(got).primary_controller).__name__ == "MPPIConfig"
    assert _controller(got).primary_controller.batch_size == 321
    assert type(got.planner).__name__ == "PlannerConfig"
    assert got.planner.tolerance == 0.3
    got, _ = applied(tmp_path, text, {"controller": {"plugin": "dwb"}})
    assert type(_controller(got).primary_controller).__name__ == "DWBConfig", "the scenario goes before it"


def test_what_the_scenario_gives_goes_before_the_file(tmp_path: Path) -> None:
    config: dict[str, object] = {
        "max_linear_speed": "0.3 m/s",
        "controller": {"lookahead_dist": "0.9 m"},
        "planner": {"tolerance": "0.05 m"},
    }
    got, _ = applied(tmp_path, FILE.format(plugin=RPP), config)
    assert got.smoother.linear.max_velocity == 0.3
    assert _controller(got).lookahead_dist == 0.9
    assert got.planner.tolerance == 0.05


def test_a_robot_in_a_namespace_finds_its_own(tmp_path: Path) -> None:
    text = "planner_server: {ros__parameters: {GridBased: {tolerance: 0.3}}}\n"
    text += "two: {planner_server: {ros__parameters: {GridBased: {tolerance: 0.4}}}}\n"
    assert applied(tmp_path, text, namespace="/one")[0].planner.tolerance == 0.3
    assert applied(tmp_path, text, namespace="/two")[0].planner.tolerance == 0.4


def test_mistakes_are_told_all_at_once_with_their_lines(tmp_path: Path) -> None:
    text = """\
planner_server:
  ros__parameters:
    GridBased:
      tolerence: 0.5
      allow_unknown: maybe
controller_server:
  ros__parameters:
    controller_frequency: 0.0
    FollowPath:
      lookahead_dist: far
"""
    with pytest.raises(NavigationError) as caught:
        applied(tmp_path, text)
    said = str(caught.value)
    assert (
        "nav2.yaml:4: planner_server has no parameter GridBased.tolerence; did you mean 'tolerance'?" in said
    )
    assert "nav2.yaml:5: planner_server: GridBased.allow_unknown must be true or false, not 'maybe'" in said
    assert (
        "nav2.yaml:8: controller_server: controller_frequency must be greater than 0 and at most 1000, not 0"
        in said
    )
    assert "nav2.yaml:10: controller_server: FollowPath.lookahead_dist must be a number, not 'far'" in said


@pytest.mark.parametrize(("text", "words"), [("- a", "no mapping"), ("a: [", "no YAML")])
def test_a_file_that_is_none(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(NavigationError, match=words):
        applied(tmp_path, text)


# docks, smoothers, localisation, the collision monitor

MORE = """\
amcl:
  ros__parameters:
    alpha1: 0.2
    max_particles: 3000
    base_frame_id: base_footprint
    transform_tolerance: 1.0
collision_monitor:
  ros__parameters:
    source_timeout: 1.5
    polygons: ["FootprintApproach", "Round", "Slow", "Off"]
    FootprintApproach: {type: polygon, action_type: approach, time_before_collision: 1.2, min_points: 6}
    Round: {type: circle, action_type: stop, radius: 0.3, max_points: 3}
    Slow: {type: polygon, action_type: slowdown, points: "[[0.4, 0.3], [0.4, -0.3], [-0.4, 0.0]]"}
    Off: {type: circle, action_type: stop, radius: 2.0, enabled: false}
docking_server:
  ros__parameters:
    controller_frequency: 20.0
    max_retries: 5
    dock_plugins: ["my_dock"]
    my_dock:
      plugin: "opennav_docking::SimpleChargingDock"
      docking_threshold: 0.07
      use_external_detection_pose: true
      filter_coef: 0.2
    docks: ["home"]
    home: {type: my_dock, frame: map, pose: [1.0, 2.0, 0.5]}
    controller: {k_phi: 3.0, simulation_step: 0.1, projection_time: 2.5}
smoother_server:
  ros__parameters:
    smoother_plugins: ["simple_smoother"]
    simple_smoother: {plugin: "nav2_smoother::SimpleSmoother", max_its: 77}
"""


def test_docks_and_smoothers_of_the_file(tmp_path: Path) -> None:
    got, told = applied(tmp_path, MORE, {"docking": {"max_retries": 1}})
    docking = got.docking
    assert docking.database.docks["home"] == Dock(type="my_dock", pose=Pose2(1.0, 2.0, 0.5))
    kind = docking.database.type_of("my_dock")
    assert (kind.docking_threshold, kind.staging_x_offset) == (0.07, -0.7), "the rest is Nav2's"
    assert kind.is_charger
    assert kind.use_external_detection_pose
    assert kind.filter_coef == 0.2
    assert docking.controller_period_ns == 50_000_000
    assert docking.max_retries == 1, "the scenario goes first"
    assert got.path_smoother.smoothers["simple_smoother"].max_its == 77
    assert docking.controller.projection_time == 2.5
    assert told == ["nav2.yaml: docking_server does not have controller.k_phi, controller.simulation_step"]


def test_a_dock_of_the_file_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(NavigationError) as caught:
        applied(tmp_path, MORE.replace("pose: [1.0, 2.0, 0.5]", "pose: [1.0, 2.0]"))
    assert "docking_server: home.pose must be a list: x, y and yaw" in str(caught.value)
    with pytest.raises(NavigationError, match=r"home\.type must be one of my_dock, tote"):
        applied(tmp_path, MORE.replace("type: my_dock", "type: other"))


def _file(tmp_path: Path, text: str) -> str:
    file = tmp_path / "nav2.yaml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_localisation_of_the_file(tmp_path: Path) -> None:
    given = AmclParameters.model_validate({"max_particles": 1500})
    amcl, told = amcl_with_file(given, _file(tmp_path, MORE), "")
    assert (amcl.filter.alpha1, amcl.filter.max_particles) == (0.2, 1500)
    assert amcl.node.transform_tolerance_ns == 1_000_000_000
    assert told == ["nav2.yaml: amcl does not have base_frame_id"]


def test_the_files_collision_monitor_unless_the_scenario_has_one(tmp_path: Path) -> None:
    file = _file(tmp_path, MORE)
    monitor = monitor_with_file(NavigationConfig(params_file=file), "")
    assert monitor is not None
    assert monitor.source_timeout == 1.5
    approach, circle, slow = monitor.polygons
    assert (approach.points, approach.time_before_collision, approach.min_points) == ((), 1.2, 6)
    assert min(math.hypot(*corner) for corner in circle.points) >= 0.3
    assert circle.min_points == 4, "Nav2's older max_points is one less"
    assert slow.points[2] == (-0.4, 0.0)
    own = CollisionMonitorParameters()
    assert monitor_with_file(NavigationConfig(params_file=file, collision_monitor=own), "") is own
    wrong = _file(tmp_path, MORE.replace("stop, radius: 0.3", "stopp, radius: 0.3"))
    with pytest.raises(NavigationError, match=r"collision_monitor: Round\.action_type must be 'stop'"):
        monitor_with_file(NavigationConfig(params_file=wrong), "")


def test_one_file_for_every_robot_that_navigates(tmp_path: Path) -> None:
    scenario = load(ROOT / "scenarios" / "warehouse_charger.yaml").with_params_file(tmp_path / "nav2.yaml")
    navigation = scenario.robots[0].navigation
    assert navigation is not None
    assert navigation.params_file == str(tmp_path / "nav2.yaml")
    assert "charger" in navigation.docking.docks
    with pytest.raises(ScenarioError, match="no robot of 'r2d2_circle' has it"):
        load(ROOT / "scenarios" / "r2d2_circle.yaml").with_params_file(tmp_path / "nav2.yaml")


# what a user's own file may have


def _said(tmp_path: Path, text: str) -> list[str]:
    with pytest.raises(NavigationError) as caught:
        applied(tmp_path, text)
    return [problem.message for problem in caught.value.problems]


def test_names_of_nav2_that_look_like_mistakes_are_none(tmp_path: Path) -> None:
    text = """\
planner_server:
  ros__parameters:
    GridBased: {plugin: nav2_smac_planner::SmacPlannerHybrid, analytic_expansion_max_cost: 200.0}
"""
    told = applied(tmp_path, text)[1]
    assert told == ["nav2.yaml: planner_server does not have GridBased.analytic_expansion_max_cost"]


def _costmap(tmp_path: Path, text: str, config: dict[str, object] | None = None) -> CostmapNodeConfig:
    got, _ = applied(
        tmp_path,
        f"local_costmap: {{local_costmap: {{ros__parameters: {{{text}}}}}}}",
        {"local_costmap": config or {}},
    )
    return got.local_costmap


def test_outlines_as_nav2_writes_them(tmp_path: Path) -> None:
    corners = "footprint: '[[0.4, 0.2], [0.4, -0.2], [-0.3, 0]]'"
    expected = ((0.4, 0.2), (0.4, -0.2), (-0.3, 0.0))
    assert _costmap(tmp_path, corners).layers.footprint == expected
    assert _costmap(tmp_path, f"{corners}, robot_radius: 0.5").layers.footprint == expected, "as in Nav2"
    round_ = _costmap(tmp_path, "robot_radius: 0.5, footprint: '[]'").layers
    assert round_.inscribed_radius == pytest.approx(0.5, rel=0.02), "not the model's footprint"
    own = _costmap(tmp_path, "robot_radius: 0.5", {"robot_radius": "0.2 m"}).layers
    assert own.inscribed_radius == pytest.approx(0.2, rel=0.02)
    text = "local_costmap: {local_costmap: {ros__parameters: {footprint: '[[1, 2]]'}}}"
    assert _said(tmp_path, text) == ["local_costmap/local_costmap: footprint must be a list, not '[[1, 2]]'"]


def test_layers_have_what_is_theirs_whatever_they_are_called(tmp_path: Path) -> None:
    voxels = "plugin: 'nav2_costmap_2d::VoxelLayer', mark_threshold: 0, obstacle_max_range: 1.5"
    got = _costmap(tmp_path, f"front: {{{voxels}}}")
    assert got.layers.obstacle_max_range == 1.5
    assert got.layers.range_sensor_layer.mark_threshold == 0.8, "voxels' is another thing"
    sonar = "plugin: 'nav2_costmap_2d::RangeSensorLayer', mark_threshold: 0.7, topics: [/sonar, /sonar_2]"
    got = _costmap(tmp_path, f"sonar: {{{sonar}}}")
    assert got.layers.range_sensor_layer.mark_threshold == 0.7
    assert got.range_topics == ("sonar", "sonar_2")


def test_sources_of_a_costmap(tmp_path: Path) -> None:
    layer = """layer: {plugin: 'nav2_costmap_2d::ObstacleLayer', observation_sources: front rear cloud,
        front: {topic: /front/scan, data_type: LaserScan}, rear: {data_type: LaserScan},
        cloud: {topic: /points}}"""
    assert _costmap(tmp_path, layer).scan_topics == ("front/scan", "rear")
    assert _costmap(tmp_path, layer, {"scan_topics": ["mine"]}).scan_topics == ("mine",)
    assert _costmap(tmp_path, f"plugins: [other], {layer}").scan_topics == ("scan",), (
        "Nav2 reads no such layer"
    )
    told = applied(tmp_path, f"local_costmap: {{local_costmap: {{ros__parameters: {{{layer}}}}}}}")[1]
    assert told == []
    (cloud,) = _costmap(tmp_path, layer).observation_sources
    assert (cloud.topic, cloud.layer) == ("points", "obstacle_layer")


def test_a_voxel_layer_with_its_clouds(tmp_path: Path) -> None:
    layer = """plugins: [voxels], voxels: {plugin: 'nav2_costmap_2d::VoxelLayer', z_voxels: 8,
        publish_voxel_map: true, max_obstacle_height: 1.2, observation_sources: scan camera,
        scan: {topic: /scan, data_type: LaserScan},
        camera: {topic: /camera/depth/points, clearing: true, min_obstacle_height: 0.1,
                 max_obstacle_height: 1.8, obstacle_max_range: 3.5}}"""
    got = _costmap(tmp_path, layer)
    assert (got.layers.voxel_layer.z_voxels, got.layers.voxel_layer.publish_voxel_map) == (8, True)
    assert got.scan_topics == ("scan",)
    (camera,) = got.observation_sources
    assert camera == ObservationSource(
        topic="camera/depth/points",
        clearing=True,
        min_obstacle_height=0.1,
        max_obstacle_height=1.2,
        obstacle_max_range=3.5,
    )
    assert applied(tmp_path, f"local_costmap: {{local_costmap: {{ros__parameters: {{{layer}}}}}}}")[1] == []
    assert not _costmap(tmp_path, layer.replace("z_voxels", "enabled: false, z_voxels")).observation_sources
    assert _costmap(tmp_path, layer, {"observation_sources": []}).observation_sources == ()
    with pytest.raises(NavigationError, match=r"min_obstacle_height is 1.5, more than max_obstacle_height"):
        _costmap(tmp_path, layer.replace("min_obstacle_height: 0.1", "min_obstacle_height: 1.5"))


@pytest.mark.parametrize("tolerance", [-1.0, -0.1, 0.0])
def test_any_failure_tolerance_is_one(tmp_path: Path, tolerance: float) -> None:
    got, _ = applied(tmp_path, f"controller_server: {{ros__parameters: {{failure_tolerance: {tolerance}}}}}")
    assert got.controller_server.failure_tolerance_ns == round(tolerance * 1e9)


@pytest.mark.parametrize(
    ("name", "model"),
    [
        ("differential", "nav2_amcl::DifferentialMotionModel"),
        ("omnidirectional", "nav2_amcl::OmniMotionModel"),
    ],
)
def test_motion_models_of_amcl_as_they_were_called_first(tmp_path: Path, name: str, model: str) -> None:
    file = _file(tmp_path, f"amcl: {{ros__parameters: {{robot_model_type: {name}}}}}")
    got, told = amcl_with_file(AmclParameters(), file, "")
    assert (got.filter.robot_model_type, told) == (model, [])


def test_values_that_cannot_be(tmp_path: Path) -> None:
    text = """\
controller_server:
  ros__parameters:
    failure_tolerance: -1.0
    FollowPath:
      plugin: nav2_mppi_controller::MPPIController
      motion_model: Omni
      critics: [ConstraintCritic, CostCritc, MyCritic]
      CostCritic: {cost_weight: -3.0}
planner_server:
  ros__parameters:
    GridBased:
      plugin: nav2_smac_planner::SmacPlannerHybrid
      motion_model_for_search: LATTICE
      minimum_turning_radius: 0.0
      max_iterations: -1
velocity_smoother:
  ros__parameters:
    max_velocity: ["fast", "slow", "slow"]
"""
    assert _said(tmp_path, text) == [
        "controller_server: FollowPath.motion_model must be 'DiffDrive' or 'Ackermann', not 'Omni'",
        "controller_server has no critic 'CostCritc'; did you mean 'CostCritic'?",
        "controller_server: FollowPath.CostCritic.cost_weight must be at least 0, not -3.0",
        "planner_server: GridBased.motion_model_for_search must be 'DUBIN' or 'REEDS_SHEPP', not 'LATTICE'",
        "planner_server: GridBased.minimum_turning_radius must be greater than 0 and at most 100, not 0.0",
    ]


def test_what_would_divide_by_zero(tmp_path: Path) -> None:
    text = """\
velocity_smoother: {ros__parameters: {max_accel: [1.0, 0.0, 3.0], max_decel: [0.0, 0.0, -3.0]}}
bt_navigator: {ros__parameters: {bt_loop_duration: 0}}
waypoint_follower: {ros__parameters: {loop_rate: 0}}
"""
    assert _said(tmp_path, text) == [
        "velocity_smoother: max_decel must be greater than 0, not 0.0",
        "bt_navigator: bt_loop_duration must be at least 1 and at most 1000000, not 0",
        "waypoint_follower: loop_rate must be at least 1 and at most 1000, not 0",
    ]


def test_names_of_other_releases(tmp_path: Path) -> None:
    text = """\
controller_server:
  ros__parameters:
    progress_checker_plugin: moves
    moves: {plugin: nav2_controller::PoseProgressChecker, required_movement_angle: 0.2}
    goal_checker_plugins: [rests]
    rests: {plugin: nav2_controller::StoppedGoalChecker, trans_stopped_velocity: 0.1}
    FollowPath:
      plugin: nav2_mppi_controller::MPPIController
      motion_model: ackermann
      AckermannConstraints: {min_turning_r: 0.7}
planner_server:
  ros__parameters:
    GridBased: {plugin: nav2_navfn_planner/NavfnPlanner}
"""
    got, told = applied(tmp_path, text)
    assert told == []
    assert type(got.planner).__name__ == "PlannerConfig"
    assert (_controller(got).motion_model, _controller(got).min_turning_r) == ("Ackermann", 0.7)
    assert got.controller_server.progress_checkers["progress_checker"].required_movement_angle == 0.2
    assert got.controller_server.goal_checkers["general_goal_checker"].trans_stopped_velocity == 0.1


def test_numbers_that_are_valid_only_together(tmp_path: Path) -> None:
    file = _file(tmp_path, "amcl: {ros__parameters: {min_particles: 3000, max_particles: 5000}}")
    amcl, _ = amcl_with_file(AmclParameters(), file, "")
    assert (amcl.filter.min_particles, amcl.filter.max_particles) == (3000, 5000)
    file = _file(tmp_path, "amcl: {ros__parameters: {min_particles: 5000}}")
    with pytest.raises(NavigationError, match=r"yaml:1: amcl: min_particles is 5000, more than"):
        amcl_with_file(AmclParameters(), file, "")


def test_what_a_scenario_gives_must_fit_together() -> None:
    given = CostmapParameters.whole().model_validate({"raytrace_min_range": 2.0})
    assert given.over(CostmapConfig()).raytrace_min_range == 2.0
    with pytest.raises(ScenarioError, match="raytrace_min_range is 2, more than raytrace_max_range, 1"):
        given.over(CostmapConfig(raytrace_max_range=1.0))


def test_a_monitors_sources_and_what_it_lacks(tmp_path: Path) -> None:
    text = """\
collision_monitor:
  ros__parameters:
    polygons: [Stop, Turning]
    Stop: {type: polygon, action_type: stop, points: "[[0.4, 0.3], [0.4, -0.3], [-0.4, 0.0]]", visualize: 1}
    Turning: {type: velocity_polygon, action_type: stop, velocity_polygons: [slow]}
    NotListed: {type: circle, action_type: stop, radius: 1.0}
    observation_sources: [front, sonar, cloud]
    front: {type: scan, topic: /front/scan}
    sonar: {type: range, topic: /sonar}
    cloud: {type: pointcloud, topic: /points, max_height: 1.2}
"""
    monitor = monitor_with_file(NavigationConfig(params_file=_file(tmp_path, text)), "")
    assert monitor.polygons is not None
    assert [polygon.name for polygon in monitor.polygons] == ["Stop"], "no footprint in place of Turning"
    assert (monitor.scan_topics, monitor.range_topics) == (("front/scan",), ("sonar",))
    assert [cloud.config() for cloud in monitor.clouds] == [MonitorCloud(topic="points", max_height=1.2)]
    assert applied(tmp_path, text)[1] == [
        "nav2.yaml: collision_monitor does not have Stop.visualize, Turning.type, Turning.action_type, "
        "Turning.velocity_polygons"
    ]
    wrong = text.replace("Stop: {type", "Stop: {slowdown_ration: 0.4, type").replace("-0.4, 0.0]]", "-0.4]]")
    assert _said(tmp_path, wrong) == [
        "collision_monitor has no parameter Stop.slowdown_ration; did you mean 'slowdown_ratio'?",
        "collision_monitor: Stop.points must be corners '[[x, y], ...]', "
        "not '[[0.4, 0.3], [0.4, -0.3], [-0.4]]'",
    ]
    for circle, said in (
        ("Stop: {type: circle, action_type: stop}", "Stop.type is circle, which needs a radius"),
        ("Stop: {type: circle, action_type: stop, radius: wide}", "Stop.radius must be a number, not 'wide'"),
    ):
        one = f"collision_monitor: {{ros__parameters: {{polygons: [Stop], {circle}}}}}"
        assert _said(tmp_path, one) == [f"collision_monitor: {said}"]


@pytest.mark.parametrize("seed", ["0", "1"])  # which order a set of the two names the other way
def test_of_two_faults_the_same_one_is_told_each_time(tmp_path: Path, seed: str) -> None:
    text = """\
collision_monitor:
  ros__parameters:
    polygons: [Stop]
    Stop: {type: circle, action_type: stop, radius: wide, max_points: many}
"""
    code = (
        "import sys; from twin.runtime.parameter_files.nav2.parameters import monitor_with_file as read\n"
        "from twin.scenario.navigation import NavigationConfig\n"
        "try: read(NavigationConfig(params_file=sys.argv[1]), '')\n"
        "except Exception as error: print(error)"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, _file(tmp_path, text)],
        env={**os.environ, "PYTHONHASHSEED": seed},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "Stop.radius must be a number, not 'wide'" in told
