"""Behaviour trees as Nav2's parameter files name them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.runtime.parameter_files.nav2.robot import applied
from twin.errors import NavigationError
from twin.nodes.navigation.behavior_trees.navigator import tree_file

SHARE = "$(find-pkg-share nav2_bt_navigator)/behavior_trees/"
TREE = tree_file("navigate_to_pose").read_text("utf-8")


def navigator(tree: str, key: str = "default_nav_to_pose_bt_xml") -> str:
    return f"bt_navigator:\n  ros__parameters:\n    {key}: '{tree}'\n"


@pytest.mark.parametrize(
    ("tree", "own"),
    [
        (f"{SHARE}navigate_to_pose_w_replanning_and_recovery.xml", "navigate_to_pose"),
        ("/ros/share/nav2_bt_navigator/navigate_w_replanning_and_recovery.xml", "navigate_to_pose"),
        (f"{SHARE}recover.xml", "recover"),
    ],
)
def test_nav2s_own_trees_are_those_that_ship_here_and_that_is_told(
    tree: str, own: str, tmp_path: Path
) -> None:
    got, told = applied(tmp_path, navigator(tree))
    assert got.navigator.default_nav_to_pose_bt_xml == own
    message = f"default_nav_to_pose_bt_xml: {tree} is not here; twin's own '{own}' is taken"
    assert told == [f"nav2.yaml: {message}"]
    scenario = {"navigator": {"default_nav_to_pose_bt_xml": "navigate_w_replanning"}}
    assert applied(tmp_path, navigator(tree), scenario)[1] == [], "the scenario's goes first"


def test_trees_in_packages_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "install" / "share" / "my_trees"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_trees</name></package>")
    (package / "go.xml").write_text(TREE)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    got, told = applied(tmp_path, navigator("$(find-pkg-share my_trees)/go.xml"))
    assert (Path(got.navigator.default_nav_to_pose_bt_xml), told) == (package / "go.xml", [])


def test_a_path_starts_at_the_parameter_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "trees").mkdir()
    (tmp_path / "trees" / "go.xml").write_text(TREE)
    monkeypatch.chdir(tmp_path / "trees")
    got, told = applied(tmp_path, navigator("trees/go.xml"))
    assert (Path(got.navigator.default_nav_to_pose_bt_xml), told) == (tmp_path / "trees" / "go.xml", [])


def test_a_tree_that_is_nowhere_is_refused_with_its_line(tmp_path: Path) -> None:
    key = "default_nav_through_poses_bt_xml"
    with pytest.raises(NavigationError) as caught:
        applied(tmp_path, navigator("$(find-pkg-share mine)/go.xml", key))
    (problem,) = caught.value.problems
    assert problem.line == 3
    start = f"bt_navigator: {key} cannot be used: there is no behaviour tree '$(find-pkg-share mine)/go.xml'"
    assert problem.message.startswith(start)
    assert "navigate_through_poses" in problem.message, "what is valid"
