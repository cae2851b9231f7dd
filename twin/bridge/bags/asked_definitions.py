"""Definitions that are not known here, asked of who publishes them (`~/get_type_description`, REP-2016)."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from twin.bridge import types
from twin.bridge.bags import definitions
from twin.bridge.graph import EndpointInfo
from twin.bridge.node import Node
from twin.bridge.node.services import GetTypeDescription
from twin.bridge.services import Client, Future
from twin.bridge.types import description as type_description
from twin.errors import BridgeError

_PATIENCE_S = 0.4
"""How long an answer is waited for, [s] of wall time: what a killed recorder may lose allows no more."""
_MOST = 50
"""Nodes asked at a time."""


class Kind(NamedTuple):
    """Which definition."""

    type: str
    type_hash: str


@dataclass
class _Question:
    kind: Kind
    client: Client
    until_s: float
    future: Future | None = None


class AskedDefinitions:
    """Asks for each unknown definition once per node that publishes it; call `update` after every spin."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._open: dict[tuple[Kind, str], _Question] = {}
        self._asked: set[tuple[Kind, str]] = set()
        self._texts: dict[Kind, str] = {}

    def text(self, kind: Kind) -> str:
        """Return the full definition as bags hold it, '' if nobody told it (yet)."""
        return self._texts.get(kind, "")

    def is_awaited(self, kind: Kind) -> bool:
        """Whether an answer may still come."""
        return any(asked == kind for asked, _ in self._open)

    def ask(self, endpoints: Iterable[EndpointInfo]) -> None:
        """Ask the nodes of publishers whose definition is not known here."""
        for endpoint in endpoints:
            kind, owner = Kind(endpoint.type, endpoint.type_hash), endpoint.node.full_name
            if (kind, owner) in self._asked or len(self._open) >= _MOST:
                continue
            self._asked.add((kind, owner))
            # Humble has no such service, and a bridge tells no hash to compare with.
            if not kind.type_hash.startswith("RIHS01_") or _is_known(kind) or kind in self._texts:
                continue
            try:
                client = self._node.create_client(GetTypeDescription, f"{owner}/get_type_description")
            except BridgeError:
                continue  # no name of a node
            self._open[kind, owner] = _Question(kind, client, time.monotonic() + _PATIENCE_S)

    def update(self) -> None:
        """Ask who has become reachable, take answers, and give up who is late."""
        for key in [key for key, question in self._open.items() if self._is_over(question)]:
            self._node.destroy_client(self._open.pop(key).client)

    def _is_over(self, question: _Question) -> bool:
        kind = question.kind
        if question.future is None and question.client.service_is_ready:
            request = GetTypeDescription.Request(kind.type, kind.type_hash, False)
            question.future = question.client.call_async(request)
        if question.future is not None and question.future.done:
            self._texts.update(_read(kind, question.future))
            return True
        return kind in self._texts or time.monotonic() > question.until_s


def _is_known(kind: Kind) -> bool:
    try:
        return types.rihs01(kind.type) == kind.type_hash
    except BridgeError:
        return False


def _read(kind: Kind, future: Future) -> Iterator[tuple[Kind, str]]:
    """Yield the definition in an answer, nothing if it has none that fits."""
    if future.error is not None or not future.result.successful:
        return
    try:
        name, fields = type_description.read(future.result.type_description, kind.type_hash)
    except BridgeError:
        return
    if name == kind.type:
        yield kind, definitions.text_of(name, fields)
