"""Missions' control nodes against nav2_behavior_tree: child results in, own status and ticks out."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from twin.nodes.navigation.bt.control import ControlNode, RecoveryNode, sequence

STATUS = {"S": Status.SUCCESS, "F": Status.FAILURE, "R": Status.RUNNING}
LETTER = {status: letter for letter, status in STATUS.items()}


class Leaf(Behaviour):
    """Returns the letters of `results` one tick after the other, the last one for ever."""

    def __init__(self, results: str) -> None:
        super().__init__(results)
        self.results = results
        self.ticks = self.starts = self.halts = 0

    def initialise(self) -> None:
        self.starts += 1

    def update(self) -> Status:
        result = self.results[min(self.ticks, len(self.results) - 1)]
        self.ticks += 1
        return STATUS[result]

    def terminate(self, new_status: Status) -> None:
        if new_status == Status.INVALID and self.status == Status.RUNNING:
            self.halts += 1


def leaves(words: Iterable[str]) -> list[Leaf]:
    return [Leaf(word) for word in words]


def tick(node: Behaviour, times: int) -> str:
    """Tick, and return the status after each tick as letters."""
    seen = ""
    for _ in range(times):
        node.tick_once()
        seen += LETTER[node.status]
    return seen


# retries, main, recovery, statuses, ticks of both
RECOVERY = [
    (1, "S", "S", "S", (1, 0)),
    (1, "RRS", "S", "RRS", (3, 0)),
    (1, "FS", "S", "S", (2, 1)),  # fail, recover and try again are one tick if nothing runs
    (1, "F", "S", "F", (2, 1)),
    (3, "F", "S", "F", (4, 3)),
    (0, "F", "S", "F", (1, 0)),
    (6, "F", "F", "F", (1, 1)),  # a recovery that fails ends it
    (2, "FFS", "RS", "RS", (3, 3)),  # while the recovery runs the main child is left alone
    (1, "FRS", "RS", "RRS", (3, 2)),
]


@pytest.mark.parametrize(("retries", "main", "recovery", "statuses", "ticks"), RECOVERY)
def test_recovery_node(retries: int, main: str, recovery: str, statuses: str, ticks: tuple[int, int]) -> None:
    a, b = leaves((main, recovery))
    assert tick(RecoveryNode("r", retries, a, b), len(statuses)) == statuses
    assert (a.ticks, b.ticks) == ticks


def test_recovery_node_has_all_retries_again_at_the_next_start() -> None:
    a, b = leaves(("F", "S"))
    node = RecoveryNode("r", 2, a, b)
    assert tick(node, 2) == "FF"
    assert (a.ticks, b.ticks) == (6, 4)


def test_recovery_node_succeeds_when_something_later_fails_elsewhere() -> None:
    a, b = leaves(("FS", "S"))
    node = RecoveryNode("r", 1, a, b)
    assert tick(node, 2) == "SS"
    assert b.ticks == 1


def test_sequence_remembers_where_it_was() -> None:
    children = leaves(("S", "RS", "S"))
    assert tick(sequence("s", children), 2) == "RS"
    assert [child.ticks for child in children] == [1, 2, 1]


@pytest.mark.parametrize(
    "make",
    [
        lambda leaf: RecoveryNode("n", 1, leaf, Leaf("S")),
        lambda leaf: RecoveryNode("n", 1, Leaf("F"), leaf),
        lambda leaf: RecoveryNode("m", 1, sequence("s", [leaf]), Leaf("S")),
    ],
)
def test_halting_a_control_node_halts_its_running_leaf_once(make: object) -> None:
    leaf = Leaf("R")
    node = make(leaf)  # type: ignore[operator]
    assert tick(node, 3) == "RRR"
    assert leaf.starts == 1, "a leaf that runs is not started again"
    node.stop(Status.INVALID)
    node.stop(Status.INVALID)
    assert leaf.halts == 1
    assert leaf.status == Status.INVALID


def test_a_control_node_must_say_how_its_children_run() -> None:
    with pytest.raises(TypeError, match="abstract"):
        ControlNode("n", [])  # type: ignore[abstract]
