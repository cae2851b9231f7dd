"""Files of BehaviorTree.CPP 3 and 4: subtrees, ports, includes, and every fault at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.navigation.behavior_trees.conftest import REGISTRY, Bed
from twin.errors import NavigationError
from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.factory import TreeBuilder

Load = Callable[..., Bed]


def faults(tmp_path: Path, text: str) -> list[str]:
    file = tmp_path / "tree.xml"
    file.write_text(text)
    with pytest.raises(NavigationError) as caught:
        TreeBuilder(file, REGISTRY)
    return [str(problem).replace(str(file), "tree.xml") for problem in caught.value.problems]


def test_all_faults_of_a_file_are_told_with_their_lines(tmp_path: Path) -> None:
    told = faults(
        tmp_path,
        """<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <Sequence>
      <RateControler hz="1.0"><Leaf/></RateControler>
      <RateController herz="1.0"><Leaf/></RateController>
      <RateController hz="often"><Leaf/></RateController>
      <Inverter><Leaf/><Leaf/></Inverter>
      <RecoveryNode><Leaf/></RecoveryNode>
      <Repeat><Leaf/></Repeat>
      <SubTree ID="Recovre"/>
      <Leaf _skipIf="a == 1"/>
      <ComputeRoute/>
      <Action/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="Recover"><Leaf/></BehaviorTree>
  <BehaviorTree ID="Recover"><Leaf/></BehaviorTree>
  <BehaviourTree/>
</root>""",
    )
    text = "\n".join(told)
    for line, words in (
        (4, "there is no node <RateControler>; did you mean RateController"),
        (5, "<RateController> has no port 'herz'; did you mean 'hz'?"),
        (6, "hz='often' of <RateController> must be a number"),
        (7, "<Inverter> must have 1 children, not 2"),
        (8, "<RecoveryNode> must have 2 children, not 1"),
        (9, "<Repeat> needs num_cycles"),
        (10, "there is no tree 'Recovre'; did you mean 'Recover'?"),
        (11, "_skipIf is a script, and scripts are not run here"),
        (12, "<ComputeRoute> belongs to Nav2's route server"),
        (13, "<Action> needs an attribute ID"),
        (17, "tree 'Recover' is there already: tree.xml:16"),
        (18, "<BehaviourTree> is not known here"),
    ):
        assert f"tree.xml:{line}: {words}" in text
    assert len(told) == 13, "the nameless <Action> is also no node"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<root><BehaviorTree>", "tree.xml:1: not well-formed XML"),
        ("<tree/>", "the outermost tag is <tree>, not <root>"),
        ("<root/>", "main_tree_to_execute must name one of"),
        ('<root main_tree_to_execute="B"><BehaviorTree ID="A"><Leaf/></BehaviorTree></root>', "no tree 'B'"),
        ('<root><BehaviorTree ID="A"/></root>', "must have exactly one child, not 0"),
        ('<root><include path="none.xml"/></root>', "none.xml cannot be read"),
        ('<root><include path="tree.xml"/></root>', "tree.xml includes itself"),
        ('<root><include ros_pkg="a" path="b"/></root>', "ROS packages (ros_pkg) are not searched"),
        (
            '<root main_tree_to_execute="A"><BehaviorTree ID="A"><SubTree ID="B"/></BehaviorTree>'
            '<BehaviorTree ID="B"><SubTree ID="A"/></BehaviorTree></root>',
            "tree 'A' contains itself: A > B > A",
        ),
        (
            "<root><BehaviorTree>"
            + "<Inverter>" * 80
            + "<Leaf/>"
            + "</Inverter>" * 80
            + "</BehaviorTree></root>",
            "deeper",
        ),
    ],
)
def test_a_file_that_is_no_tree(tmp_path: Path, text: str, words: str) -> None:
    assert words in "\n".join(faults(tmp_path, text))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(NavigationError, match=r"none\.xml: cannot be read: No such file"):
        TreeBuilder(tmp_path / "none.xml", REGISTRY)


def test_the_explicit_form_of_tags(load: Load) -> None:
    bed = load(
        '<Control ID="Sequence"><Decorator ID="Inverter"><Action ID="Leaf" say="F"/></Decorator>'
        '<Condition ID="AlwaysSuccess"/></Control>'
    )
    assert bed.tick(1) == "S"


SUBTREE = """<root BTCPP_format="{version}" main_tree_to_execute="Main">
  <BehaviorTree ID="Main"><{call}/></BehaviorTree>
  <BehaviorTree ID="Inner"><Leaf hear="{{inside}}" heard="{{told}}"/></BehaviorTree>
