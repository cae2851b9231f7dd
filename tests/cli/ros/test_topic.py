from __future__ import annotations

from collections.abc import Callable
from subprocess import CompletedProcess

Twin = Callable[..., "CompletedProcess[str]"]


def test_topics_are_listed_with_types(twin: Twin) -> None:
    done = twin("topic", "list", "-t")
    assert done.stderr == ""
    assert done.stdout.splitlines() == [
        "/chatter [std_msgs/msg/String]",
        "/parameter_events [rcl_interfaces/msg/ParameterEvent]",
        "/robot/cmd_vel [geometry_msgs/msg/Twist]",
        "/robot_description [std_msgs/msg/String]",
        "/rosout [rcl_interfaces/msg/Log]",
    ]
