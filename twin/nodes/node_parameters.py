"""A node's frozen config as ROS parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

from twin.bridge.msgs import FloatingPointRange, IntegerRange, ParameterDescriptor
from twin.bridge.node import Node
from twin.bridge.parameters.values import Parameter
from twin.bridge.types.default_values import new
from twin.errors import BridgeError
from twin.parameters import ReadOnly
from twin.parameters.declaration import Declaration
from twin.parameters.placed import overlay, parameters_of

C = TypeVar("C")


def declare_config(node: Node, config: C, replace: Callable[[C], None] | None = None) -> None:
    """Declare the parameters of a config as those of a node, in one parameter event.

    Args:
        node: Whose parameters.
        config: A frozen dataclass.
        replace: Takes the changed config; without it the parameters are read-only.
    """
    current = config
    found = {name: one for name, one in parameters_of(config).items() if not one.is_nested}
    node.declare_together(
        [
            (name, one.told(config), descriptor_of(one.declaration, read_only=replace is None))
            for name, one in found.items()
        ],
        lambda name: found[name].declaration.text,
    )
    if replace is None:
        return
    apply = replace

    def changed(parameters: list[Parameter]) -> tuple[C, dict[str, str]]:
        return overlay(current, {one.name: one.value for one in parameters})

    def on_set(parameters: list[Parameter]) -> None:
        _, refused = changed(parameters)
        if refused:
            raise BridgeError("; ".join(refused.values()))

    def post_set(parameters: list[Parameter]) -> None:
        nonlocal current
        if any(parameter.name in found for parameter in parameters):
            current, _ = changed(parameters)
            apply(current)

    node.add_on_set_parameters_callback(on_set)
    node.add_post_set_parameters_callback(post_set)


def descriptor_of(declaration: Declaration, *, read_only: bool = False) -> ParameterDescriptor:
    """Return what `ros2 param describe` tells, but for the text; words say more than ranges, whose edges are
    always valid.
    """
    domain = declaration.domain
    assert domain is not None
    read_only = read_only or ReadOnly in declaration.markers
    descriptor = new(ParameterDescriptor, additional_constraints=domain.said, read_only=read_only)
    least, most = domain.bounds.least, domain.bounds.most
    if least is None and most is None:
        return descriptor
    if domain.kind is int:
        low, high = (-(2**63) if least is None else least), (2**63 - 1 if most is None else most)
        descriptor.integer_range = [IntegerRange(math.ceil(low), math.floor(high), 0)]
    else:
        size = math.inf if domain.may_be_infinite else domain.sizes[1]
        low, high = (-size if least is None else least), (size if most is None else most)
        descriptor.floating_point_range = [FloatingPointRange(float(low), float(high), 0.0)]
    return descriptor