</root>"""


@pytest.mark.parametrize(
    ("version", "call", "heard"),
    [
        (4, 'SubTree ID="Inner" inside="{outside}" told="{told}"', "out"),
        (4, 'SubTree ID="Inner" inside="a constant" told="{told}"', "a constant"),
        (4, 'SubTree ID="Inner" inside="{outside}" told="{=}"', "out"),
        (4, 'SubTree ID="Inner" _autoremap="true"', "in"),
        (4, 'SubTree ID="Inner" _autoremap="true" inside="{outside}"', "out"),
        (4, 'SubTree ID="Inner" inside="{outside}"', None),  # `told` stays inside
        (3, 'SubTree ID="Inner" inside="outside" told="told"', "out"),
        (3, 'SubTree ID="Inner" __shared_blackboard="true"', "in"),
        (3, 'SubTreePlus ID="Inner" __autoremap="true"', "in"),
        (3, 'SubTreePlus ID="Inner" inside="a constant" told="{told}"', "a constant"),
    ],
)
def test_ports_of_a_subtree(load: Load, version: int, call: str, heard: str | None) -> None:
    board = Blackboard()
    board.set("outside", "out")
    board.set("inside", "in")
    bed = load(SUBTREE.format(version=version, call=call), board)
    assert bed.tick(1) == "S"
    assert board.get("told") == heard


def test_an_entry_of_the_main_tree_from_inside(load: Load) -> None:
    text = SUBTREE.format(version=4, call='SubTree ID="Inner"').replace("{inside}", "{@inside}")
    board = Blackboard()
    board.set("inside", "in")
    load(text.replace("{told}", "{@told}"), board).tick(1)
    assert board.get("told") == "in"


def test_set_and_unset_entries(load: Load) -> None:
    board = Blackboard()
    load('<SetBlackboard output_key="speed" value="0.5"/>', board).tick(1)
    assert board.get("speed") == "0.5"
    load('<SetBlackboard output_key="{copy}" value="{speed}"/>', board).tick(1)
    assert board.get("copy") == "0.5"
    load('<UnsetBlackboard key="speed"/>', board).tick(1)
    assert board.get("speed") is None


def test_a_text_on_the_blackboard_is_read_as_the_ports_type(load: Load) -> None:
    board = Blackboard()
    board.set("times", "2")
    bed = load('<Repeat num_cycles="{times}"><Leaf name="a"/></Repeat>', board)
    assert bed.tick(1) == "S"
    assert bed.ticks == (2,)


def test_includes_are_relative_to_their_file(tmp_path: Path, load: Load) -> None:
    (tmp_path / "parts").mkdir()
    inner = '<root BTCPP_format="4"><BehaviorTree ID="{}">{}</BehaviorTree>{}</root>'
    (tmp_path / "parts" / "a.xml").write_text(
        inner.format("A", '<SubTree ID="B"/>', '<include path="b.xml"/>')
    )
    (tmp_path / "parts" / "b.xml").write_text(inner.format("B", '<Leaf name="b"/>', ""))
    bed = load(
        '<root BTCPP_format="4" main_tree_to_execute="Main"><include path="parts/a.xml"/>'
        '<BehaviorTree ID="Main"><SubTree ID="A"/></BehaviorTree></root>'
    )
    assert bed.tick(1) == "S"
    assert bed.leaves["b"].ticks == 1


def nested(levels: int) -> str:
    inside = "<Inverter>" * (levels - 1) + "<Leaf/>" + "</Inverter>" * (levels - 1)
    return f'<root BTCPP_format="4"><BehaviorTree ID="Main">{inside}</BehaviorTree></root>'


def test_how_deep_trees_may_be_nested(load: Load, tmp_path: Path) -> None:
    assert load(nested(64)).tick(1) == "F", "63 times the contrary of success"
    assert faults(tmp_path, nested(65)) == ["tree.xml:1: nested deeper than 64 levels"]


def test_a_port_that_a_node_needs(tmp_path: Path) -> None:
    tree = (
        '<root><BehaviorTree ID="Main"><PersistentSequence><Leaf/></PersistentSequence></BehaviorTree></root>'
    )
    assert "<PersistentSequence> needs current_child_idx" in "\n".join(faults(tmp_path, tree))
