import pytest

from twin.manipulation.gripper import GripperConfig, GripperMonitor


def final_state(position: float, goal: float) -> str:
    monitor = GripperMonitor(GripperConfig(stall_timeout=0.1), goal)
    assert monitor.update(0.1, 0.2, 0.02) == "moving"
    states = [monitor.update(position, 0.0, 0.02) for _ in range(10)]
    return states[-1]


def test_stopping_away_from_the_goal_is_a_stall_on_something() -> None:
    assert final_state(0.12, goal=0.0) == "stalled"


def test_arriving_at_the_goal_means_that_nothing_was_between_the_fingers() -> None:
    assert final_state(0.001, goal=0.0) == "reached"


@pytest.mark.parametrize(
    ("position", "velocity", "seconds", "state"),
    [
        (0.0, 0.0021, 0.5, "moving"),  # faster than 2 mm/s
        (0.0, -0.0021, 0.5, "moving"),
        (0.0, 0.0019, 0.5, "reached"),
        (0.0, 0.0, 0.29, "moving"),  # not still for so long
        (0.0, 0.0, 0.31, "reached"),
        (0.0029, 0.0, 0.5, "reached"),
        (-0.0029, 0.0, 0.5, "reached"),
        (0.0031, 0.0, 0.5, "stalled"),
        (-0.0031, 0.0, 0.5, "stalled"),
    ],
)
def test_when_a_finger_stands_and_where(position: float, velocity: float, seconds: float, state: str) -> None:
    monitor = GripperMonitor(GripperConfig(), goal=0.05)
    for _ in range(round(seconds / 0.01)):
        last = monitor.update(0.05 + position, velocity, 0.01)
    assert last == state
    assert monitor.update(0.05 + position, 0.1, 0.01) == "moving"
    assert monitor.update(0.05 + position, 0.0, 0.29) == "moving", "it begins anew"
