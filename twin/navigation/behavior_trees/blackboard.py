"""The blackboard: values by name that the nodes of a tree share (BehaviorTree.CPP, blackboard.cpp)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class Blackboard:
    """Entries of one tree; a subtree has its own, of which some are those of its parent."""

    def __init__(
        self,
        parent: Blackboard | None = None,
        remapping: Mapping[str, str] | None = None,
        *,
        autoremap: bool = False,
    ) -> None:
        """Make a blackboard.

        Args:
            parent: That of the tree around; None for the main tree's.
            remapping: Own name -> the parent's name of the same entry.
            autoremap: Whether every other entry is the parent's of the same name; those that begin with `_`
                stay private.
        """
        self._parent = parent
        self._remapping = dict(remapping or {})
        self._autoremap = autoremap
        self._entries: dict[str, Any] = {}

    @property
    def root(self) -> Blackboard:
        """The main tree's blackboard."""
        return self if self._parent is None else self._parent.root

    def get(self, key: str, default: Any = None) -> Any:
        """Return an entry; `@key` is that of the main tree's blackboard."""
        board, name = self._home(key)
        return board._entries.get(name, default)

    def set(self, key: str, value: Any) -> None:
        """Set an entry."""
        board, name = self._home(key)
        board._entries[name] = value

    def keep(self, key: str, value: Any) -> None:
        """Set an entry of this blackboard whatever is remapped: a constant that was given to a subtree."""
        self._remapping.pop(key, None)
        self._entries[key] = value

    def unset(self, key: str) -> None:
        """Remove an entry, if there is one."""
        board, name = self._home(key)
        board._entries.pop(name, None)

    def _home(self, key: str) -> tuple[Blackboard, str]:
        """Return the blackboard that holds an entry, and its name there."""
        if key.startswith("@"):
            return self.root, key[1:]
        if self._parent is None:
            return self, key
        if key in self._remapping:
            return self._parent._home(self._remapping[key])
        if key not in self._entries and self._autoremap and not key.startswith("_"):
            return self._parent._home(key)
        return self, key
