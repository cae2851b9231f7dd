"""The part of a node that is about parameters, in rclpy's words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import ListParametersResult, ParameterDescriptor, SetParametersResult
from twin.bridge.parameters.parameters import OnSet, Parameters, PostSet, PreSet
from twin.bridge.parameters.values import Parameter, Type
from twin.bridge.types.default_values import new

if TYPE_CHECKING:
    from twin.bridge.node import Node


class NodeParameters:
    """Declares, gets and sets parameters; errors are under rclpy's names in `parameter_errors`."""

    _parameters: Parameters

    @property
    def parameters(self) -> Parameters:
        """The declared parameters."""
        return self._parameters

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter; the value given at the node's creation goes before this one.

        Args:
            name: Parts are separated by dots.
            value: Also fixes the type; a `Parameter.Type` declares a parameter without a value.
            descriptor: Description, ranges, read_only, dynamic_typing; `new(ParameterDescriptor, ...)`.
            ignore_override: Whether `value` holds in any case.

        Raises:
            BridgeError: declared twice, or a value that is not valid.
        """
        return self._parameters.declare(name, value, descriptor, ignore_override=ignore_override)

    def declare_parameters(
        self, namespace: str, parameters: Iterable[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare several: tuples of name, value and perhaps a descriptor; names are put below `namespace`.

        Raises:
            BridgeError: as `declare_parameter`; those before stay declared.
        """
        prefix = f"{namespace}." if namespace else ""
        return [
            self._parameters.declare(prefix + name, *rest, ignore_override=ignore_override)
            for name, *rest in parameters
        ]

    def undeclare_parameter(self, name: str) -> None:
        """Forget a parameter.

        Raises:
            BridgeError: not declared, or read-only.
        """
        self._parameters.undeclare(name)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._parameters.names

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter.

        Raises:
            BridgeError: not declared, or without a value so far.
        """
        return self._parameters.get(name)

    def get_parameters(self, parameter_names: Sequence[str]) -> list[Parameter]:
        """Return parameters.

        Raises:
            BridgeError: one is not declared, or without a value so far.
        """
        return [self._parameters.get(name) for name in parameter_names]

    def get_parameter_or(self, name: str, alternative: Parameter | None = None) -> Parameter:
        """Return a parameter that has a value, else the alternative, or one without a value."""
        return self._parameters.get_or(name, alternative)

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, by their names without it."""
        return self._parameters.by_prefix(prefix)

    def get_parameter_type(self, name: str) -> Type:
        """Return a parameter's type.

        Raises:
            BridgeError: not declared.
        """
        return self._parameters.type_of(name)

    def get_parameter_types(self, parameter_names: Sequence[str]) -> list[Type]:
        """Return parameters' types.

        Raises:
            BridgeError: one is not declared.
        """
        return [self._parameters.type_of(name) for name in parameter_names]

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return a parameter's descriptor.

        Raises:
            BridgeError: not declared.
        """
        return self._parameters.describe(name)

    def describe_parameters(self, parameter_names: Sequence[str]) -> list[ParameterDescriptor]:
        """Return parameters' descriptors.

        Raises:
            BridgeError: one is not declared.
        """
        return [self._parameters.describe(name) for name in parameter_names]

    def list_parameters(self, prefixes: Sequence[str] = (), depth: int = 0) -> ListParametersResult:
        """Return names below the prefixes, at most `depth` levels deep; 0 is as deep as there are names."""
        return self._parameters.listed(prefixes, depth)

    def set_parameter(self, name: str, value: Any) -> Parameter:
        """Change one parameter; a whole number is good for a double.

        Raises:
            BridgeError: not declared, another type, out of range, or refused by the node.
        """
        return self._parameters.set(name, value)

    def set_parameters(self, parameters: Sequence[Parameter]) -> list[SetParametersResult]:
        """Change parameters one after the other; what is refused is in the results.

        Raises:
            BridgeError: one is not declared; those before are changed.
        """
        return [self._parameters.set_atomically([parameter]) for parameter in parameters]

    def set_parameters_atomically(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Change all or none; what is refused is in the result.

        Raises:
            BridgeError: one is not declared.
        """
        return self._parameters.set_atomically(parameters)

    def set_descriptor(
        self, name: str, descriptor: ParameterDescriptor, alternative_value: Any = None
    ) -> Parameter:
        """Put another descriptor on a parameter; the alternative counts if the present value does not fit.

        Raises:
            BridgeError: not declared, read-only, or neither value fits.
        """
        return self._parameters.set_descriptor(name, descriptor, alternative_value)

    def add_pre_set_parameters_callback(self, callback: PreSet) -> None:
        """Call back before a change is checked; the callback returns the parameters to set instead."""
        self._parameters.pre_set.insert(0, callback)

    def add_on_set_parameters_callback(self, callback: OnSet) -> None:
        """Call back before a change; may refuse it.

        To refuse, the callback returns an unsuccessful SetParametersResult or raises BridgeError. It is asked
        for declarations too, as in rclpy. The one added last is asked first.
        """
        self._parameters.on_set.insert(0, callback)

    def add_post_set_parameters_callback(self, callback: PostSet) -> None:
        """Call back after a change."""
        self._parameters.post_set.insert(0, callback)

    def remove_pre_set_parameters_callback(self, callback: PreSet) -> None:
        """Call back no more.

        Raises:
            ValueError: it was not added.
        """
        self._parameters.pre_set.remove(callback)

    def remove_on_set_parameters_callback(self, callback: OnSet) -> None:
        """Call back no more.

        Raises:
            ValueError: it was not added.
        """
        self._parameters.on_set.remove(callback)

    def remove_post_set_parameters_callback(self, callback: PostSet) -> None:
        """Call back no more.

        Raises:
            ValueError: it was not added.
        """
        self._parameters.post_set.remove(callback)


def start_parameters(node: Node, overrides: Mapping[str, Any]) -> Parameters:
    """Return a node's parameters with those that every node has."""
    given = {**node.options.arguments.parameters_for(node.fully_qualified_name), **overrides}
    parameters = Parameters(
        node.fully_qualified_name,
        given,
        allow_undeclared=node.options.allow_undeclared_parameters,
        now_ns=lambda: node.now_ns,
    )
    described = new(
        ParameterDescriptor,
        description="Whether time is /clock's: decided for the whole process when it starts.",
        read_only=True,
    )
    parameters.declare("use_sim_time", node.bus.use_sim_time, described, ignore_override=True)
    described = new(
        ParameterDescriptor,
        description="If enabled, start the ~/get_type_description service.",
        read_only=True,
    )
    enabled = node.options.start_type_description_service
    parameters.declare("start_type_description_service", enabled, described)
    parameters.publish = node.publish_parameter_event  # not of these two: 25 nodes would say the same
    if node.options.automatically_declare_parameters_from_overrides:
        for name, value in given.items():
            if name not in parameters.names:
                parameters.declare(name, value)
    return parameters
