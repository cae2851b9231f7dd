"""Parameter files of robot_localization and slam_toolbox: what is taken, what is told, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.bridge.topics import Sample
from twin.errors import NavigationError
from twin.geometry import Pose2
from twin.navigation.mapping.slam import Slam
from twin.nodes.navigation.localisation.ekf_config import EkfNodeConfig, for_robot
from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.nodes.navigation.robot_pose import Frames
from twin.runtime.parameter_files.ekf import ekf_with_file
from twin.runtime.parameter_files.localisation import localisation_nodes
from twin.runtime.parameter_files.slam import slam_with_file
from twin.runtime.run import Run
from twin.scenario.robots import RobotConfig
from twin.scenario.schema import Scenario

_DEFAULT = for_robot("odom", "base_footprint", 20_000_000, "imu", 0.004)


def states(*chosen: int) -> str:
    return f"[{', '.join('true' if i in chosen else 'false' for i in range(15))}]"


EKF = f"""\
### of a robot with an indoor floor
NODE:
  ros__parameters:
    frequency: 40.0
    sensor_timeout: 0.1
    two_d_mode: false
    print_diagnostics: true
    publish_tf: true
    transform_time_offset: 0.05
    map_frame: map
    odom_frame: odom
    base_link_frame: base_link
    world_frame: odom
    odom0: /wheels
    odom0_config: {states(6, 7, 11)}
    odom0_queue_size: 3
    odom0_nodelay: true
    odom0_twist_rejection_threshold: 4.5
    twist0: flow
    twist0_config: {states(6)}
    twist0_rejection_threshold: 2
    imu0: imu
    imu0_config: {states(5, 11)}
    imu0_relative: true
    imu0_remove_gravitational_acceleration: false
    use_control: false
    control_timeout: 0.2
    initial_state: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    process_noise_covariance: [{", ".join("0.5" if i % 16 == 0 else "0.0" for i in range(225))}]
"""
SLAM = """\
SLAM_NODE:
  ros__parameters:
    solver_plugin: solver_plugins::CeresSolver
    ceres_loss_function: None
    odom_frame: odom
    map_frame: map
    base_frame: base_link
    scan_topic: /front/scan
    mode: mapping #localization
    map_start_pose: [1.0, 2.0, 0.5]
    throttle_scans: 2
    transform_publish_period: 0.02 #if 0 never publishes odometry
    map_update_interval: 5.0
    resolution: 0.1
    max_laser_range: 12
    minimum_time_interval: 0.5
    transform_timeout: 0.1
    minimum_travel_distance: 0.25
    minimum_travel_heading: 0.3
    loop_search_maximum_distance: 4.0
    fine_search_angle_offset: 0.00349
