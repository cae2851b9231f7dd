"""Scenario files: what is read, and what is said about a wrong one."""
# ruff: noqa: E501  (a table reads better in one line per row)

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from twin.errors import ScenarioError
from twin.scenario.localisation import AmclLocalisation
from twin.scenario.missions import PickAndPlace
from twin.scenario.schema import Scenario, json_schema, load

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "scenarios").rglob("*.yaml"))

GOOD = """\
name: demo
duration: 10 s
world: {arena: warehouse}
robots:
  - model: warehouse_bot
    name: bot
    start: start
    localisation: {type: amcl}
    navigation: {}
mission:
  type: pick_and_place
  robot: bot
  tasks: [{tote: tote_a, to: unloading}]
checks:
  - mission_succeeded:
"""


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "demo.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def faults(tmp_path: Path, text: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        load(write(tmp_path, text))
    return [str(problem).removeprefix(f"{tmp_path}/") for problem in caught.value.problems]


def test_a_whole_scenario(tmp_path: Path) -> None:
    text = GOOD.replace(
        "{type: amcl}", "{type: amcl, initial_pose_error: {xy: 20 cm}, parameters: {max_beams: 60}}"
    )
    scenario = load(write(tmp_path, text), {"robots.0.navigation.controller.desired_linear_vel": "0.5 m/s"})
    robot = scenario.robots[0]
    assert isinstance(robot.localisation, AmclLocalisation)
    assert robot.localisation.initial_pose_error.xy == 0.2
    assert robot.localisation.parameters.overrides() == {"max_beams": 60}
    assert robot.navigation is not None
    assert robot.navigation.controller.overrides() == {"desired_linear_vel": 0.5}
    assert isinstance(scenario.mission, PickAndPlace)
    assert (scenario.seed, scenario.physics.timestep, robot.id) == (0, 0.002, "bot")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("name: demo", "name: a b", "demo.yaml:1: name: must be a ROS name (letters, digits and _, a letter first), not 'a b'"),
        ("duration: 10 s", "duration: 10 kg", "demo.yaml:2: duration: must have a unit of time (s, ms, us, min, h), not '10 kg'"),
        ("duration: 10 s", "duration: -1", "demo.yaml:2: duration: must be greater than 0, not -1"),
        ("duration: 10 s", "duration: 10\nphysics: {timestep: 3 ms}", "demo.yaml:3: the control period (20 ms) must be a whole number of physics steps (3 ms)"),
        ("duration: 10 s", "duration: 10\nphysics: {timestep: 1e-10}", "demo.yaml:3: physics.timestep: must be 0, or from 1e-09 to 1e+09 s in size, not 1e-10"),
        ("duration: 10 s", "duration: 10\nrecording: {poses_hz: 60}", "demo.yaml:3: the rate of the recorded poses (60 Hz) must be at most 50 Hz, one per control period (20 ms)"),
        ("    navigation: {}", "    command_latency: 30 ms", "demo.yaml:9: the latency of commands (30 ms) must be a whole number of control periods (20 ms)"),
        ("pick_and_place\n  robot: bot\n  tasks: [{tote: tote_a, to: unloading}]", "r2d2_state_publisher\n  robot: bot\n  rate: 1 kHz", "demo.yaml:13: the rate of the publisher (1000 Hz) must be at most 50 Hz, one per control period (20 ms)"),
        ("{arena: warehouse}", "{arna: warehouse}", "demo.yaml:3: unknown key 'arna' in world; did you mean 'arena'? Valid: arena, goods, obstacles"),
        ("    start: start", "    strat: start", "demo.yaml:7: unknown key 'strat' in robots.0; did you mean 'start'? Valid: apriltag, args, "),
        ("    start: start", "    start: start\n    pose: {x: 1}", "demo.yaml:7: give the robot either a pose or the name of a start, not both"),
        ("{type: amcl}", "{type: amlc}", "demo.yaml:8: robots.0.localisation.type: unknown value 'amlc'; did you mean 'amcl'? Valid: amcl, none, odometry, slam"),
        ("{type: amcl}", "{type: none}", "demo.yaml:9: navigation needs a localisation of type odometry, amcl or slam"),
        ("{type: amcl}", "{type: amcl, parameters: {max_beam: 3}}", "demo.yaml:8: unknown key 'max_beam' in robots.0.localisation.parameters; did you mean 'max_beams'? Valid: "),
        ("{type: amcl}", "{type: slam, mode: localization}", "demo.yaml:8: robots.0.localisation: localization needs a pose_graph; without one only mapping is possible"),
        ("pick_and_place\n  robot: bot\n  tasks: [{tote: tote_a, to: unloading}]", "explore\n  robot: bot", "demo.yaml:5: the mission explore needs a navigation of robot 'bot' and its localisation of type slam"),
        ("- mission_succeeded:", "- map_accuracy: {}", "demo.yaml:15: checks.0.map_accuracy: must have at least one of the keys mean, p95"),
        ("    navigation: {}", "    base: fixed\n    navigation: {}", "demo.yaml:9: navigation needs the base 'free', not 'fixed'"),
        ("    navigation: {}\n", "", "demo.yaml:5: the mission pick_and_place needs a navigation of robot 'bot'"),
        ("model: warehouse_bot", "model: warehouse_bat", "demo.yaml:5: no robot 'warehouse_bat': neither a file nor known; did you mean 'warehouse_bot'? Valid: diff_bot, jackal, r2d2, sp1s, test_robot, warehouse_bot"),
        ("arena: warehouse", "arena: warehous", "demo.yaml:3: no arena 'warehous': neither a file nor known; did you mean 'warehouse'? Valid: warehouse"),
        ("  robot: bot", "  robot: bob", "demo.yaml:12: unknown robot 'bob'; did you mean 'bot'? Valid: bot"),
        ("pick_and_place", "pick_n_place", "demo.yaml:11: mission.type: unknown value 'pick_n_place'; did you mean 'pick_and_place'? Valid: "),
        ("tasks: [{tote: tote_a, to: unloading}]", "tasks: []", "demo.yaml:13: mission.tasks: must have at least 1 items, not []"),
        ("to: unloading", "too: unloading", "demo.yaml:13: unknown key 'too' in mission.tasks.0; did you mean 'to'? Valid: to, tote"),
        ("- mission_succeeded:", "- mission_suceeded:", "demo.yaml:15: unknown key 'mission_suceeded' in checks.0; did you mean 'mission_succeeded'? Valid: "),
        ("- mission_succeeded:", "- {}", "demo.yaml:15: checks.0: must have exactly one of the keys always, closed_loop, delivered"),
        ("- mission_succeeded:", "- delivered:", "demo.yaml:15: missing key 'tote' in checks.0.delivered"),
        ("- mission_succeeded:", "- localisation_error:", "demo.yaml:15: checks.0.localisation_error: must have at least one of the keys rms, max, not {}"),
        ("- mission_succeeded:", "- driven_distance: {min: 3, max: 2}", "demo.yaml:15: checks.0.driven_distance: min (3 m) must not exceed max (2 m)"),
        ("- mission_succeeded:", "- energy: {max: 3, robot: bit}", "demo.yaml:15: unknown robot 'bit'; did you mean 'bot'? Valid: bot"),
        ("- mission_succeeded:", "- tote_slip: {max: 3 mm, tote: tote_b}", "demo.yaml:15: the mission carries no tote 'tote_b'; did you mean 'tote_a'? Valid: tote_a"),
        ("- mission_succeeded:", "- map_accuracy: {mean: 1}", "demo.yaml:15: map_accuracy needs the localisation of robot 'bot' of type slam"),
        ("{arena: warehouse}", "{arena: warehouse, obstacles: [{name: a, size: [1, 1, 1]}, {name: a, size: [1, 1, 1]}]}", "demo.yaml:3: the name 'a' is taken by world.obstacles.0; names must differ"),
        ("    navigation: {}", "    navigation: {collision_monitor: {polygons: [{name: a, action_type: stop, points: [[0, 0], [1, 1]]}]}}", "demo.yaml:9: robots.0.navigation.collision_monitor.polygons.0: points must be three corners or more"),
        ("checks:\n  - mission_succeeded:\n", "checks: []\n", "demo.yaml:14: checks: must have at least 1 items, not []"),
    ],
)  # fmt: skip
def test_one_fault(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert old in GOOD
    found = faults(tmp_path, GOOD.replace(old, new))
    assert any(fault.startswith(expected) for fault in found), found


def test_times_and_rates_need_not_fit_the_control_period(tmp_path: Path) -> None:
    text = """
        name: demo
        duration: 10.0123 s
        robots: [{model: r2d2, base: kinematic}, {model: diff_bot}]
        mission: {type: %s}
        recording: {poses_hz: 33.3}
        checks: [{odometry_drift: {max: 1, robot: diff_bot}}]
    """
    missions = (
        "r2d2_state_publisher, robot: r2d2, rate: 30 Hz",
        "velocity_profile, robot: diff_bot, steps: [{duration: 3.1416, angular: 0.5}]",
    )
    for mission in missions:
        assert load(write(tmp_path, text % mission)).duration == 10.0123


def test_faults_of_all_parts_come_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("robot: bot", "robot: bob").replace("arena", "area")
    text += "  - energy: {max: 1, robot: bit}\n  - enrgy: {max: 1}\n"
    lines = [fault.partition(": ")[0] for fault in faults(tmp_path, text)]
    assert lines == ["demo.yaml:3", "demo.yaml:12", "demo.yaml:16", "demo.yaml:17"]


def test_without_an_arena(tmp_path: Path) -> None:
    text = GOOD.replace("world: {arena: warehouse}\n", "")
    assert faults(tmp_path, text) == [
        "demo.yaml:6: the start 'start' needs an arena; name one as world.arena",
        "demo.yaml:7: amcl without a map needs an arena; name one as world.arena, or a map",
        "demo.yaml:9: pick_and_place needs an arena; name one as world.arena",
    ]


def test_recoveries_need_a_navigator(tmp_path: Path) -> None:
    text = "name: demo\nduration: 1\nrobots: [{model: diff_bot}]\nchecks:\n  - recoveries: {max: 0}\n"
    assert faults(tmp_path, text) == ["demo.yaml:5: recoveries needs a navigation of robot 'diff_bot'"]


def test_several_robots(tmp_path: Path) -> None:
    text = (
        GOOD.replace("mission:\n", "  - {model: diff_bot, name: bot}\nmission:\n") + "  - energy: {max: 1}\n"
    )
    assert faults(tmp_path, text) == [
        "demo.yaml:10: the name 'bot' is taken by robots.0; names must differ",
        "demo.yaml:17: energy must name its robot, there are several; valid: bot, bot",
    ]


def test_idle_has_no_end(tmp_path: Path) -> None:
    text = "name: demo\nduration: 1\nrobots: [{model: diff_bot}]\nchecks: [{mission_succeeded: }]\n"
    assert faults(tmp_path, text) == ["demo.yaml:4: mission_succeeded needs a mission that ends, not 'idle'"]


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    text = GOOD.replace("arena: warehouse", "arena: ../hall.yaml").replace(
        "model: warehouse_bot", "model: my/bot.xacro"
    )
    hall, bot = tmp_path / "../hall.yaml", tmp_path / "my" / "bot.xacro"
    bot.parent.mkdir()
    bot.touch()
    hall.touch()
    scenario = load(write(tmp_path, text))
    assert scenario.world.arena == str(tmp_path / "../hall.yaml")
    assert (scenario.robots[0].model, scenario.robots[0].id) == (str(tmp_path / "my/bot.xacro"), "bot")
    unnamed = load(write(tmp_path, text.replace("    name: bot\n", "")))
    assert unnamed.robots[0].id == "bot"


def test_xacro_arguments_become_text(tmp_path: Path) -> None:
    text = GOOD.replace("name: bot\n", "name: bot\n    args: {mass: 3, wide: true, colour: red}\n")
    assert load(write(tmp_path, text)).robots[0].args == {"mass": "3", "wide": "true", "colour": "red"}


def test_built_in_python_the_same_rules_hold() -> None:
    data: dict[str, Any] = yaml.safe_load(GOOD)
    data["mission"]["robot"] = "bob"
    with pytest.raises(ValueError, match=r"mission\.robot: unknown robot 'bob'"):
        Scenario.model_validate(data)


@pytest.fixture(scope="module")
def editor() -> jsonschema.Draft202012Validator:
    """What an editor makes of the JSON schema: once, for it takes half a second."""
    return jsonschema.Draft202012Validator(json_schema())


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_scenarios_are_valid_for_us_and_for_editors(
    path: Path, editor: jsonschema.Draft202012Validator
) -> None:
    scenario = load(path)
    assert scenario.name == path.stem
    assert scenario.description
    editor.validate(yaml.safe_load(path.read_text(encoding="utf-8")))


def test_editors_take_the_keys_of_a_users_plugins(editor: jsonschema.Draft202012Validator) -> None:
    for page in ("architecture.md", "navigation/plugins.md"):
        for block in re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / page).read_text("utf-8"), re.DOTALL):
            editor.validate(yaml.safe_load(block))
    for wrong in ("controller: {sped: 1}", "controller: {plugin: mppi, sped: 1}", "planner: {sped: 1}"):
        data = yaml.safe_load(GOOD)
        data["robots"][0]["navigation"] = yaml.safe_load(wrong)
        with pytest.raises(jsonschema.ValidationError):
            editor.validate(data)


