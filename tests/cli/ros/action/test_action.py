from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Callable
from subprocess import CompletedProcess

import pytest

GRAPH = "service_graph.py"
FIBONACCI = ("/fibonacci", "example_interfaces/action/Fibonacci")

Twin = Callable[..., "CompletedProcess[str]"]


def test_actions_are_listed_and_found(twin_here: Twin) -> None:
    assert twin_here("action", "list").stdout == "/count\n/fibonacci\n"
    assert twin_here("action", "list", "-t").stdout.endswith(
        "/fibonacci [example_interfaces/action/Fibonacci]\n"
    )
    assert twin_here("action", "list", "-c").stdout == "2\n"
    assert twin_here("action", "type", "/fibonacci").stdout == "example_interfaces/action/Fibonacci\n"
    assert twin_here("action", "find", "example_interfaces/action/Fibonacci").stdout == "/fibonacci\n"


def test_info_names_clients_and_servers(twin_here: Twin) -> None:
    assert twin_here("action", "info", "-t", "/fibonacci").stdout == (
        "Action: /fibonacci\n"
        "Action clients: 0\n"
        "Action servers: 1\n"
        "    /fibonacci_action_server [example_interfaces/action/Fibonacci]\n"
    )
    counted = twin_here("action", "info", "-c", "/fibonacci").stdout
    assert counted == "Action: /fibonacci\nAction clients: 0\nAction servers: 1\n"


@pytest.mark.parametrize("command", ["info", "type"])
def test_an_unknown_action_names_the_nearest(twin_here: Twin, command: str) -> None:
    done = twin_here("action", command, "/fibonaci")
    assert done.returncode == 2
    assert (
        done.stderr
        == "error: Unknown action '/fibonaci'; did you mean '/fibonacci'? Valid: /count, /fibonacci\n"
    )


def test_a_goal_is_told_from_sending_to_its_result_as_by_ros2(twin_here: Twin) -> None:
    done = twin_here("action", "send_goal", *FIBONACCI, "{order: 3}", "--feedback")
    assert done.stderr == ""
    assert re.sub(r"ID: [0-9a-f]{32}\n", "ID: X\n", done.stdout) == (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n     order: 3\n\n"
        "Goal accepted with ID: X\n\n"
        "Feedback:\n    sequence:\n- 0\n- 1\n- 1\n\n"
        "Feedback:\n    sequence:\n- 0\n- 1\n- 1\n- 2\n\n"
        "Result:\n    sequence:\n- 0\n- 1\n- 1\n- 2\n\n"
        "Goal finished with status: SUCCEEDED\n"
    )


def test_a_goal_without_feedback_and_one_that_is_rejected(twin_here: Twin) -> None:
    assert "Feedback" not in twin_here("action", "send_goal", *FIBONACCI, "{order: 3}").stdout
    rejected = twin_here("action", "send_goal", *FIBONACCI, "{order: 0}")
    assert rejected.returncode == 0
    assert rejected.stdout.endswith("     order: 0\n\nGoal was rejected.\n")


def test_an_action_type_that_is_not_known_here_is_learnt_from_the_node(twin: Twin) -> None:
    done = twin("action", "send_goal", "-f", "/count", "lab_interfaces/action/Count", "{up_to: 2}")
    assert done.stderr == ""
    assert "Feedback:\n    now: 1\n\nFeedback:\n    now: 2\n\nResult:\n    last: 2\n" in done.stdout


def test_ctrl_c_cancels_the_goal(twin_here: Twin, endpoint: str) -> None:
    command = ["action", "send_goal", *FIBONACCI, "{order: 1000}", "--connect", endpoint]
    with subprocess.Popen(
        [sys.executable, "-m", "twin.cli", *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        while not (line := process.stdout.readline()).startswith("Goal accepted"):
            assert line, process.communicate()
        process.send_signal(signal.SIGINT)
        printed, errors = process.communicate(timeout=120)
    assert printed.strip() == "Canceling goal...\nGoal canceled."
    assert errors == ""
    assert process.returncode == 130
    assert (
        "SUCCEEDED" in twin_here("action", "send_goal", *FIBONACCI, "{order: 2}").stdout
    )  # the server is free


def test_a_time_out_cancels_the_goal(twin_here: Twin) -> None:
    done = twin_here("action", "send_goal", *FIBONACCI, "{order: 1000}", "-t", "1")
    assert done.stdout.endswith("Canceling goal...\nGoal canceled.\n")
    assert done.stderr == "error: the action /fibonacci gave no result in 1 s\n"
    assert done.returncode == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*FIBONACCI, "{ordr: 2}"), "did you mean 'order'?"),
        ((*FIBONACCI, "{order: 2.5}"), "order is a int32 and cannot be 2.5"),
        (
            ("/fibonacci", "nav2_msgs/action/Wait"),
            "is of type example_interfaces/action/Fibonacci, not nav2_",
        ),
        (("/fibonacci", "std_srvs/srv/Empty"), "is no action"),
        (
            ("/fibo", "nav2_msgs/action/Wait", "-t", "2"),
            "Action server is not available after waiting 2 seconds: Unknown action '/fibo'; did you mean "
            "'/fibonacci'?",
        ),
    ],
)
def test_a_goal_that_cannot_be_sent_is_a_sentence(
    twin_here: Twin, arguments: tuple[str, ...], message: str
) -> None:
    done = twin_here("action", "send_goal", *arguments)
    assert done.returncode == 2
    *warnings, error = done.stderr.splitlines()
    assert all(line.startswith("WARNING: ") for line in warnings)
    assert error.startswith("error: ")
    assert message in error
