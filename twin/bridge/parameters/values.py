"""A parameter's types and values, and their form as messages (rcl_interfaces)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from twin.bridge.msgs import Parameter as ParameterMsg
from twin.bridge.msgs import ParameterValue
from twin.bridge.types.default_values import new
from twin.errors import BridgeError

_INT64 = range(-(2**63), 2**63)


class Type(Enum):
    """rcl_interfaces/msg/ParameterType."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9

    @property
    def is_array(self) -> bool:
        """Whether values are lists."""
        return self.value >= Type.BYTE_ARRAY.value


_FIELDS = {kind: f"{kind.name.lower()}_value" for kind in Type}
"""Of ParameterValue: bool_value ... string_array_value."""
_DTYPES = {
    Type.BYTE_ARRAY: np.uint8,
    Type.BOOL_ARRAY: np.bool_,
    Type.INTEGER_ARRAY: np.int64,
    Type.DOUBLE_ARRAY: np.float64,
}
# In rclpy's order, in which an empty list is a byte array.
_ARRAYS = {
    bytes: Type.BYTE_ARRAY,
    bool: Type.BOOL_ARRAY,
    int: Type.INTEGER_ARRAY,
    float: Type.DOUBLE_ARRAY,
    str: Type.STRING_ARRAY,
}
_SCALARS = {bool: Type.BOOL, int: Type.INTEGER, float: Type.DOUBLE, str: Type.STRING}


def typed(name: str, value: Any) -> tuple[Type, Any]:
    """Return a value's type, as rclpy infers it, and the value in its plain form.

    An empty list is a byte array, as in rclpy; numbers of numpy become Python's.

    Raises:
        BridgeError: no parameter can have this value.
    """
    if value is None:
        return Type.NOT_SET, None
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, bytes | bytearray):
        value = [bytes([byte]) for byte in value]
    for cls, kind in _SCALARS.items():
        if isinstance(value, cls):
            return kind, _in_range(name, cls(value))
    if isinstance(value, list | tuple):
        for cls, kind in _ARRAYS.items():
            if all(isinstance(item, cls) and (isinstance(item, bool) <= (cls is bool)) for item in value):
                return kind, [_in_range(name, cls(item)) for item in value]
    raise BridgeError(
        f"the parameter {name} cannot be {value!r}; valid: bool, int, float, str, "
        "or a list of one of them, or bytes"
    )


def coerced(value: Any, kind: Type) -> Any:
    """Return a value written by a person in the form of a type: 1 for a double is 1.0, [] fits each array."""
    if kind is Type.DOUBLE and type(value) is int:
        return float(value)
    if kind is Type.DOUBLE_ARRAY and isinstance(value, list | tuple):
        return [float(item) if type(item) is int else item for item in value]
    return value


_Type = Type


@dataclass(frozen=True)
class Parameter:
    """A name with a value: `Parameter("rate", value=5.0)`, `Parameter("gains", Type.DOUBLE_ARRAY, [])`.

    `Parameter("rate")` has no value: to set it undeclares the parameter, as in rclpy.
    """

    name: str
    type_: _Type | None = None
    """Inferred from the value if left out."""
    value: Any = None
    """None, bool, int, float, str, or a list of one of them or of single bytes."""

    Type = Type

    def __post_init__(self) -> None:
        """Settle the type.

        Raises:
            BridgeError: type and value do not agree, or no parameter can have this value.
        """
        kind, value = typed(self.name, self.value)
        wanted = self.type_
        if wanted is not None and wanted.is_array and value == [] and kind.is_array:
            kind = wanted
        if wanted not in (None, kind):
            raise BridgeError(
                f"the parameter {self.name} is said to be {_words(wanted)}, {value!r} is {_words(kind)}"
            )
        object.__setattr__(self, "type_", kind)
        object.__setattr__(self, "value", value)

    @property
    def kind(self) -> _Type:
        """The type."""
        assert self.type_ is not None
        return self.type_

    def get_parameter_value(self) -> ParameterValue:
        """Return the value as a message."""
        kind, value = self.kind, self.value
        if kind is Type.NOT_SET:
            return new(ParameterValue)
        if kind is Type.BYTE_ARRAY:
            value = np.frombuffer(b"".join(value), np.uint8)
        elif kind in _DTYPES:
            value = np.array(value, _DTYPES[kind])
        return new(ParameterValue, type=kind.value, **{_FIELDS[kind]: value})

    def to_parameter_msg(self) -> ParameterMsg:
        """Return name and value as a message."""
        return ParameterMsg(self.name, self.get_parameter_value())

    @staticmethod
    def from_parameter_msg(message: ParameterMsg) -> Parameter:
        """Return what a message says.

        Raises:
            BridgeError: a type that does not exist.
        """
        value = value_to_python(message.value, message.name)
        return Parameter(message.name, Type(message.value.type), value)


def value_to_python(message: ParameterValue, name: str = "") -> Any:
    """Return a message's value; None if it is not set (rclpy's parameter_value_to_python).

    Raises:
        BridgeError: a type that does not exist.
    """
    if message.type not in Type._value2member_map_:
        raise BridgeError(f"the parameter {name} has the type {message.type}; valid is 0 to 9")
    kind = Type(message.type)
    if kind is Type.NOT_SET:
        return None
    value = getattr(message, _FIELDS[kind])
    if kind is Type.BYTE_ARRAY:
        return [bytes([byte]) for byte in value.astype(np.uint8)]  # int8 when received
    return value.tolist() if isinstance(value, np.ndarray) else value


def _in_range(name: str, value: Any) -> Any:
    if type(value) is int and value not in _INT64:
        raise BridgeError(f"the parameter {name} cannot be {value}; an integer has 64 bits")
    if isinstance(value, bytes) and len(value) != 1:
        raise BridgeError(f"the parameter {name} is a byte array; its items are single bytes, not {value!r}")
    return value


def _words(kind: Type | None) -> str:
    return "nothing" if kind is None else kind.name.lower()
