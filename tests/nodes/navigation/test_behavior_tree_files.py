"""Trees that ship with twin, and the page that lists the nodes."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.navigation.behavior_trees.factory import TreeBuilder
from twin.nodes.navigation.behavior_trees.navigator import SHIPPED
from twin.nodes.navigation.behavior_trees.registry import NAVIGATOR_NODES

PAGE = Path(__file__).parents[3] / "docs" / "navigation" / "behavior-trees.md"


@pytest.mark.parametrize("file", sorted(SHIPPED.glob("*.xml")), ids=lambda file: file.stem)
def test_a_shipped_tree_is_good_and_documented(file: Path) -> None:
    assert TreeBuilder(file, NAVIGATOR_NODES).main
    assert f"`{file.stem}`" in PAGE.read_text("utf-8")


def test_the_page_lists_every_node() -> None:
    text = PAGE.read_text("utf-8")
    assert [name for name in NAVIGATOR_NODES if f"`{name}`" not in text] == []
