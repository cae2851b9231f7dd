"""Whether a value agrees with a parameter's descriptor, in rclpy's words (Node._apply_descriptor)."""

from __future__ import annotations

import math
import operator

from twin.bridge.msgs import FloatingPointRange, IntegerRange, ParameterDescriptor
from twin.bridge.parameters.values import Parameter, Type

_RELATIVE_TOLERANCE = 1e-6  # rclpy's Node.PARAM_REL_TOL


def objection(
    parameter: Parameter, descriptor: ParameterDescriptor, *, declared: bool, check_read_only: bool
) -> str:
    """Return why a parameter cannot have this value; empty if it can.

    Args:
        parameter: The new value.
        descriptor: Of the parameter; its type is looked at only without dynamic typing.
        declared: Whether the parameter exists already.
        check_read_only: Not when it is just being declared.
    """
    name, kind = parameter.name, parameter.kind
    if check_read_only and descriptor.read_only:
        return f"Trying to set a read-only parameter: {name}."
    if not descriptor.dynamic_typing:
        if kind is Type.NOT_SET:
            return "Static parameter cannot be undeclared" if declared else ""
        if kind.value != descriptor.type:
            return f"Wrong parameter type, expected '{Type(descriptor.type)}' got '{kind}'"
    reason = ""
    if kind is Type.INTEGER and descriptor.integer_range:
        reason = _outside(name, parameter.value, descriptor.integer_range[0])
    elif kind is Type.DOUBLE and descriptor.floating_point_range:
        reason = _outside(name, parameter.value, descriptor.floating_point_range[0])
    # Ranges of ROS have an end on each side, and both are valid; the words may say it better.
    words = descriptor.additional_constraints
    return f"{name} {words}, not {parameter.value!r}" if reason and words else reason


def _outside(name: str, value: float, valid: IntegerRange | FloatingPointRange) -> str:
    low, high = sorted((valid.from_value, valid.to_value))
    step, whole = valid.step, isinstance(value, int)
    same = operator.eq if whole else _near
    if same(value, low) or same(value, high):  # the edges are valid whatever the step
        return ""
    if not low < value < high:
        return f"Parameter {name} out of range{'.' if whole else ''} Min: {low}, Max: {high}, value: {value}"
    if not step:
        return ""
    if (value - low) % step == 0 if whole else _near(low + round((value - low) / step) * step, value):
        return ""
    return (
        f"The parameter value for {name} is not {'a' if whole else 'close enough to a'} valid step. "
        f"Min: {low}, max: {high}, value: {value}, step: {step}"
    )


def _near(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=_RELATIVE_TOLERANCE)
