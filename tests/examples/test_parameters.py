from __future__ import annotations

from collections.abc import Callable

from .conftest import Start

Command = Callable[..., tuple[int, str, str]]


def test_a_parameter_changes_while_the_program_runs(start: Start, command: Command) -> None:
    program = start("parameters", "--ros-args", "-p", "period:=0.02", "-p", "robot_name:=r2d2")
    program.wait_for("robot_name = r2d2, max_speed = 0.5, camera_on = True\n")
    assert command("param", "set", "/parameters", "max_speed", "1.5")[:2] == (0, "Set parameter successful\n")
    assert command("param", "set", "/parameters", "camera_on", "false")[0] == 0
    program.wait_for("robot_name = r2d2, max_speed = 1.5, camera_on = False\n")


def test_a_negative_speed_is_refused(start: Start, command: Command) -> None:
    program = start("parameters", "--ros-args", "-p", "period:=0.02")
    program.wait_for("max_speed = 0.5")
    code, _, errors = command("param", "set", "/parameters", "max_speed", "-1.0")
    assert (code, errors) == (1, "Setting parameter failed: max_speed must not be negative\n")
    assert command("param", "get", "/parameters", "max_speed")[1] == "Double value is: 0.5\n"
