"""Where scenario files name plugins: found when the file is read, executed when a run is made of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar, TypeVar, get_type_hints

from pydantic import (
    AfterValidator,
    ConfigDict,
    GetJsonSchemaHandler,
    ValidationInfo,
    create_model,
    model_validator,
)
from pydantic_core import CoreSchema

from twin.errors import PluginError
from twin.parameters.texts import texts_of
from twin.plugins import Kind, Plugin
from twin.scenario.fields import OneOf
from twin.strict_yaml import Fault, Faults, Loc, StrictModel, findings
from twin.strict_yaml.later import later

K = TypeVar("K", bound="OneOfKind")


class PluginUse(StrictModel):
    """A plugin that a scenario names, with its parameters as they stand there."""

    reference: str
    """Name, `module:Class` or `path/FILE.py:Class`."""
    params: Mapping[str, Any] = {}

    def config(self, plugin: Plugin[Any]) -> Any:
        """Return the plugin's own config; runs its file.

        Raises:
            PluginError: a parameter is wrong.
        """
        try:
            return configured(plugin, self.params)
        except Faults as wrong:
            errors = [plugin.error(f"has a wrong parameter: {fault.message}") for fault in wrong.faults]
            raise PluginError([error.problems[0] for error in errors]) from None


def reference(kind: Kind[Any]) -> AfterValidator:
    """Return the validator of a plugin's name; a path becomes one that starts at the file's folder."""

    def validate(text: str, info: ValidationInfo) -> str:
        full, plugin = located(kind, text, info)
        if (info.context or {}).get("execute"):
            plugin.load()
        return full

    return AfterValidator(validate)


def located(kind: Kind[Any], text: str, info: ValidationInfo, at: Loc = ()) -> tuple[str, Plugin[Any]]:
    """Return a name that holds everywhere and its plugin; runs nothing of it. Raises Faults."""
    folder = (info.context or {}).get("folder", Path())
    source, _, attribute = text.rpartition(":")
    try:
        return f"{folder / source}:{attribute}" if source.endswith(".py") else text, kind.find(text, folder)
    except PluginError as wrong:
        raise Faults([Fault(at, str(problem)) for problem in wrong.problems]) from None


def use(kind: Kind[Any], text: str, params: Any, info: ValidationInfo, *, named_at: Loc = ()) -> PluginUse:
    """Return the use of a plugin; its parameters are checked if the run is made: `info.context["execute"]`.

    Raises:
        Faults: there is no such plugin, or a parameter is wrong.
        PluginError: it was executed, and is wrong itself.
    """
    full, plugin = located(kind, text, info, named_at)
    params = {} if params is None else params
    if not isinstance(params, Mapping):
        raise Faults([Fault((), f"the parameters of {plugin.title} must be a mapping (key: value)")])
    if (info.context or {}).get("execute"):
        configured(plugin, params)
    return PluginUse(reference=full, params=params)


def configured(plugin: Plugin[Any], params: Mapping[str, Any]) -> Any:
    """Return a plugin's `Config` with the given values; None if it has none. Raises Faults."""
    config = plugin.config
    if config is None:
        if params:
            raise Faults([Fault((key,), f"{plugin.title} takes no parameters") for key in params])
        return None
    if issubclass(config, StrictModel):
        schema = config
    elif dataclasses.is_dataclass(config):
        schema = _schema(config)
    else:
        raise plugin.error("has a Config that is no dataclass")
    model, found = findings(schema, dict(params), {})
    if model is None:
        raise Faults([Fault(finding.loc, finding.message) for finding in found])
    if schema is config:
        return model
    try:
        return config(**_given(model))
    except ValueError as wrong:  # of its own __post_init__
        raise Faults([Fault((), f"{plugin.title}: {wrong}")]) from None


def _given(model: StrictModel) -> dict[str, Any]:
    return {name: getattr(model, name) for name in model.model_fields_set}


def _schema(config: type) -> type[StrictModel]:
    """Return the schema of a frozen dataclass: units and bounds are in its annotations."""
    hints = get_type_hints(config, include_extras=True)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(config):
        if field.init:
            default = field.default if field.default_factory is dataclasses.MISSING else None
            fields[field.name] = (hints[field.name], ... if default is dataclasses.MISSING else default)
    made = create_model(config.__name__, __base__=_OfDataclass, __doc__=config.__doc__, **fields)
    made.config = config
    return made


class _OfDataclass(StrictModel):
    """The schema of a frozen dataclass."""

    config: ClassVar[type]

    @classmethod
    def _descriptions(cls) -> Mapping[str, str]:
        """Return what is told of the keys, below the dataclass's fields."""
        return texts_of(cls.config)


class OneOfKind(OneOf):
    """A mapping with exactly one key: the name of something that ships, or of a user's plugin."""

    model_config = ConfigDict(extra="allow")
    of: ClassVar[Kind[Any]]

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        reference = super().__get_pydantic_json_schema__(core, handler)
        schema = handler.resolve_ref_schema(reference)
        for name, model in _shipped(cls.of).items():
            summary = (model().__doc__ or "").partition("\n\n")[0].replace("\n", " ")
            schema["properties"][name].setdefault("description", summary)
            if getattr(model(), "takes_text", False):
                schema["properties"][name]["anyOf"].append({"type": "string"})
        params = {"type": ["object", "null"]}
        for name in cls.of.names():
            schema["properties"].setdefault(name, params)
        schema |= {"patternProperties": {":": params}, "additionalProperties": False}
        return reference

    @model_validator(mode="before")
    @classmethod
    def _user_plugins(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, Mapping):
            return data
        faults: list[Fault] = []
        found: dict[str, Any] = {}
        for key, value in data.items():
            found[key] = value
            if ":" not in key and key not in cls.of.shipped and key not in cls.of.names():
                faults.append(Fault((key,), "", cls.of.names()))
            elif key not in cls.model_fields:
                try:
                    found[key] = use(cls.of, key, value, info)
                except Faults as wrong:
                    faults += [Fault((key, *fault.loc), fault.message) for fault in wrong.faults]
        if faults:
            raise Faults(faults)
        return found

    def resolved(self) -> tuple[Plugin[Any], Any]:
        """Return the plugin and an object of its `Config`; runs the file of a user's."""
        given = self.config
        plugin = self.of.find(given.reference if isinstance(given, PluginUse) else self.kind)
        if isinstance(given, PluginUse):
            return plugin, given.config(plugin)
        config = plugin.config
        assert config is not None
        return plugin, given if isinstance(given, config) else config(**_given(given))


def with_shipped(base: type[K]) -> type[K]:
    """Return a `OneOfKind` with a key for each thing that ships, beside any other name."""
    fields: dict[str, Any] = {name: (later(model) | None, None) for name, model in _shipped(base.of).items()}
    return create_model(base.__name__, __base__=base, __doc__=base.__doc__, **fields)


def _shipped(kind: Kind[Any]) -> dict[str, Callable[[], type[StrictModel]]]:
    """Return what makes the model of each thing that ships, by name."""
    return {name: partial(_model_of, kind, name) for name in kind.shipped}


@cache
def _model_of(kind: Kind[Any], shipped: str) -> type[StrictModel]:
    config = kind.find(shipped).config
    assert config is not None
    return config if issubclass(config, StrictModel) else _schema(config)
