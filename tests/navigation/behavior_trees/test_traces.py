"""Every tick and halt against the real BehaviorTree.CPP and Nav2 (tests/oracles/behavior_trees)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from twin.navigation.behavior_trees.blackboard import Blackboard
from twin.navigation.behavior_trees.factory import BASIC_NODES, TreeBuilder
from twin.navigation.behavior_trees.node import NodeSetup, Status, TreeContext, TreeNode
from twin.navigation.behavior_trees.ports import inputs

GOLDENS = Path(__file__).parents[2] / "oracles" / "behavior_trees" / "goldens.json"
LETTERS = {"S": Status.SUCCESS, "F": Status.FAILURE, "R": Status.RUNNING, "-": Status.SKIPPED}
NAMES = {status: letter for letter, status in LETTERS.items()} | {Status.IDLE: "."}


class Leaf(TreeNode):
    """Answers the letters of its word one tick after the other, over and over."""

    PORTS = inputs(say=("string", "S"))

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self.ticks, self.events = 0, list[str]()

    def tick(self) -> Status:
        word = self.get("say")
        answer = word[self.ticks % len(word)]
        self.ticks += 1
        self.events.append(self.name + answer)
        return LETTERS[answer]

    def halt(self) -> None:
        self.events.append(self.name + "!")


def traced(file: Path, script: str) -> list[list[str]]:
    clock, events = [0], list[str]()
    blackboard = Blackboard()
    blackboard.set("place", 0)
    tree = TreeBuilder(file, {**BASIC_NODES, "Leaf": Leaf}).build(TreeContext(lambda: clock[0]), blackboard)
    nodes = list(tree.nodes())
    for node in nodes:
        if isinstance(node, Leaf):
            node.events = events
    steps = []
    for step in script:
        events.clear()
        if step == "t":
            status = tree.tick()
            said = NAMES[status]
            if (
                status.is_completed
            ):  # tickOnce does; here the root keeps it until whoever ran the tree halts it
                tree.root.set_status(Status.IDLE)
        else:
            said = "h"
            tree.halt()
        steps.append([said, " ".join(events), "".join(NAMES[node.status] for node in nodes)])
        clock[0] += 100_000_000
    return steps


def test_trees_tick_and_halt_as_behaviortree_cpp_does(tmp_path: Path) -> None:
    goldens: list[dict[str, Any]] = json.loads(GOLDENS.read_text())
    assert len(goldens) > 250
    file = tmp_path / "tree.xml"
    wrong = []
    for golden in goldens:
        file.write_text(golden["xml"])
        script, real = golden["script"], golden["trace"]
        ours = traced(file, script)
        if ours != real:
            at = next(i for i in range(len(real)) if ours[i] != real[i])
            wrong.append(f"{golden['xml']}\n  step {at} of {script}: real {real[at]}, ours {ours[at]}")
    assert not wrong, f"{len(wrong)} of {len(goldens)} differ:\n" + "\n".join(wrong[:10])
