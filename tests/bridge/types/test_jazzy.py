"""The table of definitions and the names of `msgs` are those of rosbags' own module."""

from __future__ import annotations

import ast
from pathlib import Path

from rosbags.typesys.stores import ros2_jazzy

from twin.bridge import msgs, types
from twin.bridge.types.jazzy import jazzy


def test_the_table_has_the_definitions_of_rosbags() -> None:
    assert jazzy() == ros2_jazzy.FIELDDEFS


def test_a_message_is_what_rosbags_makes_of_it() -> None:
    own, theirs = msgs.Marker, ros2_jazzy.visualization_msgs__msg__Marker
    assert own is types.get("visualization_msgs/msg/Marker")
    fields = [name for name, kind in theirs.__annotations__.items() if not kind.startswith("ClassVar")]
    assert (own.__name__, list(own.__annotations__)) == (theirs.__name__, fields)
    assert (own.ADD, own.DELETEALL) == (theirs.ADD, theirs.DELETEALL)


def test_every_name_that_type_checkers_know_is_there_and_no_other() -> None:
    (block,) = (
        node
        for node in ast.parse(Path(msgs.__file__).read_text("utf-8")).body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    told = {
        ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)
        for node in block.body
        if isinstance(node, ast.Assign | ast.AnnAssign)
    }
    found = {name for name in dir(msgs) if hasattr(getattr(msgs, name), "__msgtype__")}
    assert found == told
