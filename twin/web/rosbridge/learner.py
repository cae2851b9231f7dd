"""Types that are not known here, asked of the nodes that use them (`~/get_type_description`, REP-2016)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from twin.bridge import types
from twin.bridge.graph import EndpointInfo
from twin.bridge.node import Node
from twin.bridge.node.services import GetTypeDescription
from twin.bridge.services import Client, Future
from twin.bridge.tools.unknown_types import is_known
from twin.bridge.types import description
from twin.errors import BridgeError

_PATIENCE_S = 3.0
_MOST = 50
"""Nodes asked at a time."""


@dataclass
class _Question:
    endpoint: EndpointInfo
    client: Client
    until_s: float
    future: Future | None = None


class Learner:
    """Asks each node once for each type, without waiting; `update` goes on."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._asked: set[tuple[str, str]] = set()
        self._open: list[_Question] = []

    def ask(self, endpoints: Iterable[EndpointInfo], now_s: float) -> None:
        """Ask for the types of endpoints that are not known here."""
        for endpoint in endpoints:
            key = endpoint.type, endpoint.node.full_name
            if key in self._asked or len(self._open) >= _MOST or is_known(endpoint.type):
                continue
            self._asked.add(key)
            try:
                client = self._node.create_client(GetTypeDescription, f"{key[1]}/get_type_description")
            except BridgeError:
                continue  # no name of a node
            self._open.append(_Question(endpoint, client, now_s + _PATIENCE_S))

    def update(self, now_s: float) -> None:
        """Ask who has become reachable, learn from answers, give up who is late."""
        for question in tuple(self._open):
            if self._is_over(question, now_s):
                self._open.remove(question)
                self._node.destroy_client(question.client)

    def _is_over(self, question: _Question, now_s: float) -> bool:
        endpoint, future = question.endpoint, question.future
        if future is None and question.client.service_is_ready:
            request = GetTypeDescription.Request(endpoint.type, endpoint.type_hash, False)
            question.future = question.client.call_async(request)
        if future is None or not future.done:
            return now_s > question.until_s
        if future.error is None and future.result.successful:
            try:
                description.learn(future.result.type_description, endpoint.type_hash)
            except BridgeError as error:
                self._node.get_logger().warning(f"{endpoint.name}: {error}")
        return True


_ROS_1 = {
    "tf2_web_republisher/": "tf2_web_republisher_interfaces/",
    "rospy_tutorials/AddTwoInts": "example_interfaces/AddTwoInts",
}
"""What types of ROS 1 that clients still ask for are called today; the fields are the same."""


def type_name(given: str, kind: str) -> str:
    """Return package/kind/Name, also for ROS 1's package/Name.

    Raises:
        BridgeError: no name of a type.
    """
    if given.count("/") != 1:
        return types.full_name(given)
    for old, new in _ROS_1.items():
        given = new + given.removeprefix(old) if given.startswith(old) else given
    return types.full_name(given.replace("/", f"/{kind}/"))
