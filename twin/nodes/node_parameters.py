"""A node's frozen config as ROS parameters."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from functools import reduce
from typing import Any, TypeVar

from twin.bridge.msgs import ParameterDescriptor
from twin.bridge.node import Node
from twin.bridge.parameters.values import Parameter
from twin.bridge.types.default_values import new
from twin.errors import BridgeError, TwinError

C = TypeVar("C")

_NO_NAMES: Mapping[str, str] = {}

_SIGNED = frozenset(
    {
        *("x", "y", "z", "yaw"),
        *("external_detection_translation_x", "external_detection_translation_y"),
        *("external_detection_rotation_yaw", "staging_x_offset", "staging_yaw_offset"),
        *("min_vel_x", "vx_min"),
        *("failure_tolerance", "laser_max_range", "laser_min_range", "random_seed"),
    }
)
"""Parameters that may become negative though they are not: places, speeds backwards, and Nav2's -1."""


@dataclasses.dataclass(frozen=True)
class _Unit:
    """How a field's value is told: a period in nanoseconds as a frequency, other nanoseconds as seconds."""

    name: str
    tell: Callable[[Any], Any] = lambda value: value
    read: Callable[[Any], Any] = lambda value: value


def declare_config(
    node: Node, config: C, replace: Callable[[C], None] | None = None, names: Mapping[str, str] = _NO_NAMES
) -> None:
    """Declare the numbers, texts and lists of a config as parameters of a node, in one parameter event.

    A field is a parameter of its name, `period_ns` is `frequency` [Hz], `timeout_ns` is `timeout` [s]; a
    config in a config gives 'outer.inner', as do configs by name. What is None or an array is left out.

    Args:
        node: Whose parameters.
        config: A frozen dataclass.
        replace: Takes the changed config; without it the parameters are read-only.
        names: Field -> the name that ROS has for it, such as 'controller' -> 'FollowPath'; empty: no level of
            its own.
    """
    current = config
    found = {unit.name: (path, unit, value) for path, unit, value in _fields(config, names)}
    descriptor = new(ParameterDescriptor, read_only=replace is None)
    node.parameters.declare_together(
        [(name, unit.tell(value), descriptor) for name, (_, unit, value) in found.items()]
    )
    if replace is None:
        return
    apply = replace

    def changed(parameters: list[Parameter]) -> C:
        following = current
        for parameter in parameters:
            if parameter.name in found:
                path, unit, _ = found[parameter.name]
                _check(parameter, unit.tell(reduce(_part, path, current)))
                following = _with(following, path, unit.read(parameter.value))
        return following

    def on_set(parameters: list[Parameter]) -> None:
        try:
            changed(parameters)
        except ZeroDivisionError as error:
            raise BridgeError("a frequency must be more than zero") from error
        except ValueError as error:
            raise BridgeError(str(error)) from error

    def post_set(parameters: list[Parameter]) -> None:
        nonlocal current
        if any(parameter.name in found for parameter in parameters):
            current = changed(parameters)
            apply(current)

    node.add_on_set_parameters_callback(on_set)
    node.add_post_set_parameters_callback(post_set)


def _fields(
    config: Any, names: Mapping[str, str], path: tuple[str, ...] = (), prefix: str = ""
) -> Iterator[tuple[tuple[str, ...], _Unit, Any]]:
    keys = config if isinstance(config, Mapping) else [field.name for field in dataclasses.fields(config)]
    for key in keys:
        value = _part(config, key)
        here = (*path, key)
        name = names.get(key, key)
        if dataclasses.is_dataclass(value) or isinstance(value, Mapping):
            yield from _fields(value, names, here, f"{prefix}{name}." if name else prefix)
        elif _is_plain(value):
            yield here, _unit(prefix, name, value), value


def _is_plain(value: Any) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(type(item) is type(value[0]) and _is_plain(item) for item in value)
    return type(value) in (bool, int, float, str)


def _unit(prefix: str, name: str, value: Any) -> _Unit:
    if name.endswith("period_ns"):
        frequency = f"{prefix}{name.removesuffix('period_ns')}frequency"
        return _Unit(frequency, lambda ns: 1e9 / ns, lambda hz: round(1e9 / hz))
    if name.endswith("_ns"):
        return _Unit(f"{prefix}{name.removesuffix('_ns')}", lambda ns: ns * 1e-9, lambda s: round(s * 1e9))
    if isinstance(value, tuple):
        return _Unit(prefix + name, list, tuple)
    return _Unit(prefix + name)


def _check(parameter: Parameter, old: Any) -> None:
    value = parameter.value
    if type(value) not in (int, float):
        return
    if math.isnan(value) or (math.isfinite(old) and not math.isfinite(value)):
        raise BridgeError(f"{parameter.name} must be finite")
    if old >= 0 > value and parameter.name.rpartition(".")[2] not in _SIGNED:
        raise BridgeError(f"{parameter.name} must not be negative")


def _with(config: Any, path: tuple[str, ...], value: Any) -> Any:
    head, *rest = path
    inner = _with(_part(config, head), tuple(rest), value) if rest else value
    if isinstance(config, Mapping):
        return {**config, head: inner}
    return dataclasses.replace(config, **{head: inner})


def overlay(
    config: C, values: Mapping[str, Any], names: Mapping[str, str] = _NO_NAMES
) -> tuple[C, dict[str, str]]:
    """Return a config with values by parameter name, and why some of them were not taken.

    Args:
        config: A frozen dataclass, as for `declare_config`.
        values: Parameter name -> value; those that the config does not have are left alone.
        names: As for `declare_config`.
    """
    found = {unit.name: (path, unit, value) for path, unit, value in _fields(config, names)}
    refused: dict[str, str] = {}
    left = {name: value for name, value in values.items() if name in found}
    while left:
        refused = {}
        for name, value in left.items():
            path, unit, old = found[name]
            try:
                config = _with(config, path, unit.read(_as(value, unit.tell(old))))
            except ZeroDivisionError:
                refused[name] = "must be more than zero"
            except (ValueError, TwinError) as error:
                refused[name] = str(error)
        if len(refused) == len(left):
            break
        # Some are valid only with others: a least number that is above the old greatest one.
        left = {name: left[name] for name in refused}
    return config, refused


def parameter_names(config: Any, names: Mapping[str, str] = _NO_NAMES) -> tuple[str, ...]:
    """Return the names of a config's parameters, as `declare_config` declares them."""
    return tuple(unit.name for _, unit, _ in _fields(config, names))


def _as(value: Any, old: Any) -> Any:
    """Return a value as the type of the one that it replaces; a whole number is a double too."""
    if type(old) is float and type(value) is int:
        return float(value)
    if isinstance(old, list) and isinstance(value, list) and value:
        return [_as(item, old[0]) for item in value]
    if isinstance(old, tuple) and isinstance(value, list):
        return tuple(_as(item, old[0]) for item in value)
    if type(value) is not type(old):
        meant = {
            bool: "true or false",
            int: "a whole number",
            float: "a number",
            str: "a text",
            list: "a list",
            tuple: "a list",
        }
        raise ValueError(f"must be {meant[type(old)]}, not {value!r}")
    return value


def _part(config: Any, name: str) -> Any:
    return config[name] if isinstance(config, Mapping) else getattr(config, name)
