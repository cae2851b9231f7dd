"""Overrides of parameters in a scenario: groups of keys, made from the configs that declare them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

from pydantic import Field, create_model

from twin.parameters.declaration import fields_of
from twin.scenario.fields import NameOrPath
from twin.strict_yaml import StrictModel

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


def keys_of(*configs: type) -> Callable[[type[G]], type[G]]:
    """Return a decorator that gives a group an optional key for every parameter of some configs."""

    def decorate(group: type[G]) -> type[G]:
        keys: dict[str, Any] = {}
        for config in configs:
            keys |= {name: key for name, key in _keys(config).items() if name not in group.model_fields}
        made = create_model(
            group.__name__, __base__=group, __module__=group.__module__, __doc__=group.__doc__, **keys
        )
        made.__qualname__ = group.__qualname__
        made.configs = (*group.configs, *configs)
        return made

    return decorate


def group_of(config: type) -> type[ParameterGroup]:
    """Return the group of a config that needs no other keys than its own."""
    return _group_of(config)


@cache
def _group_of(config: type) -> type[ParameterGroup]:
    name = f"{config.__name__.removesuffix('Config')}Parameters"
    body = {"__doc__": config.__doc__, "__module__": config.__module__}
    return keys_of(config)(type(name, (ParameterGroup,), body))


def _keys(config: type) -> dict[str, tuple[Any, Any]]:
    """Return type and description of every key; those of a config that is no section are among them."""
    keys: dict[str, tuple[Any, Any]] = {}
    for declaration in fields_of(config).values():
        if declaration.is_derived:
            continue
        if declaration.config is not None and not declaration.name:
            keys |= _keys(declaration.config)
        elif declaration.config is not None:
            inner = group_of(declaration.config)
            field = Field(default=inner(), description=declaration.text)
            keys |= {declaration.name: (inner, field)} if inner.model_fields else {}
        elif declaration.domain is not None:
            domain = declaration.domain
            kind: Any = NameOrPath if declaration.is_path else Annotated[domain.annotation, domain]
            keys[declaration.name] = kind | None, Field(default=None, description=declaration.text)
    return keys
