"""ROS 2 names: what is valid, how a node's names become absolute, how they are remapped.

Rules: design.ros2.org/articles/topic_and_service_names.html and static_remapping.html, as rcl applies them
(validate_topic_name.c, expand_topic_name.c, remap.c).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from twin.errors import BridgeError

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NODE = re.compile(_TOKEN)
_NAMESPACE = re.compile(rf"(/{_TOKEN})*")
_SUBSTITUTION = re.compile(r"\{([^{}]*)\}")
_MAX_NAME, _MAX_NODE = 247, 255  # rmw/validate_full_topic_name.h, validate_node_name.h

_FORM = "valid: tokens of letters, digits and _, separated by /, optionally after / or ~/"

_RULES = (
    (re.compile(r""), "it must not be empty"),
    (re.compile(r".*/"), "it must not end with /"),
    (re.compile(r".*//.*"), "it must not contain //"),
    (re.compile(r".+~.*"), "~ may only be the first character"),
    (re.compile(r"~[^/].*"), "~ must be followed by /"),
    (re.compile(r"(?![^{}]*(\{[^{}]*\}[^{}]*)*$).*"), "every { needs its }, and none inside of another"),
    (
        re.compile(r".*\{(?!node\}|ns\}|namespace\}).*"),
        "it may substitute {node}, {ns} and {namespace}, nothing else",
    ),
    (re.compile(r".*[^A-Za-z0-9_/~{}].*", re.DOTALL), "it may contain letters, digits, _, / and ~ only"),
    (re.compile(r"(.*/)?[0-9].*"), "no token may start with a digit"),
)
"""What a broken name looks like, and the rule that it breaks; the first one that fits is told."""


def node_name(name: str) -> str:
    """Return a node's name.

    Raises:
        BridgeError: not a valid name.
    """
    if not _NODE.fullmatch(name) or len(name) > _MAX_NODE:
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

    `{node}` is the node's name, `{ns}` and `{namespace}` its namespace.

    Raises:
        BridgeError: not a valid topic, service or action name; says which rule it breaks.
    """
    for broken, rule in _RULES:
        if broken.fullmatch(name):
            raise _refused(name, node, rule)
    prefix = node_namespace.rstrip("/")
    values = {"node": node, "ns": prefix or "/", "namespace": prefix or "/"}
    full = f"{prefix}/{node}{name[1:]}" if name.startswith("~") else name
    full = _SUBSTITUTION.sub(lambda match: values[match[1]], full)
    full = full if full.startswith("/") else f"{prefix}/{full}"
    if "//" in full:
        raise _refused(name, node, f"it becomes {full}, with //")
    if len(full) > _MAX_NAME:
        raise _refused(name, node, f"it may have {_MAX_NAME} characters")
    return full


def _refused(name: str, node: str, rule: str) -> BridgeError:
    return BridgeError(f"{name!r} is not a topic, service or action name (node {node}): {rule}; {_FORM}")


@dataclass(frozen=True)
class RemapRule:
    """A rule as on a command line: `from:=to`, `node:from:=to`, `__node:=name`, `__ns:=/namespace`."""

    match: str
    """The name to replace; '__node' or '__ns'."""
    replacement: str
    node: str = ""
    """The only node that it is for, by name without namespace; empty for all."""

    @classmethod
    def parse(cls, text: str) -> RemapRule:
        """Return the rule that a text is.

        Raises:
            BridgeError: no rule.
        """
        left, found, replacement = text.partition(":=")
        scheme = re.match(r"ros(topic|service)://", left)
        node, _, match = left.rpartition(":") if scheme is None else ("", "", left[scheme.end() :])
        match = {"__name": "__node"}.get(match, match)
        if not (found and match and replacement) or (node and not _NODE.fullmatch(node)):
            raise BridgeError(
                f"{text!r} is no remapping; valid: from:=to, node:from:=to, __node:=name, __ns:=/namespace"
            )
        if match == "__node":
            node_name(replacement)
        elif match == "__ns":
            namespace(replacement)
        return cls(match, replacement, node)


def renamed(name: str, node_namespace: str, rules: Iterable[RemapRule]) -> tuple[str, str]:
    """Return a node's name and namespace after `__node` and `__ns`; the first rule that fits counts."""
    mine = [rule for rule in rules if rule.node in ("", name)]
    new_name = next((rule.replacement for rule in mine if rule.match == "__node"), name)
    new_namespace = next((rule.replacement for rule in mine if rule.match == "__ns"), node_namespace)
    return new_name, new_namespace


class Resolver:
    """A node's names: expands and remaps them."""

    def __init__(
        self,
        node_namespace: str,
        node: str,
        remappings: Mapping[str, str],
        rules: Iterable[RemapRule] = (),
    ) -> None:
        self._namespace = node_namespace
        self._node = node
        own = [RemapRule(*pair) for pair in remappings.items()]
        self._remapped: dict[str, str] = {}
        for rule in (*own, *rules):
            if rule.match not in ("__node", "__ns") and rule.node in ("", node):
                self._remapped.setdefault(self._expand(rule.match), self._expand(rule.replacement))

    def resolve(self, name: str) -> str:
        """Return the absolute, remapped name.

        Raises:
            BridgeError: not a valid name.
        """
        full = self._expand(name)
        return self._remapped.get(full, full)

    def _expand(self, name: str) -> str:
        return expand(name, self._namespace, self._node)
