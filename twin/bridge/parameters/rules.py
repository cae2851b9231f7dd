"""What rclpy's Node decides about parameters, in its words.

Which ones a prefix and a depth choose (list_parameters), and whether a value agrees with a descriptor
(_apply_descriptor).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Sequence

from twin.bridge.msgs import FloatingPointRange, IntegerRange, ListParametersResult, ParameterDescriptor
from twin.bridge.parameters.values import Parameter, Type

SEPARATOR = "."
DEPTH_RECURSIVE = 0
"""rcl_interfaces/srv/ListParameters: as deep as there are names."""


def listed(names: Iterable[str], prefixes: Sequence[str], depth: int) -> ListParametersResult:
    """Return the names that are or are below one of the prefixes, and what they are below of.

    Args:
        names: All there are, parts separated by dots.
        prefixes: None of them means all names.
        depth: How many parts a name may have, after its prefix; 0: any number.
    """

    def wanted(name: str) -> bool:
        if not prefixes:
            return _deep_enough(name, depth)
        return any(
            name == prefix
            or (name.startswith(prefix + SEPARATOR) and _deep_enough(name[len(prefix) + 1 :], depth))
            for prefix in prefixes
        )

    chosen = [name for name in names if wanted(name)]
    parents = dict.fromkeys(name.rpartition(SEPARATOR)[0] for name in chosen if SEPARATOR in name)
    return ListParametersResult(chosen, list(parents))


def _deep_enough(name: str, depth: int) -> bool:
    return depth == DEPTH_RECURSIVE or name.count(SEPARATOR) < depth


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
