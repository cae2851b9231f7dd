"""The parameters of a config: of its own fields, of configs inside, and of configs by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from functools import reduce
from typing import Any, TypeVar

from twin.parameters.declaration import Declaration, fields_of
from twin.parameters.forms import Itself, Underscored

C = TypeVar("C")


@dataclasses.dataclass(frozen=True)
class Placed:
    """A parameter of one config."""

    name: str
    """Its whole name: 'FollowPath.CostCritic.cost_weight'."""
    path: tuple[str, ...]
    """Fields and keys from the config to the value."""
    declaration: Declaration

    @property
    def is_nested(self) -> bool:
        """Whether it is a list of lists, such as corners, which ROS has no parameters for."""
        domain = self.declaration.domain
        return domain is not None and domain.item is not None and domain.item.item is not None

    def told(self, config: Any) -> Any:
        """Return its value in a config, as others are told it."""
        return self.declaration.tell(reduce(_part, self.path, config))

    def read(self, value: Any) -> Any:
        """Return a told value as configs keep it.

        Raises:
            ValueError: it is none; a sentence that begins with the parameter's name.
        """
        try:
            return self.declaration.read(value)
        except ValueError as error:
            raise ValueError(f"{self.name} {error}") from None


def parameters_of(config: Any) -> dict[str, Placed]:
    """Return the parameters of a config by name; what is None, empty, or an array is none.

    Args:
        config: A frozen dataclass, or several by name.
    """
    return {one.name: one for one in _walk(config, (), "")}


def _walk(config: Any, path: tuple[str, ...], prefix: str, separator: str = ".") -> Iterator[Placed]:
    declared = {} if isinstance(config, Mapping) else fields_of(config)
    for key in config if isinstance(config, Mapping) else declared:
        value, declaration = _part(config, key), declared.get(key)
        here, name = (*path, key), key if declaration is None else declaration.name
        if dataclasses.is_dataclass(value) or isinstance(value, Mapping):
            inner = f"{prefix}{name}{separator}" if name else prefix
            is_joined = declaration is not None and Underscored in declaration.markers
            yield from _walk(value, here, inner, "_" if is_joined else ".")
        elif declaration is not None and declaration.domain is not None and not _is_absent(value):
            whole = prefix[:-1] if Itself in declaration.markers and prefix else prefix + name
            yield Placed(whole, here, declaration)


def _is_absent(value: Any) -> bool:
    """Whether a value is no parameter: what is None or empty, and what was computed in numpy's types."""
    return not value if isinstance(value, tuple) else type(value) not in (bool, int, float, str)


def replaced(config: C, path: tuple[str, ...], value: Any) -> C:
    """Return a config with another value at a path.

    Raises:
        ValueError: the config cannot have it beside its other values.
    """
    head, *rest = path
    inner = replaced(_part(config, head), tuple(rest), value) if rest else value
    if isinstance(config, Mapping):
        return {**config, head: inner}  # type: ignore[return-value]
    return dataclasses.replace(config, **{head: inner})  # type: ignore[type-var]


def overlay(config: C, values: Mapping[str, Any]) -> tuple[C, dict[str, str]]:
    """Return a config with values by parameter name, and why some of them were not taken: whole sentences.

    Args:
        config: A frozen dataclass.
        values: Parameter name -> value; those that the config does not have are left alone.
    """
    found = parameters_of(config)
    refused: dict[str, str] = {}
    left = {name: value for name, value in values.items() if name in found}
    while left:
        refused = {}
        for name, value in left.items():
            try:
                config = replaced(config, found[name].path, found[name].read(value))
            except ValueError as error:
                refused[name] = str(error)
        if len(refused) == len(left):
            break
        # Some are valid only with others: a least number that is above the old greatest one.
        left = {name: left[name] for name in refused}
    return config, refused


def overridden(config: C, given: Mapping[str, Any]) -> C:
    """Return a config with those values that are of fields of its own; mappings go inwards.

    Args:
        config: A frozen dataclass.
        given: Parameter name -> a valid value as others are told it; None: not given.

    Raises:
        ValueError: they cannot be together.
    """
    changes: dict[str, Any] = {}
    for declaration in fields_of(config).values():
        value = given.get(declaration.name)
        inner = getattr(config, declaration.field)
        if not declaration.name and dataclasses.is_dataclass(inner):
            changes[declaration.field] = overridden(inner, given)
        elif isinstance(value, Mapping) and dataclasses.is_dataclass(inner):
            changes[declaration.field] = overridden(inner, value)
        elif value is not None:
            changes[declaration.field] = declaration.kept(value)
    return dataclasses.replace(config, **changes)  # type: ignore[type-var]


def _part(config: Any, name: str) -> Any:
    return config[name] if isinstance(config, Mapping) else getattr(config, name)
