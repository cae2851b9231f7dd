"""Plugins of navigation in a scenario: the keys of what ships stand side by side, a user's are his own."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import (
    BeforeValidator,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    PrivateAttr,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema

from twin.errors import nearest
from twin.navigation.plugins import bound
from twin.plugins import Kind
from twin.scenario.parameter_group import ParameterGroup
from twin.scenario.plugins import PluginUse, use
from twin.strict_yaml import Fault, Faults

_OTHERS = "additionalProperties"


class PluginGroup(ParameterGroup):
    """Parameters of a plugin, beside those of what runs it."""

    of: ClassVar[Kind[Any]]
    _params: Mapping[str, Any] = PrivateAttr(default_factory=dict)

    @classmethod
    @abstractmethod
    def beside(cls, data: Mapping[str, Any]) -> set[str]:
        """Return the keys that are not a user's plugin's, which has all others."""

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        reference = super().__get_pydantic_json_schema__(core, handler)
        schema = handler.resolve_ref_schema(reference)
        users = {"properties": {"plugin": {"not": {"enum": [*cls.of.shipped]}}}, "required": ["plugin"]}
        known = dict.fromkeys(schema["properties"], True)
        schema |= {"if": users, "else": {"properties": known, "additionalProperties": schema.pop(_OTHERS)}}
        return reference

    @property
    def users(self) -> PluginUse | None:
        """The plugin with its parameters, if it is a user's."""
        name = getattr(self, "plugin", None)
        if name is None or name in self.of.shipped:
            return None
        return PluginUse(reference=name, params=self._params)

    @model_validator(mode="wrap")
    @classmethod
    def _of_a_user(
        cls, data: Any, handler: ModelWrapValidatorHandler[PluginGroup], info: ValidationInfo
    ) -> PluginGroup:
        name = data.get("plugin") if isinstance(data, Mapping) else None
        if not isinstance(name, str) or name in cls.of.shipped:
            return handler(data)
        beside = cls.beside(data)
        params = {key: value for key, value in data.items() if key not in beside}
        used = use(cls.of, name, params, info, named_at=("plugin",))
        made = handler({key: data[key] for key in data if key in beside} | {"plugin": used.reference})
        made._params = used.params
        return made


class PluginListGroup(ParameterGroup):
    """Parameters with a list of plugins; those of a user's stand beside it, by the name of the class."""

    list_of: ClassVar[Kind[Any]]
    list_key: ClassVar[str]
    _listed: Mapping[str, PluginUse] = PrivateAttr(default_factory=dict)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        reference = super().__get_pydantic_json_schema__(core, handler)
        handler.resolve_ref_schema(reference)[_OTHERS] = {"type": "object"}
        return reference

    @classmethod
    def ships(cls, data: Mapping[str, Any]) -> Collection[str] | None:
        """Return what the list may name that ships; None: there is no such list."""
        return cls.list_of.shipped

    @property
    def listed(self) -> Mapping[str, PluginUse]:
        """What a user brings, by the names that the list has for it."""
        return self._listed

    @model_validator(mode="wrap")
    @classmethod
    def _of_a_user_each(
        cls, data: Any, handler: ModelWrapValidatorHandler[PluginListGroup], info: ValidationInfo
    ) -> PluginListGroup:
        names = data.get(cls.list_key) if isinstance(data, Mapping) else None
        ships = cls.ships(data) if isinstance(names, list) else None
        if names is None or ships is None:
            return handler(data)
        found, called, faults = dict[str, PluginUse](), list(names), list[Fault]()
        for i, name in enumerate(names):
            at, kind = (cls.list_key, i), cls.list_of
            if not isinstance(name, str) or name in ships:
                continue
            called[i] = own = name.rpartition(":")[2]
            if own in ships or own in found:
                faults.append(Fault(at, f"two {kind.name}s are called '{own}'; rename one of them"))
            elif ":" not in name and name not in kind.names():
                valid = nearest(name, [*ships, *kind.names()])
                faults.append(Fault(at, f"there is no {kind.name} '{name}'; {valid}"))
            else:
                try:
                    found[own] = use(kind, name, data.get(own), info, named_at=at)
                except Faults as wrong:
                    faults += [
                        Fault(fault.loc if fault.loc == at else (own, *fault.loc), fault.message)
                        for fault in wrong.faults
                    ]
        if faults:
            raise Faults(faults)
        made = handler({key: data[key] for key in data if key not in found} | {cls.list_key: called})
        made._listed = found
        return made


def config_of_use(kind: Kind[Any], used: PluginUse) -> Any:
    """Return the parameters of a user's plugin, by which it is made; runs its file."""
    plugin = kind.find(used.reference)
    return bound(plugin, used.config(plugin))


def plugin_name(kind: Kind[Any], *without: str) -> Any:
    """Return the type of a key that names a plugin, but for some that ship and are asked for otherwise."""
    return Annotated[str, _Names(kind, without)]


def plugin_choice(kind: Kind[Any]) -> Any:
    """Return the type of a key that is a plugin: what ships by name, a user's also with its parameters."""

    def read(data: Any, info: ValidationInfo) -> Any:
        name, params = data, {}
        if isinstance(data, Mapping) and isinstance(data.get("plugin"), str):
            name, params = data["plugin"], {key: data[key] for key in data if key != "plugin"}
        if not isinstance(name, str):
            return data
        if name not in kind.shipped:
            return use(kind, name, params, info, named_at=("plugin",) if name is not data else ())
        if params:
            raise Faults([Fault((next(iter(params)),), f"the parameters of '{name}' stand beside it")])
        return name

    mapping = {"type": "object", "required": ["plugin"], "properties": {"plugin": {"type": "string"}}}
    return Annotated[str | PluginUse, BeforeValidator(read), _Names(kind, further=(mapping,))]


@dataclass(frozen=True, eq=False)
class _Names:
    """What a schema says of a plugin's name; installed packages are looked through when it is asked for."""

    kind: Kind[Any]
    without: tuple[str, ...] = ()
    further: tuple[dict[str, Any], ...] = ()

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        known = [name for name in self.kind.names() if name not in self.without]
        return {"anyOf": [{"enum": known}, {"type": "string", "pattern": ":"}, *self.further]}
