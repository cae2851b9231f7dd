"""What a run and a process in lock-step say to each other: `twin_msgs/srv/Step` and two kinds of tokens.

The service travels as any other of rmw_zenoh. The tokens tell who takes part; the ROS graph has others.
From those who take no part a run lets in questions, nothing that changes it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np
import zenoh

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import codec
from twin.bridge.services.questions import ZenohQuestion
from twin.bridge.types import ServiceType
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import demangle, mangle, topic_key
from twin.bridge.wire.session import direct

STEP = ServiceType("twin_msgs/srv/Step")
Entry: Any = types.get("twin_msgs/msg/LockstepEntry")
_EMPTY = np.zeros(0, np.uint8)
requests, responses = codec(STEP.Request), codec(STEP.Response)


def entry(kind: int, number: int = 0, key: str = "", attachment: bytes = b"", payload: bytes = b"") -> Any:
    """Return a LockstepEntry."""
    return Entry(kind, number, key, _octets(attachment), _octets(payload))


def step_key(domain_id: int, node: str) -> str:
    """Return the key of the service that steps the process of a node, such as '/controller'."""
    return topic_key(domain_id, f"{node}/step", types.dds_name(STEP.name), types.rihs01(STEP.name))


def run_token(domain_id: int) -> str:
    """Return the token of a run that steps others."""
    return f"@twin_lockstep/{domain_id}/run"


def node_token(domain_id: int, session_id: str, node: str) -> str:
    """Return the token of a node that wants to be stepped; '*' stands for any session or node."""
    return f"@twin_lockstep/{domain_id}/{session_id}/{node if node == '*' else mangle(node)}"


def parse_node_token(token: str) -> tuple[str, str]:
    """Return the session's id and the node of a `node_token`."""
    _, _, session_id, node = token.split("/")
    return session_id, demangle(node)


def carried(carrier: zenoh.Sample | zenoh.Query) -> tuple[bytes, bytes]:
    """Return attachment and payload, each empty if there is none."""
    attachment, payload = carrier.attachment, carrier.payload
    return attachment.to_bytes() if attachment else b"", payload.to_bytes() if payload else b""


def ask(session: zenoh.Session, request: Any, on_entry: Callable[[Any], None]) -> None:
    """Ask a session's services what an entry REQUEST says; hand on each reply, and the end, as entries."""

    def on_reply(reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            on_entry(entry(Entry.REPLY, request.number, "", *carried(reply.ok)))

    session.get(
        request.key,
        direct(on_reply, lambda: on_entry(entry(Entry.END, request.number))),
        target=zenoh.QueryTarget.ALL_COMPLETE,
        consolidation=zenoh.ConsolidationMode.NONE,
        payload=request.payload.tobytes(),
        attachment=request.attachment.tobytes(),
        timeout=1e8,
    )


class Questions:
    """Queries that the other side answers, by number."""

    def __init__(self) -> None:
        self._open: dict[int, zenoh.Query] = {}
        self._count = 0

    def pass_on(self, key: str, query: zenoh.Query) -> Any:
        """Keep a query for services of a key; return the entry that asks it on the other side."""
        self._count += 1
        self._open[self._count] = query
        return entry(Entry.REQUEST, self._count, key, *carried(query))

    def answer(self, item: Any) -> None:
        """Do what an entry says: REPLY, or END after the last one."""
        query = self._open.get(item.number)
        if query is not None and item.kind == Entry.REPLY:
            query.reply(query.key_expr, item.payload.tobytes(), attachment=item.attachment.tobytes())
        elif query is not None:
            self._open.pop(item.number).drop()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Let nobody wait any more."""
        for query in self._open.values():
            query.drop()  # type: ignore[no-untyped-call]
        self._open.clear()


def _octets(data: bytes) -> Any:
    return np.frombuffer(data, np.uint8) if data else _EMPTY


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
