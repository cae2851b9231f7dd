"""Which type a topic has, and what to do if it is not known here: ask the node that uses it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.wire.naming import HUMBLE_HASH
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo
    from twin.bridge.live import LiveBus
    from twin.bridge.node import Node

_TIMEOUT_S = 3.0
_UNTOLD = ("", HUMBLE_HASH)
"""What stands for a hash where a wire knows none."""


def message_class(process: LiveBus, node: Node, endpoints: Sequence[EndpointInfo]) -> type[Any]:
    """Return the class of what endpoints of one topic exchange; an unknown type is learnt from their nodes.

    Args:
        process: what the node runs in; it spins while a node is asked.
        node: asks.
        endpoints: of one topic, those whose definition matters first.

    Raises:
        BridgeError: several types, an unknown one that no node tells, or one that is known here with another
            definition.
    """
    name, typename = endpoints[0].name, endpoints[0].type
    found = sorted({endpoint.type for endpoint in endpoints})
    if len(found) > 1:
        raise BridgeError(
            f"Cannot echo topic '{name}', as it contains more than one type: [{', '.join(found)}]"
        )
    if not is_known(typename):
        learn_type(process, node, endpoints)
    cls = types.get(typename)
    ours, theirs = types.rihs01(typename), endpoints[0].type_hash
    if not same_hash(ours, theirs):
        raise BridgeError(
            f"{name}: {endpoints[0].node.full_name} has another definition of {typename} "
            f"({theirs}) than is known here ({ours}); give its files with --interfaces DIR"
        )
    return cls


def hash_of(endpoint: EndpointInfo) -> str:
    """Return the hash with which an endpoint's type is sent, also if Humble or a bridge does not tell it."""
    if endpoint.type_hash not in _UNTOLD:
        return endpoint.type_hash
    return types.rihs01(endpoint.type) if is_known(endpoint.type) else HUMBLE_HASH


def same_hash(one: str, other: str) -> bool:
    """Return whether two hashes may be those of one definition: who tells none may mean any."""
    return one == other or one in _UNTOLD or other in _UNTOLD


def is_known(typename: str) -> bool:
    """Return whether a type's definition is known here."""
    try:
        types.get(typename)
    except BridgeError:
        return False
    return True


def learn_type(process: LiveBus, node: Node, endpoints: Sequence[EndpointInfo]) -> None:
    """Ask the nodes of endpoints of one type for it, one by one (`~/get_type_description`, REP-2016).

    Raises:
        BridgeError: no node tells it.
    """
    reasons = []
    for endpoint in endpoints:
        reason = _ask(process, node, endpoint)
        if reason is None:
            return
        reasons.append(reason)
    raise BridgeError(
        f"the type {endpoints[0].type} of {endpoints[0].name} is not known here, and its nodes do not tell "
        f"it ({'; '.join(dict.fromkeys(reasons))}); give its files with --interfaces DIR"
    )


def _ask(process: LiveBus, node: Node, endpoint: EndpointInfo) -> str | None:
    """Learn an endpoint's type from its node; return why that was not possible."""
    from twin.bridge.types import description as type_description

    owner = endpoint.node.full_name
    service = types.ServiceType("type_description_interfaces/srv/GetTypeDescription")
    client = node.create_client(service, f"{owner}/get_type_description")
    process.spin(lambda: client.service_is_ready, timeout_s=0.5)
    future = client.call_async(
        service.Request(type_name=endpoint.type, type_hash=endpoint.type_hash, include_type_sources=False)
    )
    process.spin(lambda: future.done, timeout_s=_TIMEOUT_S)
    if not future.done:
        return f"{owner} does not answer"
    if future.error is not None:
        return f"{owner} has no service get_type_description"
    if not future.result.successful:
        return f"{owner}: {future.result.failure_reason}"
    type_description.learn(future.result.type_description, endpoint.type_hash)
    return None
