from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from twin.recording.read_back import read

from .conftest import ROOT, Start

Command = Callable[..., tuple[int, str, str]]
S = 1_000_000_000
STEP = 16_000_000


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    return importlib.import_module("turtle_world")


def test_a_command_lasts_for_a_second(world: ModuleType) -> None:
    turtle = world.Turtle(world.Sheet())
    turtle.command(1.0, 0.0, 0.0, 0)
    for step in range(1, 126):
        turtle.step(step * STEP)
    assert turtle.velocity == (0.0, 0.0, 0.0)
    assert turtle.x == pytest.approx(5.544444 + 62 * 0.016, abs=1e-5)
    assert turtle.y == pytest.approx(5.544444, abs=1e-5)


def test_a_circle_ends_where_it_began(world: ModuleType) -> None:
    turtle = world.Turtle(world.Sheet())
    steps = 393  # of 16 mrad: 2 pi
    farthest = 0.0
    for step in range(steps):
        turtle.command(1.0, 0.0, 1.0, step * STEP)
        turtle.step(step * STEP)
        farthest = max(farthest, turtle.y)
    assert (turtle.x, turtle.y) == pytest.approx((5.5444, 5.5444), abs=0.02)
    assert farthest == pytest.approx(5.5444 + 2.0, abs=0.02)


def test_a_wall_stops_the_turtle_and_says_where_it_would_be(world: ModuleType) -> None:
    turtle = world.Turtle(world.Sheet(), x=11.0, y=5.0)
    turtle.command(10.0, 0.0, 0.0, 0)
    assert turtle.step(STEP) == pytest.approx((11.16, 5.0))
    assert turtle.x == pytest.approx(11.088889, abs=1e-6)


def test_the_pen_draws_every_move_and_teleportation(world: ModuleType) -> None:
    sheet = world.Sheet()
    turtle = world.Turtle(sheet)
    assert sheet.color((turtle.x, turtle.y)) is None
    turtle.pen = world.Pen(1, 2, 3, 2)
    turtle.teleport(2.0, 8.0, 0.0)
    turtle.teleport_relative(3.0, math.pi / 2)
    assert (turtle.x, turtle.y) == pytest.approx((2.0, 11.0))
    assert sheet.color((2.0, 9.5)) == (1, 2, 3)
    assert sheet.color((3.0, 9.5)) is None
    turtle.pen = world.Pen(off=True)
    turtle.teleport(9.0, 1.0, 0.0)
    assert len(sheet.strokes) == 2
    sheet.clear()
    assert sheet.color((2.0, 9.5)) is None


def pose(command: Command, name: str = "turtle1") -> dict[str, float]:
    lines = command("topic", "echo", "--once", f"/{name}/pose")[1].split("---")[0].splitlines()
    return {key: float(value) for key, value in (line.split(": ") for line in lines)}


def test_the_turtle_is_seen_and_driven_as_in_turtlesim(
    start: Start, command: Command, tmp_path: Path
) -> None:
    recording = tmp_path / "turtle.rrd"
    sim = start("turtlesim", "--rerun", str(recording))
    sim.wait_for("Spawning turtle [turtle1] at x=[5.544444], y=[5.544444], theta=[0.000000]\n")
    first = pose(command)
    assert (first["x"], first["y"], first["theta"]) == pytest.approx((5.544445, 5.544445, 0.0), abs=2e-6)

    twist = "{linear: {x: 2.0}, angular: {z: 1.8}}"
    assert command("topic", "pub", "--once", "/turtle1/cmd_vel", "geometry_msgs/msg/Twist", twist)[0] == 0
    assert pose(command) != first

    call = ("service", "call")
    spawned = command(*call, "/spawn", "turtlesim/srv/Spawn", "{x: 2, y: 3, name: other}")[1]
    assert "turtlesim.srv.Spawn_Response(name='other')" in spawned
    there = "{x: 1.0, y: 2.0, theta: 0.5}"
    assert command(*call, "/other/teleport_absolute", "turtlesim/srv/TeleportAbsolute", there)[0] == 0
    assert pose(command, "other")["theta"] == pytest.approx(0.5)
    goal = ("/other/rotate_absolute", "turtlesim/action/RotateAbsolute", "{theta: 0.7}")
    assert "Goal finished with status: SUCCEEDED" in command("action", "send_goal", *goal)[1]
    assert pose(command, "other")["theta"] == pytest.approx(0.7, abs=0.03)
    assert command(*call, "/kill", "turtlesim/srv/Kill", "{name: other}")[0] == 0
    assert "/other/pose" not in command("topic", "list")[1]

    assert command("param", "set", "/turtlesim", "background_r", "200")[0] == 0
    refused = command("param", "set", "/turtlesim", "background_r", "300")
    assert refused[0] == 1
    assert command(*call, "/reset", "std_srvs/srv/Empty")[0] == 0
    color = command("topic", "echo", "--once", "/turtle1/color_sensor")[1]
    assert color.startswith("r: 200\ng: 86\nb: 255\n")

    command("topic", "pub", "--once", "/turtle1/cmd_vel", "geometry_msgs/msg/Twist", "{linear: {x: 500.0}}")
    sim.wait_for("[WARN] [turtlesim]: Oh no! I hit the wall! (Clamping from [x=13.544")
    assert sim.interrupt() == 0
    recorded = read(recording)
    assert {"/sheet", "/lines", "/turtles/turtle1", "/turtles/other"} <= set(recorded.entities)