"""


def robot(**keys: object) -> RobotConfig:
    return RobotConfig.model_validate({"model": "warehouse_bot", **keys})


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], str]:
    def write_(text: str) -> str:
        path = tmp_path / "params.yaml"
        path.write_text(text, "utf-8")
        return str(path)

    return write_


Write = Callable[[str], str]


def ekf(path: str, namespace: str = "") -> tuple[EkfNodeConfig, list[str]]:
    config = robot(odometry={"type": "ekf", "params_file": path})
    return ekf_with_file(_DEFAULT, config, namespace, {"imu": 0.004})


def slam(path: str, **keys: object) -> tuple[SlamNodeConfig, Pose2 | None, list[str]]:
    config = robot(localisation={"type": "slam", "params_file": path, **keys}, navigation={})
    own = {"mode": keys.get("mode", "mapping"), "map_file_name": keys.get("pose_graph", "")}
    return slam_with_file(SlamNodeConfig(**own), config, Frames(), "")  # type: ignore[arg-type]


@pytest.mark.parametrize("node", ["ekf_filter_node", "ekf_node", "ekf_localization_node", "/**"])
def test_a_filter_is_read_whatever_its_node_is_called(write: Write, node: str) -> None:
    config, told = ekf(write(EKF.replace("NODE", node)))
    assert (config.period_ns, config.transform_time_offset_ns) == (25_000_000, 50_000_000)
    assert not config.ekf.two_d_mode
    assert len(config.ekf.process_noise_covariance) == 225
    odom0, twist0, imu0 = (config.sources[name] for name in ("odom0", "twist0", "imu0"))
    assert (odom0.topic, odom0.queue_size, odom0.twist_rejection_threshold) == ("wheels", 3, 4.5)
    assert [i for i, taken in enumerate(odom0.config) if taken] == [6, 7, 11]
    assert twist0.twist_rejection_threshold == 2.0
    assert (imu0.relative, imu0.remove_gravitational_acceleration, imu0.bias_stddev) == (True, False, 0.004)
    assert config.base_link_frame == "base_footprint"
    if node != "/**":
        assert told == [
            f"params.yaml: {node} does not have initial_state; sensor_timeout, print_diagnostics, "
            "odom0_nodelay, use_control, control_timeout would change nothing here",
            f"params.yaml: {node}: the robot's own base_link_frame is base_footprint, not base_link",
        ]


def test_what_a_file_does_not_name_is_no_source(write: Write) -> None:
    config, told = ekf(write("ekf_node:\n  ros__parameters:\n    odom0: odom\n"))
    assert list(config.sources) == ["odom0"]
    assert told == ["params.yaml: ekf_node takes nothing from odom0: config is false"]
    assert config.ekf == _DEFAULT.ekf


def test_of_two_filters_the_one_of_odometry_is_read(write: Write) -> None:
    second = EKF.replace("NODE", "ekf_map").replace("world_frame: odom", "world_frame: map")
    config, told = ekf(write(EKF.replace("NODE", "ekf_odom") + second))
    assert config.period_ns == 25_000_000
    assert "params.yaml: not read for ekf_map" in told
    with pytest.raises(NavigationError, match="it has several: ekf_a, ekf_b"):
        ekf(write(EKF.replace("NODE", "ekf_a") + EKF.replace("NODE", "ekf_b")))
    with pytest.raises(NavigationError, match="it has none"):
        ekf(write("navsat_transform:\n  ros__parameters:\n    delay: 3.0\n"))
    with pytest.raises(NavigationError, match=r"params.yaml:13: ekf_map: world_frame is map"):
        ekf(write(second))


def test_topics_are_those_of_the_robot_s_namespace(write: Write) -> None:
    text = EKF.replace("NODE", "r1/ekf_node").replace("/wheels", "/r1/wheels")
    assert ekf(write(text), "/r1")[0].sources["odom0"].topic == "wheels"


def test_a_filter_s_mistakes_are_told_all_at_once(write: Write) -> None:
    text = f"""\
ekf_filter_node:
  ros__parameters:
    frequency: 0.0
    two_d_mode: maybe
    odom0: odometry/filtered
    odom0_config: [true, false]
    odom0_diferential: true
    odom0_pose_rejection_threshold: -1.0
    imu0: imu
    imu0_config: {states(11)}
    process_noise_covariance: [1.0, 2.0]
