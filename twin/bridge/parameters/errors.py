"""What may be wrong with a parameter: rclpy's exceptions, each one a `BridgeError`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from twin.errors import BridgeError, nearest


class ParameterException(BridgeError):
    """Base of all."""

    reason: str = ""
    """In rclpy's words: what its services answer."""


class ParameterNotDeclaredException(ParameterException):
    """A parameter that the node does not have."""

    def __init__(self, node: str, names: Iterable[str], declared: Iterable[str]) -> None:
        missing = list(names)
        self.reason = f"Invalid access to undeclared parameter(s): {missing}"
        super().__init__(f"{node} has no parameter {missing[0]!r}; {nearest(missing[0], declared)}")


class ParameterAlreadyDeclaredException(ParameterException):
    """A parameter declared twice."""

    def __init__(self, node: str, name: str) -> None:
        self.reason = f"Parameter(s) already declared: {[name]}"
        super().__init__(f"the parameter {name} of {node} is declared twice")


class InvalidParameterException(ParameterException):
    """A name that a parameter cannot have."""

    def __init__(self, node: str, name: str) -> None:
        self.reason = f"Invalid parameter name: {name}"
        super().__init__(f"{name!r} is not a parameter name ({node}); valid: any text that is not empty")


class InvalidParameterTypeException(ParameterException):
    """A value of another type than the parameter's."""

    def __init__(self, node: str, name: str, value: Any, expected: str) -> None:
        self.reason = f"Trying to set parameter '{name}' to '{value}', expecting type '{expected}'"
        super().__init__(
            f"the parameter {name} of {node} is a {expected.lower()}; {value!r} is a {type(value).__name__}"
        )


class InvalidParameterValueException(ParameterException):
    """A value that a range, a constraint or a callback of the node refuses."""

    def __init__(self, node: str, name: str, value: Any, reason: str) -> None:
        self.reason = f"Invalid parameter value ({value}) for parameter. Reason: {reason}: {name}"
        super().__init__(f"the parameter {name} of {node} cannot be {value!r}: {reason}")


class ParameterImmutableException(ParameterException):
    """A read-only parameter was to be changed."""

    def __init__(self, node: str, name: str) -> None:
        self.reason = f"Attempted to modify read-only parameter: {name}"
        super().__init__(f"the parameter {name} of {node} is read-only")


class ParameterUninitializedException(ParameterException):
    """A parameter declared with a type, and without a value so far."""

    def __init__(self, node: str, name: str) -> None:
        self.reason = f"The parameter '{name}' is not initialized: {name}"
        super().__init__(f"the parameter {name} of {node} has no value yet; set it, or give one at the start")
