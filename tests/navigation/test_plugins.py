"""Parts of navigation that a user brings: what the pages show runs, what is wrong is named with its line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.runtime.parameter_files.nav2.robot import applied
from twin.errors import PluginError, TwinError
from twin.runtime.open_run import run
from twin.scenario.schema import load
from twin.scenario.verdict import Verdict

DOCS = Path(__file__).parents[2] / "docs"
_FILE = re.compile(r"```\w+\n(?:# |<!-- )(\S+)( -->)?\n(.*?)```", re.DOTALL)


def written(folder: Path, text: str) -> Path:
    """Write the files that a page shows; return the last one, the scenario."""
    last = folder
    for name, _, content in _FILE.findall(text):
        last = folder / name
        last.write_text(content, encoding="utf-8")
    return last


def executed(scenario: Path) -> Verdict:
    return run(load(scenario, execute=True), record=False)


@pytest.fixture
def follow(tmp_path: Path) -> Path:
    """Return the scenario with the controller that architecture.md shows."""
    page = (DOCS / "architecture.md").read_text("utf-8")
    return written(tmp_path, page[page.index("### Add a controller") : page.index("**Add a node of beh")])


def test_the_controller_of_the_page_reaches_its_goal(follow: Path) -> None:
    verdict = executed(follow)
    assert verdict.verdict == "pass", verdict.to_json()
    assert list(verdict.plugins) == ["follow.py:Follow"]


def test_one_of_each_kind_drives_together(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    verdict = executed(written(tmp_path, (DOCS / "navigation/plugins.md").read_text("utf-8")))
    assert verdict.verdict == "pass", verdict.to_json()
    kinds = "Near Patient Calm Straight Every Pit Say"
    assert set(verdict.plugins) == {f"parts.py:{kind}" for kind in kinds.split()}


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            'return float("nan"), 0.0',
            r"follow\.py:\d+: .* returns a command of \(nan, 0\); it must be finite",
        ),
        ("return 1.0", r"answers compute_velocity_commands with 1\.0; it must return \(v \[m/s\], w"),
        ("return {}[3]", r"follow\.py:26: controller 'follow\.py:Follow' fails: KeyError: 3"),
    ],
)
def test_nonsense_ends_the_run_with_name_and_line(follow: Path, line: str, said: str) -> None:
    file = follow.with_name("follow.py")
    file.write_text(re.sub(r"local = now\.pose.*", line, file.read_text()))
    with pytest.raises(PluginError, match=said):
        executed(follow)


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("speed: 40 cm/s", "speed: 0", r"follow\.yaml:10: .*speed: must be greater than 0"),
        ("speed: 40 cm/s", "sped: 1", r"follow\.yaml:10: unknown key 'sped'; did you mean 'speed'"),
        ("py:Follow", "py:Folow", r"there is no 'Folow' in it; did you mean 'Follow'"),
        ("follow.py:Follow", "dbw", r"there is no controller 'dbw'; did you mean 'dwb'"),
    ],
)
def test_a_wrong_name_or_parameter_is_one_sentence(follow: Path, right: str, wrong: str, said: str) -> None:
    follow.write_text(follow.read_text().replace(right, wrong))
    with pytest.raises(TwinError, match=said):
        load(follow, execute=True)


def test_to_read_a_scenario_executes_nothing(follow: Path) -> None:
    follow.with_name("follow.py").write_text("class Follow: pass\nraise SystemExit('executed')\n")
    assert load(follow).robots[0].navigation is not None


@pytest.mark.parametrize(
    ("critics", "said"),
    [("[CostCrtic]", "there is no critic 'CostCrtic'; did you mean 'CostCritic'"), ("['a.py:B']", "a.py")],
)
def test_a_wrong_critic_is_named(follow: Path, critics: str, said: str) -> None:
    text = re.sub(r"plugin: .*?cm/s", f"plugin: mppi, critics: {critics}", follow.read_text())
    follow.write_text(text)
    with pytest.raises(TwinError, match=said):
        load(follow)


def test_a_parameter_file_of_nav2_names_a_controller_of_a_module(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (DOCS / "architecture.md").read_text("utf-8")
    written(tmp_path, page[page.index("# follow.py") - 10 :])
    monkeypatch.syspath_prepend(tmp_path)
    text = """
    controller_server:
      ros__parameters:
        controller_plugins: [FollowPath]
        FollowPath: {plugin: "follow:Follow", lookahead: 0.4}
    """
    parameters, told = applied(tmp_path, text)
    controller = parameters.controller_server.controllers["FollowPath"]
    assert (controller.lookahead, controller.speed) == (0.4, 0.3)
    assert not told


def test_a_parameter_file_of_nav2_names_one_of_each_kind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, (DOCS / "navigation/plugins.md").read_text("utf-8"))
    monkeypatch.syspath_prepend(tmp_path)
    text = """
    controller_server:
      ros__parameters:
        goal_checker_plugins: [near]
        near: {plugin: "parts:Near", xy_goal_tolerance: 0.4}
        progress_checker_plugins: [patient]
        patient: {plugin: "parts:Patient"}
        FollowPath:
          plugin: nav2_mppi_controller::MPPIController
          critics: [GoalCritic, "parts:Calm"]
          Calm: {weight: 2.5}
    planner_server: {ros__parameters: {planner_plugins: [GridBased], GridBased: {plugin: "parts:Straight"}}}
    smoother_server:
      ros__parameters: {smoother_plugins: [mine], mine: {plugin: "parts:Every"}}
    global_costmap/global_costmap:
      ros__parameters:
        plugins: [static_layer, hole, seen, spread]
        hole: {plugin: "parts:Pit", radius: 0.7}
        seen: {plugin: nav2_costmap_2d::ObstacleLayer}
        spread: {plugin: nav2_costmap_2d::InflationLayer}
    """
    parameters, told = applied(tmp_path, text)
    server, costmap = parameters.controller_server, parameters.global_costmap.layers
    follow = server.controllers["FollowPath"]
    assert follow.critics == ("GoalCritic", "Calm")
    assert follow.own_critics["Calm"].weight == 2.5
    assert server.goal_checkers["general_goal_checker"].xy_goal_tolerance == 0.4
    assert server.progress_checkers["progress_checker"].plugin.name == "parts:Patient"
    assert parameters.planner.plugin.name == "parts:Straight"
    assert next(iter(parameters.path_smoother.smoothers)) == "mine"
    assert costmap.plugins == (
        "static_layer",
        "hole",
        "obstacle_layer",
        "voxel_layer",
        "range_sensor_layer",
        "inflation_layer",
    )
    assert costmap.own_layers["hole"].radius == 0.7
    assert not told

    said = r"nav2.yaml:18: .* hole.radius must be greater than 0"
    with pytest.raises(TwinError, match=said):
        applied(tmp_path, text.replace("radius: 0.7", "radius: -1.0"))
    said = r"nav2.yaml:10: .* FollowPath.critics cannot be used: .*parts.py: .*'Clam'.* did you mean 'Calm'"
    with pytest.raises(TwinError, match=said):
        applied(tmp_path, text.replace("parts:Calm", "parts:Clam"))
