"""A node's parameters: what is declared, and how it changes (rclpy's Node, _set_parameters_atomically)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterEvent,
    SetParametersResult,
    stamp,
)
from twin.bridge.parameters import errors
from twin.bridge.parameters.rules import SEPARATOR, listed, objection
from twin.bridge.parameters.values import Parameter, Type, coerced
from twin.bridge.types.default_values import new
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.bus import Bus

PreSet = Callable[[list[Parameter]], list[Parameter]]
OnSet = Callable[[list[Parameter]], SetParametersResult | None]
PostSet = Callable[[list[Parameter]], None]

_WRONG_TYPE = "Wrong parameter type"
_EMPTIED = (
    "parameter list cannot be empty, this might be due to pre_set_parameters_callback "
    "modifying the original parameters list."
)


class Parameters(ABC):
    """The part of a node that declares, gets and sets parameters, in rclpy's words; see `errors`."""

    bus: Bus

    def __init__(self, overrides: Mapping[str, Any], *, allow_undeclared: bool) -> None:
        self._overrides = overrides
        self._allow_undeclared = allow_undeclared
        self._pre_set: list[PreSet] = []
        self._on_set: list[OnSet] = []
        self._post_set: list[PostSet] = []
        self._tell: Callable[[ParameterEvent], None] = lambda event: None
        """Called for every change."""
        self._together: ParameterEvent | None = None
        """That of all parameters that are being declared together."""
        self._parameters: dict[str, Parameter] = {}
        self._descriptors: dict[str, ParameterDescriptor] = {}
        self._texts: dict[str, Callable[[str], str]] = {}
        """Who tells a parameter's description, if the descriptor has none."""

    @property
    @abstractmethod
    def fully_qualified_name(self) -> str:
        """Namespace and name of the node."""

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
        if not name:
            raise errors.InvalidParameterException(self.fully_qualified_name, name)
        if name in self._parameters:
            raise errors.ParameterAlreadyDeclaredException(self.fully_qualified_name, name)
        descriptor = new(ParameterDescriptor) if descriptor is None else replace(descriptor)
        value, kind = (None, value) if isinstance(value, Type) else (value, None)
        parameter = Parameter(name, value=value)
        if not descriptor.dynamic_typing:
            kind = kind or parameter.kind
            if kind is Type.NOT_SET:
                raise BridgeError(
                    f"the parameter {name} of {self.fully_qualified_name} is declared without a value; "
                    "give a value, a Parameter.Type, or a descriptor with dynamic_typing"
                )
            descriptor.type = kind.value
        if not ignore_override and name in self._overrides:
            value = coerced(self._overrides[name], Type(descriptor.type))
            parameter = _of_type(name, value, descriptor)
        result = self._change([parameter], descriptor)
        self._raise_refusal(result, name, value, Type(descriptor.type))
        return self._parameters[name]

    def declare_together(
        self, parameters: Sequence[tuple[str, Any, ParameterDescriptor]], text_of: Callable[[str], str]
    ) -> None:
        """Declare many parameters, and tell of them in one event.

        Args:
            parameters: Names, values and descriptors, which need no description.
            text_of: Returns a parameter's description by its name; called when somebody asks for it.

        Raises:
            BridgeError: as `declare_parameter`.
        """
        self._together = together = self._event()
        try:
            for each in parameters:
                self.declare_parameter(*each)
                self._texts[each[0]] = text_of
        finally:
            self._together = None
        self._tell(together)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._parameters

    def undeclare_parameter(self, name: str) -> None:
        """Forget a parameter.

        Raises:
            BridgeError: not declared, or read-only.
        """
        if self._known(name).read_only:
            raise errors.ParameterImmutableException(self.fully_qualified_name, name)
        del self._parameters[name], self._descriptors[name]
        self._texts.pop(name, None)

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter; one without a value if undeclared ones are allowed.

        Raises:
            BridgeError: not declared, or declared without a value.
        """
        if self._undeclared_is_fine(name):
            return Parameter(name)
        self._known(name)
        parameter = self._parameters[name]
        if parameter.kind is Type.NOT_SET and not self._descriptors[name].dynamic_typing:
            raise errors.ParameterUninitializedException(self.fully_qualified_name, name)
        return parameter

    def get_parameter_or(self, name: str, alternative: Parameter | None = None) -> Parameter:
        """Return a parameter that has a value, else the alternative, or one without a value."""
        parameter = self._parameters.get(name)
        if parameter is None or parameter.kind is Type.NOT_SET:
            return Parameter(name) if alternative is None else alternative
        return parameter

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, by their names without it; all for an empty one."""
        start = f"{prefix}{SEPARATOR}" if prefix else ""
        return {name[len(start) :]: p for name, p in self._parameters.items() if name.startswith(start)}

    def get_parameter_type(self, name: str) -> Type:
        """Return a parameter's type.

        Raises:
            BridgeError: not declared.
        """
        if self._undeclared_is_fine(name):
            return Type.NOT_SET
        self._known(name)
        return self._parameters[name].kind

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return a parameter's descriptor.

        Raises:
            BridgeError: not declared.
        """
        if self._undeclared_is_fine(name):
            return new(ParameterDescriptor)
        known = self._known(name)
        if not known.description and name in self._texts:
            return replace(known, description=self._texts[name](name))
        return replace(known)

    def list_parameters(self, prefixes: Sequence[str] = (), depth: int = 0) -> ListParametersResult:
        """Return names below the prefixes, at most `depth` levels deep; 0 is as deep as there are names."""
        return listed(self._parameters, prefixes, depth)

    def set_descriptor(
        self, name: str, descriptor: ParameterDescriptor, alternative_value: Any = None
    ) -> Parameter:
        """Put another descriptor on a parameter; the alternative counts if the present value does not fit.

        Raises:
            BridgeError: not declared, read-only, or neither value fits.
        """
        if self._undeclared_is_fine(name):
            return Parameter(name)
        if self._known(name).read_only:
            raise errors.ParameterImmutableException(self.fully_qualified_name, name)
        parameter = self.get_parameter(name)
        descriptor = replace(descriptor, name=name)
        reason = self._objection(parameter, descriptor)
        if reason and alternative_value is not None:
            parameter = Parameter(name, value=alternative_value)
            reason = self._objection(parameter, descriptor)
        if reason:
            raise errors.InvalidParameterValueException(
                self.fully_qualified_name, name, parameter.value, reason
            )
        if descriptor.dynamic_typing:
            descriptor.type = parameter.kind.value
        self._parameters[name], self._descriptors[name] = parameter, descriptor
        self._texts.pop(name, None)
        return parameter

    def set_parameters_atomically(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Change all or none; what is refused is in the result.

        Raises:
            BridgeError: one is not declared.
        """
        wanted = list(parameters)
        if self._pre_set:
            wanted = [parameter for callback in self._pre_set for parameter in callback(list(wanted))]
            if not wanted:
                return SetParametersResult(False, _EMPTIED)
        missing = [parameter.name for parameter in wanted if parameter.name not in self._parameters]
        if missing and not self._allow_undeclared:
            raise errors.ParameterNotDeclaredException(self.fully_qualified_name, missing, self._parameters)
        return self._change(wanted)

    def set_parameter(self, name: str, value: Any) -> Parameter:
        """Change one parameter; a whole number is good for a double.

        Raises:
            BridgeError: not declared, another type, out of range, or refused by the node.
        """
        kind = Type(self._known(name).type) if name in self._parameters else Type.NOT_SET
        value = coerced(value, kind)
        parameter = _of_type(name, value, self._descriptors.get(name))
        self._raise_refusal(self.set_parameters_atomically([parameter]), name, value, kind)
        return self._parameters.get(name, parameter)

    def _change(
        self, parameters: list[Parameter], declared_as: ParameterDescriptor | None = None
    ) -> SetParametersResult:
        """Check, ask the callbacks, change, tell; with a descriptor it is one declaration."""
        for parameter in parameters:
            descriptor = declared_as or self._descriptors.get(parameter.name)
            reason = descriptor and self._objection(parameter, descriptor, read_only=declared_as is None)
            if reason:
                return SetParametersResult(False, reason)
        for callback in self._on_set:
            try:
                result = callback(parameters)
            except BridgeError as error:
                return SetParametersResult(False, str(error))
            if result is not None and not result.successful:
                return result
        event = self._together or self._event()
        for parameter in parameters:
            self._store(parameter, declared_as, event)
        if event is not self._together:
            self._tell(event)
        for notify in self._post_set:
            notify(parameters)
        return SetParametersResult(True, "")

    def _store(
        self, parameter: Parameter, declared_as: ParameterDescriptor | None, event: ParameterEvent
    ) -> None:
        name = parameter.name
        if parameter.kind is Type.NOT_SET and declared_as is None:
            event.deleted_parameters.append(parameter.to_parameter_msg())
            self._parameters.pop(name, None)
            self._descriptors.pop(name, None)
            self._texts.pop(name, None)
            return
        kept = declared_as or self._descriptors.get(name) or new(ParameterDescriptor, dynamic_typing=True)
        self._descriptors[name] = kept
        kept.name = name
        if kept.dynamic_typing:
            kept.type = parameter.kind.value
        is_new = name not in self._parameters or self._parameters[name].kind is Type.NOT_SET
        (event.new_parameters if is_new else event.changed_parameters).append(parameter.to_parameter_msg())
        self._parameters[name] = parameter

    def _event(self) -> ParameterEvent:
        return new(ParameterEvent, stamp=stamp(self.bus.clock.now_ns), node=self.fully_qualified_name)

    def _raise_refusal(self, result: SetParametersResult, name: str, value: Any, kind: Type) -> None:
        if result.successful:
            return
        if result.reason.startswith(_WRONG_TYPE):
            raise errors.InvalidParameterTypeException(self.fully_qualified_name, name, value, kind.name)
        raise errors.InvalidParameterValueException(self.fully_qualified_name, name, value, result.reason)

    def _objection(
        self, parameter: Parameter, descriptor: ParameterDescriptor, *, read_only: bool = False
    ) -> str:
        declared = parameter.name in self._parameters
        return objection(parameter, descriptor, declared=declared, check_read_only=read_only)

    def _undeclared_is_fine(self, name: str) -> bool:
        return self._allow_undeclared and name not in self._parameters

    def _known(self, name: str) -> ParameterDescriptor:
        if name not in self._parameters:
            raise errors.ParameterNotDeclaredException(self.fully_qualified_name, [name], self._parameters)
        return self._descriptors[name]


def _of_type(name: str, value: Any, descriptor: ParameterDescriptor | None) -> Parameter:
    """Return the parameter, an empty list as what the descriptor says."""
    kind = Type(descriptor.type) if descriptor is not None and not descriptor.dynamic_typing else None
    if kind is not None and kind.is_array and isinstance(value, list | tuple) and not value:
        return Parameter(name, kind, [])
    return Parameter(name, value=value)
