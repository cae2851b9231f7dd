"""Control nodes against nav2_behavior_tree: child results in, own status and number of ticks out."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from twin.bridge.clock import Clock
from twin.nodes.navigation.bt.control import (
    ControlNode,
    Fallback,
    PipelineSequence,
    RateController,
    RecoveryNode,
    RoundRobin,
    sequence,
)

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


# children, statuses of the ticks, ticks of each child
PIPELINE = [
    (("S", "S", "S"), "S", (1, 1, 1)),
    (("S", "R", "S"), "RR", (2, 2, 0)),  # a running child stops those after it, those before are ticked again
    (("RS", "S"), "RS", (2, 1)),
    (("S", "RS", "RS"), "RRS", (3, 3, 2)),
    (("SR", "RRS"), "RRS", (3, 3)),  # an earlier child that runs again does not hold up the later one
    (("SF", "R"), "RF", (2, 1)),  # but its failure ends everything
    (("S", "F", "S"), "F", (1, 1, 0)),
]


@pytest.mark.parametrize(("words", "statuses", "ticks"), PIPELINE)
def test_pipeline_sequence(words: tuple[str, ...], statuses: str, ticks: tuple[int, ...]) -> None:
    children = leaves(words)
    assert tick(PipelineSequence("p", children), len(statuses)) == statuses
    assert tuple(child.ticks for child in children) == ticks


def test_pipeline_sequence_halts_what_still_runs_and_starts_afresh() -> None:
    first, second = leaves(("SRRS", "RFRS"))
    node = PipelineSequence("p", [first, second])
    assert tick(node, 2) == "RF"
    assert first.halts == 1, "it was running when its sibling failed"
    assert tick(node, 1) == "R", "after a new start the first child's RUNNING holds up the second again"
    assert second.ticks == 2
    assert tick(node, 1) == "R"
    assert second.ticks == 3


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


ROUND_ROBIN = [
    (("S", "S", "S"), "SSSS", (2, 1, 1)),  # every entry takes the next child
    (("F", "S", "S"), "SSSS", (2, 2, 2)),  # a failure goes straight on to the next one
    (("F", "F", "F"), "F", (1, 1, 1)),
    (("RS", "S"), "RSS", (2, 1)),  # a running child keeps its turn
    (("F", "RF", "F"), "RF", (1, 2, 1)),
]


@pytest.mark.parametrize(("words", "statuses", "ticks"), ROUND_ROBIN)
def test_round_robin(words: tuple[str, ...], statuses: str, ticks: tuple[int, ...]) -> None:
    children = leaves(words)
    assert tick(RoundRobin("r", children), len(statuses)) == statuses
    assert tuple(child.ticks for child in children) == ticks


def test_round_robin_goes_on_inside_a_recovery_node() -> None:
    """The navigator's recoveries: each failure of the main child gets the next one."""
    actions = leaves(("S", "S", "S"))
    main = Leaf("F")
    assert tick(RecoveryNode("r", 5, main, RoundRobin("rr", actions)), 1) == "F"
    assert [action.ticks for action in actions] == [2, 2, 1]


def test_round_robin_begins_with_the_first_child_after_a_halt() -> None:
    children = leaves(("S", "R", "S"))
    node = RoundRobin("r", children)
    assert tick(node, 2) == "SR"
    node.stop(Status.INVALID)
    assert children[1].halts == 1
    assert tick(node, 1) == "S"
    assert [child.ticks for child in children] == [2, 1, 0]


def test_rate_controller_ticks_once_a_period_and_runs_in_between() -> None:
    clock = Clock()
    child = Leaf("S")
    node = RateController("rate", 1000, lambda: clock.now_ns, child)
    seen = ""
    for clock.now_ns in range(0, 2500, 250):
        seen += tick(node, 1)
    assert seen == "SRRRSRRRSR"
    assert child.ticks == 3


def test_rate_controller_does_not_throttle_a_running_child() -> None:
    clock = Clock()
    child = Leaf("RRRS")
    node = RateController("rate", 1000, lambda: clock.now_ns, child)
    seen = ""
    for clock.now_ns in range(0, 2000, 250):
        seen += tick(node, 1)
    assert seen == "RRRSRRRS", "the period counts from the child's success"
    assert child.ticks == 5


def test_rate_controller_ticks_at_once_after_a_halt() -> None:
    child = Leaf("S")
    node = RateController("rate", 1000, lambda: 0, child)
    assert tick(node, 2) == "SR"
    node.stop(Status.INVALID)
    assert tick(node, 1) == "S"


def test_rate_controller_in_a_pipeline_lets_the_later_child_run() -> None:
    """The navigator's use: the path is followed between two replannings."""
    clock = Clock()
    plan, follow = leaves(("S", "RRRRS"))
    node = PipelineSequence("p", [RateController("rate", 1000, lambda: clock.now_ns, plan), follow])
    seen = ""
    for clock.now_ns in range(0, 1250, 250):
        seen += tick(node, 1)
    assert seen == "RRRRS"
    assert (plan.ticks, follow.ticks) == (2, 5)


FALLBACK = [
    (("S", "S"), "S", (1, 0)),
    (("F", "S"), "S", (1, 1)),
    (("F", "R"), "RR", (2, 2)),
    (("FS", "R"), "RS", (2, 1)),
    (("F", "F"), "F", (1, 1)),
]


@pytest.mark.parametrize(("words", "statuses", "ticks"), FALLBACK)
def test_fallback_asks_from_the_first_child_every_time(
    words: tuple[str, ...], statuses: str, ticks: tuple[int, ...]
) -> None:
    children = leaves(words)
    assert tick(Fallback("f", children), len(statuses)) == statuses
    assert tuple(child.ticks for child in children) == ticks
    if words == ("FS", "R"):
        assert children[1].halts == 1, "the lower branch was running when the upper one succeeded"


def test_sequence_remembers_where_it_was() -> None:
    children = leaves(("S", "RS", "S"))
    assert tick(sequence("s", children), 2) == "RS"
    assert [child.ticks for child in children] == [1, 2, 1]


@pytest.mark.parametrize(
    "make",
    [
        lambda leaf: PipelineSequence("n", [Leaf("S"), leaf]),
        lambda leaf: RecoveryNode("n", 1, leaf, Leaf("S")),
        lambda leaf: RecoveryNode("n", 1, Leaf("F"), leaf),
        lambda leaf: RoundRobin("n", [leaf]),
        lambda leaf: RateController("n", 10, lambda: 0, leaf),
        lambda leaf: Fallback("n", [Leaf("F"), leaf]),
        lambda leaf: PipelineSequence("n", [RecoveryNode("m", 1, sequence("s", [leaf]), Leaf("S"))]),
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
