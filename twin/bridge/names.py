"""ROS 2 names: what is valid, how a node's names become absolute, how they are remapped."""

from __future__ import annotations

import re
from collections.abc import Mapping

from twin.errors import BridgeError

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NODE = re.compile(_TOKEN)
_NAMESPACE = re.compile(rf"(/{_TOKEN})*")
_NAME = re.compile(rf"(~/|/)?{_TOKEN}(/{_TOKEN})*")


def node_name(name: str) -> str:
    """Return a node's name.

    Raises:
        BridgeError: not a valid name.
    """
    if not _NODE.fullmatch(name):
        raise BridgeError(
            f"{name!r} is not a node name; valid: letters, digits and _, not starting with a digit"
        )
    return name


def namespace(name: str) -> str:
    """Return a namespace as '/' or '/a/b'; 'a/b', '/a/b/' and '' are accepted.

    Raises:
        BridgeError: not a valid namespace.
    """
    stripped = name.strip("/")
    full = f"/{stripped}" if stripped else ""
    if not _NAMESPACE.fullmatch(full):
        raise BridgeError(
            f"{name!r} is not a namespace; valid: names of letters, digits and _, separated by /"
        )
    return full or "/"


def expand(name: str, node_namespace: str, node: str) -> str:
    """Return the absolute name: '/x' stays, 'x' is in the node's namespace, '~/x' below the node.

    Raises:
        BridgeError: not a valid topic, service or action name.
    """
    if not _NAME.fullmatch(name):
        raise BridgeError(
            f"{name!r} is not a topic, service or action name (node {node}); "
            "valid: tokens of letters, digits and _, separated by /, optionally after / or ~/"
        )
    prefix = node_namespace.rstrip("/")
    if name.startswith("~/"):
        return f"{prefix}/{node}/{name[2:]}"
    return name if name.startswith("/") else f"{prefix}/{name}"


class Resolver:
    """A node's names: expands and remaps them."""

    def __init__(self, node_namespace: str, node: str, remappings: Mapping[str, str]) -> None:
        self._namespace = node_namespace
        self._node = node
        self._remapped = {self._expand(a): self._expand(b) for a, b in remappings.items()}

    def resolve(self, name: str) -> str:
        """Return the absolute, remapped name.

        Raises:
            BridgeError: not a valid name.
        """
        full = self._expand(name)
        return self._remapped.get(full, full)

    def _expand(self, name: str) -> str:
        return expand(name, self._namespace, self._node)