def test_json_schema_describes_every_key() -> None:
    schema = json.loads(json.dumps(json_schema()))
    jsonschema.Draft202012Validator.check_schema(schema)
    for node in (schema, *schema["$defs"].values()):
        for key, value in node["properties"].items():
            model = schema["$defs"].get(
                value.get("$ref", "").rpartition("/")[2], {}
            )  # drops a text it repeats
            assert value.get("description") or model.get("description"), (node["title"], key)
    bad = yaml.safe_load(GOOD) | {"chekcs": []}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(bad, schema)


def test_a_tag_that_does_not_exist_and_one_that_nobody_could_see(tmp_path: Path) -> None:
    text = """\
name: demo
duration: 1 s
world:
  tags: [{id: 587, size: 16 cm, pose: {x: 1}}]
robots: [{model: diff_bot, cameras: "off", apriltag: {}}]
checks: [{no_collision: }]
"""
    assert faults(tmp_path, text) == [
        "demo.yaml:4: tag36h11 has the ids 0 to 586, not 587",
        "demo.yaml:5: tags are found in images, but this robot's cameras are off",
    ]


def test_two_tags_of_one_number_need_names(tmp_path: Path) -> None:
    twice = "[{id: 3, size: 16 cm, pose: {x: 1}}, {id: 3, size: 16 cm, pose: {x: 2}}]"
    text = f"name: demo\nduration: 1 s\nworld: {{tags: {twice}}}\nrobots: [{{model: diff_bot}}]\nchecks: [{{no_collision: }}]\n"
    assert faults(tmp_path, text) == [
        "demo.yaml:3: there is a tag 'tag36h11:3' before; give this one a name of its own"
    ]
