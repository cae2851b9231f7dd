from __future__ import annotations

from .conftest import Start


def test_a_sum_is_asked_for(start: Start) -> None:
    server = start("add_two_ints_server")
    client = start("add_two_ints_client", "2", "3")
    client.wait_for("[INFO] [add_two_ints_client]: Result of add_two_ints: 2 + 3 = 5\n")
    assert client.finish() == 0
    assert "[INFO] [add_two_ints_server]: Incoming request: a=2 b=3\n" in server.text


def test_positions_in_a_type_of_the_course_are_heard(start: Start) -> None:
    subscriber = start("gps_subscriber")
    start("gps_publisher", "--period", "0.02")
    subscriber.wait_for("[gps_subscriber]: Listener: distance to the origin = ")
    assert "state = working\n" in subscriber.text


def test_a_greeting_in_a_type_of_the_course_is_answered(start: Start) -> None:
    server = start("greeting_server")
    client = start("greeting_client", "HAN", "20")
    client.wait_for("[INFO] [greetings_client]: Response from server: Hi HAN. I'm server!\n")
    assert client.finish() == 0
    assert "Request from HAN with age 20\n" in server.text
