"""Every control node and decorator against the sources of BehaviorTree.CPP 4.7 and nav2_behavior_tree:
what the children say in, what the node says and how often each child is ticked out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tests.navigation.behavior_trees.conftest import Bed, node

Load = Callable[..., Bed]

# type, attributes, words of the children, what it says, ticks of each child
CASES: list[tuple[str, dict[str, Any], tuple[str, ...], str, tuple[int, ...]]] = [
    ("Sequence", {}, ("S", "RS", "S"), "RS", (1, 2, 1)),  # remembers where it was
    ("Sequence", {}, ("S", "F", "S"), "FF", (2, 2, 0)),  # from the first after a failure
    ("Sequence", {}, ("-", "-"), "-", (1, 1)),
    ("Sequence", {}, ("-", "S"), "S", (1, 1)),
    ("SequenceWithMemory", {}, ("S", "FS", "S"), "FS", (1, 2, 1)),  # goes on where it failed
    ("SequenceStar", {}, ("S", "FS", "S"), "FS", (1, 2, 1)),
    ("ReactiveSequence", {}, ("S", "RRS"), "RRS", (3, 3)),  # asks the first again and again
    ("ReactiveSequence", {}, ("SF", "R"), "RF", (2, 1)),
    ("Fallback", {}, ("F", "RF", "S"), "RS", (1, 2, 1)),
    ("Fallback", {}, ("F", "F"), "F", (1, 1)),
    ("ReactiveFallback", {}, ("FS", "R"), "RS", (2, 1)),
    ("ReactiveFallback", {}, ("F", "F"), "F", (1, 1)),
    ("Parallel", {}, ("S", "RS", "RRS"), "RRS", (1, 2, 3)),  # all must succeed, one failure ends it
    ("Parallel", {}, ("R", "F", "R"), "F", (1, 1, 0)),
    ("Parallel", {"success_count": 1}, ("R", "RS", "R"), "RS", (2, 2, 1)),
    ("Parallel", {"success_count": 2, "failure_count": 2}, ("F", "S", "RS"), "RS", (1, 1, 2)),
    ("ParallelAll", {}, ("F", "RRS"), "RRF", (1, 3)),  # waits for all
    ("ParallelAll", {"max_failures": 2}, ("F", "RS"), "RS", (1, 2)),
    ("IfThenElse", {}, ("S", "RS", "F"), "RS", (1, 2, 0)),
    ("IfThenElse", {}, ("F", "S", "RF"), "RF", (1, 0, 2)),
    ("IfThenElse", {}, ("F", "S"), "F", (1, 0)),
    ("WhileDoElse", {}, ("SF", "R", "R"), "RR", (2, 1, 1)),
    ("Inverter", {}, ("RFS",), "RSF", (3,)),
    ("ForceSuccess", {}, ("RF",), "RS", (2,)),
    ("ForceFailure", {}, ("RS",), "RF", (2,)),
    ("KeepRunningUntilFailure", {}, ("SRSF",), "RRRF", (4,)),
    ("Repeat", {"num_cycles": 3}, ("S",), "S", (3,)),  # what ends at once is repeated within the tick
    ("Repeat", {"num_cycles": 3}, ("RSSRS",), "RRS", (5,)),
    ("Repeat", {"num_cycles": 3}, ("SF",), "F", (2,)),
    ("Repeat", {"num_cycles": -1}, ("R",), "RRRRR", (5,)),
    ("RetryUntilSuccessful", {"num_attempts": 3}, ("FFS",), "S", (3,)),
    ("RetryUntilSuccessful", {"num_attempts": 2}, ("F",), "F", (2,)),
    ("RetryUntilSuccesful", {"num_attempts": 1}, ("F",), "F", (1,)),  # as version 3 spelt it
    ("RunOnce", {}, ("RS",), "RS--", (2,)),
    ("RunOnce", {"then_skip": "false"}, ("F",), "FFF", (1,)),
    ("PipelineSequence", {}, ("S", "S", "S"), "S", (1, 1, 1)),
    ("PipelineSequence", {}, ("S", "R", "S"), "RR", (2, 2, 0)),  # a running child stops those after it
    ("PipelineSequence", {}, ("RS", "S"), "RS", (2, 1)),
    ("PipelineSequence", {}, ("S", "RS", "RS"), "RRS", (3, 3, 2)),
    ("PipelineSequence", {}, ("SR", "RRS"), "RRS", (3, 3)),  # one that runs again does not hold up the later
    ("PipelineSequence", {}, ("SF", "R"), "RF", (2, 1)),  # but its failure ends everything
    ("RecoveryNode", {}, ("S", "S"), "S", (1, 0)),
    ("RecoveryNode", {}, ("RRS", "S"), "RRS", (3, 0)),
    ("RecoveryNode", {}, ("FS", "S"), "S", (2, 1)),  # fail, recover, try again are one tick if nothing runs
    ("RecoveryNode", {}, ("F", "S"), "FF", (4, 2)),  # all retries again at the next start
    ("RecoveryNode", {"number_of_retries": 3}, ("F", "S"), "F", (4, 3)),
    ("RecoveryNode", {"number_of_retries": 0}, ("F", "S"), "F", (1, 0)),
    ("RecoveryNode", {"number_of_retries": 6}, ("F", "F"), "F", (1, 1)),  # a recovery that fails ends it
    ("RecoveryNode", {"number_of_retries": 2}, ("FFS", "RS"), "RS", (3, 3)),
    ("RoundRobin", {}, ("S", "S", "S"), "SSSS", (2, 1, 1)),  # every entry takes the next child
    ("RoundRobin", {}, ("F", "S", "S"), "SSSS", (2, 2, 2)),
    ("RoundRobin", {}, ("F", "F", "F"), "F", (1, 1, 1)),
    ("RoundRobin", {}, ("RS", "S"), "RSS", (2, 1)),  # a running child keeps its turn
    ("RoundRobin", {"wrap_around": "false"}, ("S", "F"), "SFS", (2, 1)),
    ("NonblockingSequence", {}, ("S", "RS"), "RS", (2, 2)),
    ("NonblockingSequence", {}, ("R", "SF"), "RF", (2, 2)),  # the first, running, holds nobody up
]


@pytest.mark.parametrize(("type_", "attributes", "words", "says", "ticks"), CASES)
def test_what_a_node_says(
    load: Load,
    type_: str,
    attributes: dict[str, Any],
    words: tuple[str, ...],
    says: str,
    ticks: tuple[int, ...],
) -> None:
    bed = load(node(type_, *words, **attributes))
    assert bed.tick(len(says)) == says
    assert bed.ticks == ticks


CONTROLS = (
    *("Sequence", "SequenceWithMemory", "ReactiveSequence", "Fallback", "ReactiveFallback", "Parallel"),
    *("ParallelAll", "PipelineSequence", "RoundRobin", "NonblockingSequence"),
    *("Inverter", "ForceSuccess", "KeepRunningUntilFailure", "RunOnce", "RateController", "SingleTrigger"),
)


@pytest.mark.parametrize("type_", CONTROLS)
def test_a_halt_reaches_the_running_leaf_once(load: Load, type_: str) -> None:
    bed = load(node(type_, "R"))
    assert bed.tick(3) == "RRR"
    bed.tree.halt()
    bed.tree.halt()
    assert bed.halts == (1,)
    assert bed.tick(1) == "R", "and it can begin anew"


def test_a_reactive_sequence_halts_what_ran_when_an_earlier_child_fails(load: Load) -> None:
    bed = load(node("ReactiveSequence", "SSF", "R"))
    assert bed.tick(3) == "RRF"
    assert bed.halts == (0, 1)


def test_a_pipeline_starts_afresh_after_a_failure(load: Load) -> None:
    bed = load(node("PipelineSequence", "SRRS", "RFRS"))
    assert bed.tick(2) == "RF"
    assert bed.halts == (1, 0)
    assert bed.tick(1) == "R"
    assert bed.ticks == (3, 2), "the first child's RUNNING holds up the second again"


def test_the_next_recovery_after_each_failure(load: Load) -> None:
    """RoundRobin keeps its turn inside of a RecoveryNode, though reset after every success."""
    actions = node("RoundRobin", "S", "S", "S")
    bed = load(f'<RecoveryNode number_of_retries="5"><AlwaysFailure/>{actions}</RecoveryNode>')
    assert bed.tick(1) == "F"
    assert bed.ticks == (2, 2, 1)


def test_a_recovery_node_begins_with_its_first_child_and_all_retries_after_a_halt(load: Load) -> None:
    bed = load(node("RecoveryNode", "FS", "R"))
    assert bed.tick(1) == "R"
    bed.tree.halt()
    assert bed.tick(1) == "S"
    assert bed.ticks == (2, 1)
    bed = load(node("RecoveryNode", "FRF", "S", number_of_retries=2))
    assert bed.tick(1) == "R"
    bed.tree.halt()
    assert bed.tick(1) == "F"
    assert bed.ticks == (5, 3), "twice more after the halt"


def test_a_recovery_node_whose_recovery_is_skipped_fails_and_tries_again(load: Load) -> None:
    bed = load(node("RecoveryNode", "FFS", "-S", number_of_retries=1))
    assert bed.tick(2) == "FS"
    assert bed.ticks == (3, 2)


def test_round_robin_begins_with_the_first_child_after_a_halt(load: Load) -> None:
    bed = load(node("RoundRobin", "S", "R", "S"))
    assert bed.tick(2) == "SR"
    bed.tree.halt()
    assert bed.tick(1) == "S"
    assert bed.ticks == (2, 1, 0)


def test_a_recovery_is_under_way_while_it_runs(load: Load) -> None:
    bed = load(node("RoundRobin", "RS", "RF", "R"))
    context = bed.tree.root.context
    seen = []
    for _ in range(4):
        bed.tick(1)
        seen.append(context.recovering)
    assert seen == [True, False, True, True]
    bed.tree.halt()
    assert not context.recovering


@pytest.mark.parametrize(
    ("word", "ticks"),
    [
        ("S", 3),
        ("RRRS", 5),  # a running child is not throttled; the period counts from its success
    ],
)
def test_rate_controller(load: Load, word: str, ticks: int) -> None:
    limited = node("RateController", word, hz=1.0)
    bed = load(f'<PipelineSequence>{limited}<Leaf name="on" say="R"/></PipelineSequence>')
    assert bed.tick(10, step_ns=250_000_000) == "R" * 10
    assert bed.leaves["0"].ticks == ticks


def test_the_path_is_followed_between_two_replannings(load: Load) -> None:
    plan = '<RateController hz="1.0"><Leaf name="plan"/></RateController>'
    bed = load(f'<PipelineSequence>{plan}<Leaf name="follow" say="RRRRS"/></PipelineSequence>')
    assert bed.tick(5, step_ns=250_000_000) == "RRRRS"
    assert bed.ticks == (2, 5)


def test_a_single_trigger_fails_after_its_one_run(load: Load) -> None:
    bed = load(f'<PipelineSequence>{node("SingleTrigger", "RS")}<Leaf name="on" say="R"/></PipelineSequence>')
    assert bed.tick(3) == "RRF"
    assert bed.leaves["0"].ticks == 2


def test_what_is_repeated_for_ever_without_running_does_not_hold_up_its_program(load: Load) -> None:
    """BehaviorTree.CPP never returns from this tick."""
    bed = load(node("Repeat", "S", num_cycles=-1))
    assert bed.tick(2) == "RR"
    bed.tree.halt()


def test_delay_and_timeout_and_sleep_are_in_simulated_time(load: Load) -> None:
    assert load(node("Delay", "RS", delay_msec=500)).tick(5, 250_000_000) == "RRRSR"
    timeout = load(node("Timeout", "R", msec=500))
    assert timeout.tick(4, 250_000_000) == "RRFR"
    assert timeout.halts == (1,)
    assert load(node("Timeout", "RS", msec=500)).tick(2, 250_000_000) == "RS"
    assert load('<Sleep msec="500"/>').tick(4, 250_000_000) == "RRSR"


def test_a_node_keeps_its_status_until_its_parent_resets_it(load: Load) -> None:
    """What GoalUpdated, TimeExpired and others rely on."""
    seen: list[tuple[str, str]] = []
    bed = load('<PipelineSequence><Leaf name="a" say="SSS"/><Leaf name="b" say="RRS"/></PipelineSequence>')
    bed.tree.root.context.on_transition = lambda node, before, now: seen.append((node.name, now.value))
    bed.tick(2)
    assert [name for name, _ in seen].count("a") == 1
    bed.tick(1)
    assert ("a", "IDLE") in seen
