"""What follows --ros-args, through real processes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from .conftest import Start

Command = Callable[..., tuple[int, str, str]]


def test_names_are_remapped(start: Start, command: Command) -> None:
    listener = start("listener", "--ros-args", "-r", "chatter:=/robot/news", "-r", "__node:=ear")
    start(
        *("talker", "--period", "0.02", "--ros-args"),
        *("-r", "__ns:=/robot", "-r", "__node:=speaker", "--remap", "chatter:=news", "--"),
    )
    listener.wait_for('[INFO] [ear]: I heard: "Hello World: 3"')
    assert command("node", "list") == (0, "/ear\n/robot/speaker\n", "")
    _, shown, _ = command("node", "info", "/robot/speaker")
    assert "/robot/news: std_msgs/msg/String" in shown
    assert command("topic", "list")[1].split() == ["/parameter_events", "/robot/news", "/rosout"]


def test_a_remapping_of_another_node_is_not_ours(start: Start, command: Command) -> None:
    talker = start("talker", "--ros-args", "-r", "listener:chatter:=news", "-r", "talker:__ns:=/a")
    talker.wait_for("Hello World: 0")
    assert "/a/chatter" in command("topic", "list")[1].split()


def test_a_parameter_file_and_single_parameters(start: Start, tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {period: 0.02, robot_name: any}\n"
        "/robot/*:\n  ros__parameters: {camera_on: no, max_speed: 1.0}\n"
    )
    program = start(
        *("parameters", "--ros-args", "-r", "__ns:=/robot", "--params-file", str(file)),
        *("-p", "max_speed:=2.5", "-p", "other_node:robot_name:=wrong"),
    )
    program.wait_for("[robot.parameters]: robot_name = any, max_speed = 2.5, camera_on = False\n")


def test_what_was_dumped_starts_a_program(start: Start, command: Command, tmp_path: Path) -> None:
    start("listener")  # where the others connect
    first = start("parameters", "--ros-args", "-p", "period:=0.02", "-p", 'robot_name:="12"')
    first.wait_for("robot_name = 12")
    assert command("param", "set", "/parameters", "max_speed", "1.5")[0] == 0
    code, dumped, errors = command("param", "dump", "/parameters")
    assert (code, errors) == (0, "")
    file = tmp_path / "parameters.yaml"
    file.write_text(dumped)
    assert first.interrupt() == 0

    second = start("parameters", "--ros-args", "--params-file", str(file))
    second.wait_for("robot_name = 12, max_speed = 1.5, camera_on = True\n")
