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
