"""Robots that pass for hardware."""

from __future__ import annotations

import csv
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from twin.bridge import live
from twin.bridge.graph import Graph
from twin.bridge.msgs import LaserScan, Odometry, Twist, new, ns
from twin.bridge.wire.session import SessionConfig
from twin.errors import ScenarioError
from twin.live.perturbations import perturbed
from twin.live.plant import Plant
from twin.scenario.schema import load

START_NS = 1_700_000_000_000_000_000


def plant(perturb: str = "", **options: Any) -> Plant:
    scenario, error = perturbed(load("diff_bot_figure8"), perturb)
    return Plant(scenario, error=error, network=SessionConfig(), pace=None, start_ns=START_NS, **options)


def drive(robots: Plant, seconds: float, speed: float | None = None) -> dict[str, list[Any]]:
    """Go on for so long, with a speed commanded if there is one; return what the robot said on two topics."""
    heard: dict[str, list[Any]] = {"odom": [], "scan": []}
    bus = robots.run.run.bus
    node = bus.create_node("listener")
    node.create_subscription(Odometry, "/odom", heard["odom"].append, 10)
    node.create_subscription(LaserScan, "/scan", heard["scan"].append, 10)
    if speed is not None:
        commands = node.create_publisher(Twist, "/cmd_vel", 10)
        message = new(Twist)
        message.linear.x = speed
        node.create_timer(50_000_000, lambda: commands.publish(message))
    world = robots.run.run.world
    robots.advance(lambda: world.time_ns >= seconds * 1e9)
    return heard


def test_its_clock_is_its_own_and_nobody_is_told_of_another() -> None:
    with plant("clock_offset=0.4s,clock_drift=1000ppm") as robots:
        heard = drive(robots, 2.0)
        graph = Graph.snapshot(robots.run.run.bus)
    for name in ("odom", "scan"):
        stamps = [ns(message.header.stamp) - START_NS for message in heard[name]]
        period_ns = stamps[-1] - stamps[-2]
        # 2 s by ours are 2.002 s by a clock that is 1000 ppm too fast; it was 0.4 s ahead.
        assert 2_402_000_000 - period_ns <= stamps[-1] <= 2_402_000_000
    assert period_ns % 1_001_000 == 0  # and not a whole number of ours
    assert "/clock" not in {end.name for end in graph.endpoints}


def test_nothing_on_it_knows_of_a_simulation_or_of_faults() -> None:
    with plant("wheel_radius=0.9,latency=80ms") as robots:
        nodes = {node.name for node in Graph.snapshot(robots.run.run.bus).nodes}
    assert "diff_drive_controller" in nodes
    assert not nodes & {"clock", "faults", "behavior_server", "amcl", "velocity_profile"}


def test_autonomy_is_on_it_only_if_asked_for() -> None:
    with plant() as robots:
        assert abs(drive(robots, 1.0)["odom"][-1].pose.pose.position.x) < 1e-3
    with plant(autonomy=True) as robots:
        assert drive(robots, 1.0)["odom"][-1].pose.pose.position.x > 0.05


def test_it_is_there_when_its_mission_is_over() -> None:
    scenario = load("diff_bot_figure8", {"mission.steps": "[{duration: 0.5 s, linear: 0.2 m/s}]"})
    with Plant(scenario, network=SessionConfig(), pace=None, start_ns=START_NS, autonomy=True) as robots:
        heard = drive(robots, 4.0)
    assert ns(heard["odom"][-1].header.stamp) >= START_NS + 3_900_000_000


def test_a_perturbed_wheel_drives_another_way_than_odometry_believes(tmp_path: Path) -> None:
    with plant("wheel_radius=0.9", truth=tmp_path / "truth.csv") as robots:
        believed = drive(robots, 3.0, speed=0.4)["odom"][-1].pose.pose.position.x
    with (tmp_path / "truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["robot"] for row in rows} == {"diff_bot"}
    assert int(rows[0]["stamp_ns"]) == START_NS, "the first odometry is of then"
    assert int(rows[-1]["stamp_ns"]) == START_NS + 3_000_000_000
    assert float(rows[-1]["x"]) == pytest.approx(0.9 * believed, rel=0.02)


def test_without_commands_it_stops_by_itself() -> None:
    with plant() as robots:
        bus, world = robots.run.run.bus, robots.run.run.world
        heard: list[Any] = []
        node = bus.create_node("listener")
        node.create_subscription(Odometry, "/odom", heard.append, 10)
        commands = node.create_publisher(Twist, "/cmd_vel", 10)
        message = new(Twist)
        message.linear.x = 0.4
        node.create_timer(50_000_000, lambda: world.time_ns < 1e9 and commands.publish(message))
        robots.advance(lambda: world.time_ns >= 1e9)
        assert heard[-1].twist.twist.linear.x > 0.3
        robots.advance(lambda: world.time_ns >= 2.5e9)
    assert abs(heard[-1].twist.twist.linear.x) < 0.01


def test_every_wrong_perturbation_is_told_at_once() -> None:
    with pytest.raises(ScenarioError) as told:
        perturbed(load("diff_bot_figure8"), "wheelradius=0.97, track=-1, clock_drift=3, mass")
    assert [problem.message for problem in told.value.problems] == [
        "--perturb wheelradius=0.97: there is no 'wheelradius'; did you mean 'wheel_radius'? Valid: "
        "clock_drift, clock_offset, duplication, flat_battery, friction, latency, link_delay, loss, mass, "
        "slippery_floor, track, weak_motor, wheel_radius",
        "--perturb mass: must be KEY=VALUE, such as wheel_radius=0.97",
        "override clock_drift=3: clock_drift: must be less than 0.1, not 3",
        "override track=-1: faults.0.track: must be greater than 0.0, not -1",
    ]


def test_a_program_of_its_own_that_ends_with_ctrl_c(endpoint: str, tmp_path: Path) -> None:
    truth = tmp_path / "new" / "truth.csv"
    words = ["plant", "diff_bot_figure8", "--listen", endpoint, "--truth", str(truth)]
    command = [sys.executable, "-m", "twin.cli", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == f"diff_bot at {endpoint}; Ctrl-C ends it\n"
        with live.join((endpoint,)) as here:
            heard: list[Any] = []
            here.bus.create_node("listener").create_subscription(Odometry, "/odom", heard.append, 10)
            assert here.spin(lambda: len(heard) >= 3, timeout_s=100.0)
        process.send_signal(signal.SIGINT)
        assert process.wait(100) == 0
    stamps = {row["stamp_ns"] for row in csv.DictReader(truth.read_text().splitlines())}
    assert {str(ns(message.header.stamp)) for message in heard} <= stamps
    assert abs(ns(heard[-1].header.stamp) - time.time_ns()) < 600e9, "it tells the time of day"
