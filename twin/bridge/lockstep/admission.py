"""What a run in lock-step lets in from those who take no part: questions, nothing that changes it."""

from __future__ import annotations

from collections.abc import Collection

from twin.bridge.bus import Bus
from twin.bridge.services.questions import ZenohQuestion
from twin.bridge.wire.external import Arrival

READING = frozenset(
    f"rcl_interfaces::srv::dds_::{name}_"
    for name in ("GetParameters", "GetParameterTypes", "ListParameters", "DescribeParameters")
) | {"type_description_interfaces::srv::dds_::GetTypeDescription_"}
"""Services that change nothing, by their names in keys."""


def admit_questions(bus: Bus, answered: Collection[str]) -> None:
    """Let requests of `READING` services into the inboxes; refuse, count and report once everything else.

    Args:
        bus: The run's.
        answered: Topics that come in by another way.
    """
    for arrival in bus.external.drain():
        if _reads(arrival):
            arrival.receiver.enqueue(arrival.data, True)
        elif arrival.receiver.name not in answered:
            bus.external.refuse(
                "lock-step", arrival.receiver.name, "such a run listens only to those for whom it waits"
            )
        if isinstance(arrival.data, ZenohQuestion) and not _reads(arrival):
            arrival.data.drop()


def _reads(arrival: Arrival) -> bool:
    question = arrival.data
    return isinstance(question, ZenohQuestion) and str(question.query.key_expr).split("/")[-2] in READING
