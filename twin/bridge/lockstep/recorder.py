"""What the nodes of one process do, as entries in order, and what the run does to them.

The nodes live on a bus that no other process can reach. There Zenoh calls back at once, so listening to
everything gives one order of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import zenoh

from twin.bridge.bus import Bus
from twin.bridge.lockstep.protocol import Entry, Questions, ask, carried, entry
from twin.bridge.wire.keys import gid, parse_attachment
from twin.bridge.wire.session import direct
from twin.errors import BridgeError


class Recorder:
    """The border between the run and the nodes of a process, which reach each other without it."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._sent: list[Any] = []
        self._numbers: dict[str, int] = {}
        self._gids: dict[bytes, int] = {}
        self._subscriptions: dict[int, Any] = {}
        self._questions = Questions()
        self._asking = False
        self._offered: dict[str, Any] = {}
        session, everything = bus.session, f"{bus.domain_id}/**"
        self._tokens = session.liveliness().declare_subscriber(
            f"@ros2_lv/{everything}", direct(self._on_token)
        )
        self._samples = session.declare_subscriber(everything, direct(self._on_sample))
        # Before the run has told which services there are, a request to any of them waits.
        self._any_service: Any = session.declare_queryable(everything, direct(self._on_query), complete=True)

    def take(self) -> list[Any]:
        """Return what the nodes did since the last call, in order."""
        sent, self._sent = self._sent, []
        return sent

    def apply(self, entries: Sequence[Any]) -> None:
        """Let the nodes have what the run sent, in order: it waits in their inboxes.

        Raises:
            BridgeError: the run and this process do not agree on what there is.
        """
        for item in entries:
            if item.kind == Entry.SAMPLE:
                source = parse_attachment(item.attachment.tobytes())
                self._subscription(item.number).enqueue((item.payload.tobytes(), source), False)
            elif item.kind == Entry.REQUEST:
                self._asking = True
                ask(self._bus.session, item, lambda answer: self._sent.append(answer))
                self._asking = False
            elif item.kind in (Entry.REPLY, Entry.END):
                self._questions.answer(item)
            elif item.kind == Entry.DECLARE:
                self._offered[item.key] = self._bus.session.declare_queryable(
                    item.key, direct(self._on_query), complete=True
                )
            elif item.kind == Entry.UNDECLARE and item.key in self._offered:
                self._offered.pop(item.key).undeclare()

    def joined(self) -> None:
        """Take from now on only requests to services that the run offers."""
        if self._any_service is not None:
            self._any_service.undeclare()
            self._any_service = None

    def _subscription(self, number: int) -> Any:
        if number not in self._subscriptions:
            for node in self._bus.nodes:
                for endpoint in node.endpoints:
                    known = self._gids.get(getattr(endpoint, "gid", b""))
                    if known is not None:
                        self._subscriptions[known] = endpoint
        if number not in self._subscriptions:
            raise BridgeError(
                f"the run sent a sample for endpoint {number}, which this process does not have"
            )
        return self._subscriptions[number]

    def _on_token(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            number = self._numbers[token] = len(self._numbers)
            self._gids[gid(token)] = number
            self._sent.append(entry(Entry.DECLARE, number, token))
        elif token in self._numbers:
            self._sent.append(entry(Entry.UNDECLARE, self._numbers[token]))
            self._subscriptions.pop(self._numbers[token], None)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        attachment, payload = carried(sample)
        source = parse_attachment(attachment)
        number = self._gids.get(source.gid) if source else None
        if number is not None:
            self._sent.append(entry(Entry.SAMPLE, number, "", attachment, payload))

    def _on_query(self, query: zenoh.Query) -> None:
        if self._asking:  # the run asks one of our services; nobody else is meant
            query.drop()  # type: ignore[no-untyped-call]
        else:
            self._sent.append(self._questions.pass_on(str(query.key_expr), query))
