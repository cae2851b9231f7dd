"""Overrides of parameters in a scenario: groups of keys, made from the configs that declare them."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Self, TypeVar

from pydantic import create_model

from twin.errors import ScenarioError
from twin.parameters import Derived
from twin.parameters import NameOrPath as IsNameOrPath
from twin.parameters.declaration import Declaration, fields_of
from twin.parameters.placed import overridden
from twin.scenario.fields import NameOrPath
from twin.strict_yaml import StrictModel
from twin.strict_yaml.later import later

C = TypeVar("C")
G = TypeVar("G", bound="ParameterGroup")


class ParameterGroup(StrictModel):
    """Parameters of one node; a key that is absent keeps the node's default."""

    configs: ClassVar[tuple[type, ...]] = ()
    """Whose fields are keys of this group, beside those of its bases."""
    declared: ClassVar[Mapping[str, Declaration]] = MappingProxyType({})
    """What those keys are that it has of them, by name."""

    @classmethod
    def _descriptions(cls) -> Mapping[str, str]:
        """Return what is told of the keys."""
        groups = [base for base in cls.__mro__ if issubclass(base, ParameterGroup)]
        declared = ChainMap(*(dict(group.declared) for group in groups))
        return {name: one.text for name, one in declared.items()} | dict(super()._descriptions())

    @classmethod
    def whole(cls) -> type[Self]:
        """Return the group with its keys; see `keys_of`."""
        return _whole(cls)

    def __getattr__(self, name: str) -> Any:
        """Return None for a key of a group that no file has given: its keys were never made."""
        if name[0] != "_" and any(name in key_names(config) for config in _configs(type(self))):
            return None
        return super().__getattr__(name)  # type: ignore[misc]

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


def keys_of(*configs: type, whole: bool = False, later: bool = False) -> Callable[[type[G]], type[G]]:
    """Return a decorator that gives a group an optional key for every parameter of some configs.

    Args:
        configs: What the keys are of.
        whole: Whether the group is all that a config is made of: its defaults are that one's.
        later: Whether the keys are made when a file has the group: where it is one, `Later(group.whole)`
            stands beside it. The group itself is then one that is not given.
    """

    def decorate(group: type[G]) -> type[G]:
        group.configs = configs
        return group if later else _whole(group, all_of_it=whole)

    return decorate


@cache
def _whole(group: type[G], *, all_of_it: bool = False) -> type[G]:
    keys, declared = dict[str, Any](), dict[str, Declaration]()
    for config in _configs(group):
        for declaration in _keyed(config):
            key = _key(declaration, whole=all_of_it)
            if key is not None and declaration.name not in group.model_fields:
                keys[declaration.name] = key
                declared[declaration.name] = declaration
    made = create_model(
        group.__name__, __base__=group, __module__=group.__module__, __doc__=group.__doc__, **keys
    )
    made.__qualname__ = group.__qualname__
    made.declared = MappingProxyType(declared)
    return made


def _configs(group: type[ParameterGroup]) -> Iterator[type]:
    for base in reversed(group.__mro__):
        yield from vars(base).get("configs", ())


@cache
def group_of(config: type) -> type[ParameterGroup]:
    """Return the group of a config that needs no other keys than its own."""
    name = f"{config.__name__.removesuffix('Config')}Parameters"
    body = {"__doc__": config.__doc__, "__module__": config.__module__}
    return keys_of(config)(type(name, (ParameterGroup,), body))


@cache
def key_names(config: type) -> tuple[str, ...]:
    """Return the keys of a config's group, which is not made for that."""
    return tuple(one.name for one in _keyed(config) if _key(one) is not None)


def _keyed(config: type) -> Iterator[Declaration]:
    """Yield the fields of a config that scenarios have keys for, and those of configs without a section."""
    for declaration in fields_of(config).values():
        if declaration.config is not None and not declaration.name:
            yield from _keyed(declaration.config)
        elif Derived not in declaration.markers:
            yield declaration


def _key(declaration: Declaration, *, whole: bool = False) -> tuple[Any, Any] | None:
    """Return the type of a key, and its default."""
    if (config := declaration.config) is not None:
        return (later(partial(group_of, config)), None) if key_names(config) else None
    domain = declaration.domain
    if domain is None:
        return None
    kind: Any = NameOrPath if IsNameOrPath in declaration.markers else Annotated[domain.annotation, domain]
    if whole:
        return kind, ... if declaration.is_required else declaration.tell(declaration.default)
    return kind | None, None
