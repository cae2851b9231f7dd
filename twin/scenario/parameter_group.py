"""Overrides of parameters in a scenario: groups of keys, made from the configs that declare them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

from pydantic import Field, create_model

from twin.errors import ScenarioError
from twin.parameters import Derived
from twin.parameters import NameOrPath as IsNameOrPath
from twin.parameters.declaration import Declaration, fields_of
from twin.parameters.placed import overridden
from twin.scenario.fields import NameOrPath
from twin.strict_yaml import StrictModel

C = TypeVar("C")
G = TypeVar("G", bound="ParameterGroup")


class ParameterGroup(StrictModel):
    """Parameters of one node; a key that is absent keeps the node's default."""

    configs: ClassVar[tuple[type, ...]] = ()
    """Whose fields are keys of this group."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    def overrides(self) -> dict[str, Any]:
        """Return only the parameters that the file gives, by name; those of a group inside as a mapping."""
        given = {
            name: getattr(self, name) for name in type(self).model_fields if name in self.model_fields_set
        }
        return {
            name: value.overrides() if isinstance(value, ParameterGroup) else value
            for name, value in given.items()
        }

    def over(self, config: C) -> C:
        """Return a config with those of the given parameters that are its own.

        Raises:
            ScenarioError: they cannot be together.
        """
        try:
            return overridden(config, self.overrides())
        except ValueError as error:
            raise ScenarioError(str(error)) from error


def keys_of(*configs: type, whole: bool = False) -> Callable[[type[G]], type[G]]:
    """Return a decorator that gives a group an optional key for every parameter of some configs.

    Args:
        configs: What the keys are of.
        whole: Whether the group is all that a config is made of: its defaults are that one's.
    """

    def decorate(group: type[G]) -> type[G]:
        keys: dict[str, Any] = {}
        for config in configs:
            for declaration in _keyed(config):
                key = _key(declaration, whole=whole)
                if key is not None and declaration.name not in group.model_fields:
                    keys[declaration.name] = key
        made = create_model(
            group.__name__, __base__=group, __module__=group.__module__, __doc__=group.__doc__, **keys
        )
        made.__qualname__ = group.__qualname__
        made.configs = (*group.configs, *configs)
        return made

    return decorate


@cache
def group_of(config: type) -> type[ParameterGroup]:
    """Return the group of a config that needs no other keys than its own."""
    name = f"{config.__name__.removesuffix('Config')}Parameters"
    body = {"__doc__": config.__doc__, "__module__": config.__module__}
    return keys_of(config)(type(name, (ParameterGroup,), body))


def _keyed(config: type) -> Iterator[Declaration]:
    """Yield the fields of a config that scenarios have keys for, and those of configs without a section."""
    for declaration in fields_of(config).values():
        if declaration.config is not None and not declaration.name:
            yield from _keyed(declaration.config)
        elif Derived not in declaration.markers:
            yield declaration


def _key(declaration: Declaration, *, whole: bool = False) -> tuple[Any, Any] | None:
    """Return the type of a key, and what a schema says of it."""
    if declaration.config is not None:
        inner = group_of(declaration.config)
        return (inner, Field(default=inner(), description=declaration.text)) if inner.model_fields else None
    domain = declaration.domain
    if domain is None:
        return None
    kind: Any = NameOrPath if IsNameOrPath in declaration.markers else Annotated[domain.annotation, domain]
    if whole and declaration.is_required:
        return kind, Field(description=declaration.text)
    if whole:
        return kind, Field(default=declaration.tell(declaration.default), description=declaration.text)
    return kind | None, Field(default=None, description=declaration.text)
