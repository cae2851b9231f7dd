from __future__ import annotations

from .conftest import Start


def test_a_goal_is_followed_to_its_result(start: Start) -> None:
    server = start("fibonacci_action_server", "--period", "0.02")
    client = start("fibonacci_action_client", "--order", "4")
    assert client.finish() == 0
    assert "Goal accepted :)\n" in client.text
    assert "Received feedback: [0, 1, 1, 2]\n" in client.text
    assert client.text.endswith("Goal succeeded! Result: [0, 1, 1, 2, 3]\n")
    assert "Goal succeeded\n" in server.text


def test_an_order_that_is_not_positive_is_rejected(start: Start) -> None:
    start("fibonacci_action_server")
    client = start("fibonacci_action_client", "--order", "0")
    assert client.finish() == 0
    assert client.text.endswith("Goal rejected :(\n")


def test_a_goal_is_cancelled(start: Start) -> None:
    server = start("fibonacci_action_server", "--period", "0.1")
    client = start("fibonacci_action_client", "--order", "30", "--cancel-after", "0.25")
    assert client.finish() == 0
    assert "Canceling goal\n" in client.text
    assert "Goal canceled Result: [0, 1" in client.text
    assert "Goal canceled\n" in server.text
