"""Trees of leaves whose answers are written down: `<Leaf say="RRS"/>`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.factory import BASIC_NODES, Tree, TreeBuilder
from twin.navigation.behavior_trees.node import NodeSetup, Status, TreeContext, TreeNode
from twin.navigation.behavior_trees.ports import inputs, outputs

LETTERS = {"S": Status.SUCCESS, "F": Status.FAILURE, "R": Status.RUNNING, "-": Status.SKIPPED}
NAMES = {status: letter for letter, status in LETTERS.items()}


class Leaf(TreeNode):
    """Answers the letters of `say` one tick after the other, the last one for ever."""

    PORTS = (*inputs(say=("string", "S"), hear="any"), *outputs(heard="any"))

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self.ticks = self.halts = 0

    def tick(self) -> Status:
        say = self.get("say")
        answer = say[min(self.ticks, len(say) - 1)]
        self.ticks += 1
        self.put("heard", self.get("hear"))
        return LETTERS[answer]

    def halt(self) -> None:
        self.halts += 1


REGISTRY = {**BASIC_NODES, "Leaf": Leaf}


class Bed:
    """A tree, its clock, and what its nodes said."""

    def __init__(self, tree: Tree, clock: list[int]) -> None:
        self.tree, self._clock = tree, clock
        self.leaves = {node.name: node for node in tree.nodes() if isinstance(node, Leaf)}

    def tick(self, times: int, step_ns: int = 0) -> str:
        """Tick, advance the clock each time; the statuses as letters."""
        said = ""
        for _ in range(times):
            said += NAMES[self.tree.tick()]
            self._clock[0] += step_ns
        return said

    @property
    def ticks(self) -> tuple[int, ...]:
        return tuple(leaf.ticks for leaf in self.leaves.values())

    @property
    def halts(self) -> tuple[int, ...]:
        return tuple(leaf.halts for leaf in self.leaves.values())


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Bed]:
    """Return what makes a tree of the inside of its `BehaviorTree`, or of a whole file."""

    def build(text: str, blackboard: Blackboard | None = None) -> Bed:
        if "<root" not in text:
            text = f'<root BTCPP_format="4"><BehaviorTree ID="Main">{text}</BehaviorTree></root>'
        file = tmp_path / "tree.xml"
        file.write_text(text)
        clock = [0]
        context = TreeContext(lambda: clock[0])
        tree = TreeBuilder(file, REGISTRY).build(context, blackboard or Blackboard())
        return Bed(tree, clock)

    return build


def node(type_: str, *words: str, **attributes: object) -> str:
    """Return the XML of a control node over leaves that say these words."""
    ports = "".join(f' {key}="{value}"' for key, value in attributes.items())
    leaves = "".join(f'<Leaf name="{i}" say="{word}"/>' for i, word in enumerate(words))
    return f"<{type_}{ports}>{leaves}</{type_}>"
