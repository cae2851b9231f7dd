"""What can be left out of a scenario."""

from __future__ import annotations

from typing import Any

from twin.experiments.shrink.parts import causes, inside, tasks, without

DATA: dict[str, Any] = {
    "name": "x",
    "seed": 1,
    "duration": "3 s",
    "physics": {"timestep": "1 ms"},
    "world": {"arena": "warehouse", "obstacles": [{"name": "box", "size": [1, 1, 1]}, {"name": "pallet"}]},
    "robots": [
        {
            "model": "diff_bot",
            "start": "start",
            "args": {"a": 1},
            "navigation": {"planner": {"x": 1, "y": 2}},
        },
        {"model": "./robots/other.urdf"},
    ],
    "missions": [
        {
            "type": "behaviors",
            "robot": "diff_bot",
            "steps": [{"spin": {"angle": 1}}, {"wait": {}}],
            "repeat": 2,
        },
        {"type": "idle", "robot": "other"},
    ],
    "faults": [{"lidar": {"at": 1}}, {"encoder": {"at": 2, "robot": "other"}}],
    "checks": [{"no_collision": None}],
}


def test_causes_are_faults_obstacles_and_parameters() -> None:
    assert [part.name for part in causes(DATA)] == [
        "physics",
        "faults.0 lidar",
        "faults.1 encoder",
        "world.obstacles.0 box",
        "world.obstacles.1 pallet",
        "robots.0.args",
        "robots.0.navigation",
    ]
    finer = inside(DATA, causes(DATA)[-2:])
    assert [part.name for part in finer] == ["robots.0.args.a: 1", "robots.0.navigation.planner"]
    assert [part.name for part in inside(DATA, finer)] == [
        "robots.0.navigation.planner.x: 1",
        "robots.0.navigation.planner.y: 2",
    ]


def test_faults_and_obstacles_go_whole() -> None:
    """A fault without its `at`, from the start on, would be another fault and no simpler one."""
    assert inside(DATA, causes(DATA)[1:5]) == []


def test_tasks_are_steps_and_robots_with_all_that_names_them() -> None:
    parts = tasks(DATA)
    assert [part.name for part in parts] == [
        "robots.0 diff_bot",
        "robots.1 other",
        "missions.0.steps.0 spin",
        "missions.0.steps.1 wait",
        "missions.0.repeat: 2",
    ]
    left = without(DATA, [parts[1]])
    assert [robot["model"] for robot in left["robots"]] == ["diff_bot"]
    assert [mission["robot"] for mission in left["missions"]] == ["diff_bot"]
    assert left["faults"] == [{"lidar": {"at": 1}}]


def test_parts_go_from_where_they_stood_in_any_order() -> None:
    parts = causes(DATA)
    left = without(DATA, [parts[1], parts[4], parts[3], parts[0]])
    assert left["faults"] == [{"encoder": {"at": 2, "robot": "other"}}]
    assert left["world"] == {"arena": "warehouse"}
    assert "physics" not in left
    assert without(DATA, []) == DATA
    assert "faults" not in without(DATA, parts[1:3])
