"""A node's parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from twin.errors import BridgeError, nearest


@dataclass(frozen=True)
class Parameter:
    """A declared parameter."""

    name: str
    value: Any
    """bool, int, float, str, or a list of one of them."""


class Parameters:
    """Declared parameters, started from the values that the node was created with."""

    def __init__(self, node: str, overrides: Mapping[str, Any]) -> None:
        self._node = node
        self._overrides = dict(overrides)
        self._declared: dict[str, Parameter] = {}
        self._on_set: list[Callable[[Parameter], None]] = []

    @property
    def names(self) -> tuple[str, ...]:
        """Declared names, in the order of declaration."""
        return tuple(self._declared)

    def declare(self, name: str, default: Any) -> Parameter:
        """Declare; an override takes the default's place if it is of its type.

        Raises:
            BridgeError: declared before, or an override of another type.
        """
        if name in self._declared:
            raise BridgeError(f"the parameter {name} of {self._node} is declared twice")
        value = self._checked(name, self._overrides[name], default) if name in self._overrides else default
        self._declared[name] = Parameter(name, value)
        return self._declared[name]

    def get(self, name: str) -> Parameter:
        """Return a declared parameter.

        Raises:
            BridgeError: not declared.
        """
        if name not in self._declared:
            raise BridgeError(f"{self._node} has no parameter {name!r}; {nearest(name, self._declared)}")
        return self._declared[name]

    def set(self, name: str, value: Any) -> Parameter:
        """Change a value; a callback may refuse it.

        Raises:
            BridgeError: not declared, another type, or refused.
        """
        old = self.get(name)
        parameter = Parameter(name, self._checked(name, value, old.value))
        for callback in self._on_set:
            callback(parameter)
        self._declared[name] = parameter
        return parameter

    def add_on_set_callback(self, callback: Callable[[Parameter], None]) -> None:
        """Call back before a change; raise BridgeError in it to refuse the change."""
        self._on_set.append(callback)

    def _checked(self, name: str, value: Any, like: Any) -> Any:
        if like is None or type(value) is type(like):
            return value
        if isinstance(like, float) and type(value) is int:
            return float(value)
        if isinstance(like, (list, tuple)) and isinstance(value, (list, tuple)):
            return type(like)(value)
        raise BridgeError(
            f"the parameter {name} of {self._node} is a {type(like).__name__}; "
            f"{value!r} is a {type(value).__name__}"
        )
