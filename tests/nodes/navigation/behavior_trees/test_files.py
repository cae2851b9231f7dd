"""Trees that ship with twin, and the page that lists the nodes."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import NavigationError
from twin.navigation.behavior_trees.factory import TreeBuilder
from twin.nodes.navigation.behavior_trees.actions import seconds
from twin.nodes.navigation.behavior_trees.navigator import SHIPPED
from twin.nodes.navigation.behavior_trees.registry import NAVIGATOR_NODES

PAGE = Path(__file__).parents[4] / "docs" / "navigation" / "behavior-trees.md"


@pytest.mark.parametrize("file", sorted(SHIPPED.glob("*.xml")), ids=lambda file: file.stem)
def test_a_shipped_tree_is_good_and_documented(file: Path) -> None:
    assert TreeBuilder(file, NAVIGATOR_NODES).main
    assert f"`{file.stem}`" in PAGE.read_text("utf-8")


def test_the_page_lists_every_node() -> None:
    text = PAGE.read_text("utf-8")
    assert [name for name in NAVIGATOR_NODES if f"`{name}`" not in text] == []


@pytest.mark.parametrize("text", ["inf", "-inf", "nan", "1e999"])
def test_a_time_that_is_not_finite_is_refused_when_the_file_is_read(tmp_path: Path, text: str) -> None:
    file = tmp_path / "tree.xml"
    leaf = f'<Spin time_allowance="{text}"/>'
    file.write_text(f'<root BTCPP_format="4"><BehaviorTree ID="Main">{leaf}</BehaviorTree></root>')
    with pytest.raises(
        NavigationError, match=r"time_allowance='.*' of <Spin> must be a number that is finite"
    ):
        TreeBuilder(file, NAVIGATOR_NODES)


def test_a_limit_may_be_infinite(tmp_path: Path) -> None:
    file = tmp_path / "tree.xml"
    ports = 'max_robot_pose_search_dist="inf" distance_forward="inf" input_path="{a}" output_path="{b}"'
    leaf = f"<TruncatePathLocal {ports}/>"
    file.write_text(f'<root BTCPP_format="4"><BehaviorTree ID="Main">{leaf}</BehaviorTree></root>')
    assert TreeBuilder(file, NAVIGATOR_NODES).main


def test_a_very_long_time_is_the_longest_there_is() -> None:
    for value, want in ((2.5, (2, 500_000_000)), (1e300, (2**31 - 1, 0)), (float("inf"), (2**31 - 1, 0))):
        message = seconds(value)
        assert (message.sec, message.nanosec) == want
