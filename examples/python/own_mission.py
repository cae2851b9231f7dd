"""A mission in Python, with goals and decisions: `python examples/python/own_mission.py`."""

from __future__ import annotations

import math
from pathlib import Path

import twin

STATIONS = {"shelf": (1.5, 0.0), "table": (1.0, 1.0)}


def pose(x: float, y: float) -> dict[str, object]:
    """Return a `geometry_msgs/msg/PoseStamped` as plain values."""
    return {"header": {"frame_id": "map"}, "pose": {"position": {"x": x, "y": y}}}


def main() -> None:
    """Visit the stations, turn around at each, and tell how it went."""
    with twin.Simulation(Path(__file__).with_name("rover.yaml")) as simulation:
        for name, place in STATIONS.items():
            goal = simulation.send_goal("/navigate_to_pose", {"pose": pose(*place)})
            if not simulation.run_until(lambda goal=goal: goal.done, timeout=30.0) or not goal.succeeded:
                print(f"{name}: not reached: {goal.error or 'too slow'}")
                break
            off = math.dist(simulation.truth.pose("rover").xyz[:2], place)
            print(f"{name}: there after {simulation.time:.1f} s, {100.0 * off:.0f} cm off")
            turn = simulation.send_goal("/spin", {"target_yaw": math.pi})
            simulation.run_until(lambda turn=turn: turn.done, timeout=10.0)
    print(f"{simulation.verdict.verdict}, digest {simulation.verdict.digest[:12]}")


if __name__ == "__main__":
    main()
