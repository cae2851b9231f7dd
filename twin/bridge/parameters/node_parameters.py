"""The part of a node that is about parameters, in rclpy's words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import ParameterDescriptor, ParameterEvent, SetParametersResult
from twin.bridge.parameters.parameters import OnSet, Parameters, PostSet, PreSet
from twin.bridge.parameters.values import Parameter, Type
from twin.bridge.types.default_values import new

if TYPE_CHECKING:
    from twin.bridge.node.options import NodeOptions

_USE_SIM_TIME = "Whether time is /clock's: decided for the whole process when it starts."
_DESCRIBE = "If enabled, start the ~/get_type_description service."


class NodeParameters(Parameters):
    """Several parameters at a time, callbacks, and the parameters that every node has."""

    options: NodeOptions

    def declare_parameters(
        self, namespace: str, parameters: Iterable[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare several: tuples of name, value and perhaps a descriptor; names are put below `namespace`.

        Raises:
            BridgeError: as `declare_parameter`; those before stay declared.
        """
        prefix = f"{namespace}." if namespace else ""
        return [
            self.declare_parameter(prefix + name, *rest, ignore_override=ignore_override)  # type: ignore[misc]
            for name, *rest in parameters
        ]

    def get_parameters(self, parameter_names: Sequence[str]) -> list[Parameter]:
        """Return parameters.

        Raises:
            BridgeError: one is not declared, or without a value so far.
        """
        return [self.get_parameter(name) for name in parameter_names]

    def get_parameter_types(self, parameter_names: Sequence[str]) -> list[Type]:
        """Return parameters' types.

        Raises:
            BridgeError: one is not declared.
        """
        return [self.get_parameter_type(name) for name in parameter_names]

    def describe_parameters(self, parameter_names: Sequence[str]) -> list[ParameterDescriptor]:
        """Return parameters' descriptors.

        Raises:
            BridgeError: one is not declared.
        """
        return [self.describe_parameter(name) for name in parameter_names]

    def set_parameters(self, parameters: Sequence[Parameter]) -> list[SetParametersResult]:
        """Change parameters one after the other; what is refused is in the results.

        Raises:
            BridgeError: one is not declared; those before are changed.
        """
        return [self.set_parameters_atomically([parameter]) for parameter in parameters]

    def add_pre_set_parameters_callback(self, callback: PreSet) -> None:
        """Call back before a change is checked; the callback returns the parameters to set instead."""
        self._pre_set.insert(0, callback)

    def add_on_set_parameters_callback(self, callback: OnSet) -> None:
        """Call back before a change; may refuse it.

        To refuse, the callback returns an unsuccessful SetParametersResult or raises BridgeError. It is asked
        for declarations too, as in rclpy. The one added last is asked first.
        """
        self._on_set.insert(0, callback)

    def add_post_set_parameters_callback(self, callback: PostSet) -> None:
        """Call back after a change."""
        self._post_set.insert(0, callback)

    def remove_pre_set_parameters_callback(self, callback: PreSet) -> None:
        """Call back no more.

        Raises:
            ValueError: it was not added.
        """
        self._pre_set.remove(callback)

    def remove_on_set_parameters_callback(self, callback: OnSet) -> None:
        """Call back no more.

        Raises:
            ValueError: it was not added.
        """
        self._on_set.remove(callback)

    def remove_post_set_parameters_callback(self, callback: PostSet) -> None:
        """Call back no more.

        Raises:
            ValueError: it was not added.
        """
        self._post_set.remove(callback)

    def _start_parameters(self, overrides: Mapping[str, Any], tell: Callable[[ParameterEvent], None]) -> None:
        """Begin with the values of the command line and `overrides`, which are stronger."""
        options = self.options
        given = {**options.arguments.parameters_for(self.fully_qualified_name), **overrides}
        super().__init__(given, allow_undeclared=options.allow_undeclared_parameters)
        for name, value, fixed, description in (
            ("use_sim_time", self.bus.use_sim_time, True, _USE_SIM_TIME),
            ("start_type_description_service", options.start_type_description_service, False, _DESCRIBE),
        ):
            descriptor = new(ParameterDescriptor, description=description, read_only=True)
            self.declare_parameter(name, value, descriptor, ignore_override=fixed)
        if options.start_parameter_event_publisher:
            self._tell = tell  # not of these two: 25 nodes would say the same
        if options.automatically_declare_parameters_from_overrides:
            for name, value in given.items():
                if not self.has_parameter(name):
                    self.declare_parameter(name, value)