"""
    with pytest.raises(NavigationError) as error:
        ekf(write(text))
    assert [problem.line for problem in error.value.problems] == [3, 4, 5, 6, 7, 8, 11]
    said = str(error.value)
    assert "odom0_config must have 15 values, not 2" in said
    assert "did you mean 'odom0_differential'?" in said


@pytest.mark.parametrize("node", ["slam_toolbox", "async_slam_toolbox_node"])
def test_slam_takes_what_it_has(write: Write, node: str) -> None:
    config, start, told = slam(write(SLAM.replace("SLAM_NODE", node)))
    assert (config.throttle_scans, config.scan_topic, config.mode) == (2, "front/scan", "mapping")
    assert (config.map_update_interval_ns, config.transform_timeout_ns) == (5_000_000_000, 100_000_000)
    assert (config.slam.resolution, config.slam.max_laser_range) == (0.1, 12.0)
    assert (config.slam.minimum_travel_distance, config.slam.minimum_travel_heading) == (0.25, 0.3)
    assert config.slam.loop_search_maximum_distance == 4.0
    assert start is None  # without a graph there is nothing to start in
    assert told == [
        f"params.yaml: {node} does not have minimum_time_interval, fine_search_angle_offset; "
        "ceres_loss_function, transform_publish_period would change nothing here",
        f"params.yaml: {node}: the robot's own base_frame is base_footprint, not base_link",
    ]


def test_slam_localises_in_the_file_s_graph(write: Write, tmp_path: Path) -> None:
    text = SLAM.replace("SLAM_NODE", "slam_toolbox").replace("mapping #", "") + "    map_file_name: hall\n"
    with pytest.raises(
        NavigationError, match=r"params.yaml:22: slam_toolbox: map_file_name is hall, but .*hall"
    ):
        slam(write(text))
    saved = Slam()
    saved.process(Pose2(0.0, 0.0, 0.0), np.full(90, 2.0), np.linspace(-1.0, 1.0, 90), Pose2(0.0, 0.0, 0.0), 0)
    saved.save(tmp_path / "hall.posegraph")
    config, start, _ = slam(write(text))
    assert (config.mode, config.map_file_name) == ("localization", str(tmp_path / "hall.posegraph"))
    assert start == Pose2(1.0, 2.0, 0.5)
    assert slam(write(text), mode="mapping")[0].mode == "mapping"  # the scenario's


def test_slam_s_mistakes_are_told_all_at_once(write: Write) -> None:
    text = SLAM.replace("SLAM_NODE", "slam_toolbox").replace("mapping #", "")
    text = text.replace("resolution: 0.1", "resolution: -0.1").replace("scans: 2", "scans: 0")
    with pytest.raises(NavigationError) as error:
        slam(write(text.replace("max_laser_range", "max_lazer_range")))
    assert [problem.line for problem in error.value.problems] == [9, 11, 14, 15]
    assert "mode is localization, which needs map_file_name" in str(error.value)
    with pytest.raises(NavigationError, match="mode must be mapping or localization, not 'lifelong'"):
        slam(write(text.replace("localization", "lifelong")))


def test_navigation_s_file_serves_all(write: Write) -> None:
    path = write(EKF.replace("NODE", "ekf_node") + SLAM.replace("SLAM_NODE", "slam_toolbox"))
    keys = {"odometry": {"type": "ekf"}, "localisation": {"type": "slam"}}
    config = robot(**keys, navigation={"params_file": path})
    assert ekf_with_file(_DEFAULT, config, "", {})[0].period_ns == 25_000_000
    assert slam_with_file(SlamNodeConfig(), config, Frames(), "")[0].slam.resolution == 0.1
    assert localisation_nodes(config, "") == ("ekf_node", "slam_toolbox")
    wheels = robot(localisation={"type": "odometry"}, navigation={"params_file": path})
    assert localisation_nodes(wheels, "") == ()


RUN = """\
name: filtered
duration: 1 s
world: {}
robots:
  - model: warehouse_bot
    odometry:
      type: ekf
      params_file: params.yaml
      parameters: {frequency: 20.0, sources: {odom0: {topic: odom}}}
mission: {type: velocity_profile, robot: warehouse_bot, steps: [{duration: 1 s, linear: 0.5, angular: 0.5}]}
checks: [{no_collision: }]
"""


def test_a_run_with_a_file_and_a_scenario_that_knows_better(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run], write: Write
) -> None:
    write(EKF.replace("NODE", "ekf_node").replace("publish_tf: true", "publish_tf: false"))
    run = make_run(scenario(RUN))
    node = next(node for node in run.bus.nodes if node.name == "ekf_filter_node")
    assert node.get_parameter("frequency").value == 20.0
    assert node.get_parameter("odom0").value == "odom"
    wheels = next(node for node in run.bus.nodes if node.name == "diff_drive_controller")
    assert wheels.get_parameter("enable_odom_tf").value is True  # for the filter does not


def test_unread_values_change_nothing_but_what_is_told(
    scenario: Callable[[str], Scenario], make_run: Callable[..., Run], write: Write
) -> None:
    heard: list[list[tuple[str, bytes]]] = []
    told: list[list[str]] = []
    for more in ("", "    use_control: true\n    debug: true\n    imu0_nodelay: true\n"):
        text = EKF.replace("NODE", "ekf_node").replace("    use_control: false\n", "")
        write(text + more)
        messages, said = [], []

        def tap(sample: Sample[Any], messages: Any = messages, said: Any = said) -> None:
            if sample.topic == "/rosout":
                said.append(sample.message.msg)
            else:
                messages.append((sample.topic, bytes(sample.payload)))

        run = make_run(scenario(RUN), taps=[tap])
        while not run.over:
            run.tick()
        heard.append(messages)
        told.append(said)
    assert any(topic == "/odometry/filtered" for topic, _ in heard[0])
    assert heard[0] == heard[1]
    assert told[0] != told[1]
    assert (
        "twist0: nobody publishes /flow; there is no geometry_msgs/msg/TwistWithCovarianceStamped" in told[0]
    )
