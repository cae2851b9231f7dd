"""A node's parameters: what is declared, and how it changes (rclpy's Node, _set_parameters_atomically)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from twin.bridge.msgs import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterEvent,
    SetParametersResult,
    stamp,
)
from twin.bridge.parameters.errors import (
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from twin.bridge.parameters.listing import SEPARATOR, listed
from twin.bridge.parameters.ranges import objection
from twin.bridge.parameters.values import Parameter, Type, coerced
from twin.bridge.types.default_values import new
from twin.errors import BridgeError

PreSet = Callable[[list[Parameter]], list[Parameter]]
OnSet = Callable[[list[Parameter]], SetParametersResult | None]
PostSet = Callable[[list[Parameter]], None]

_WRONG_TYPE = "Wrong parameter type"
_EMPTIED = (
    "parameter list cannot be empty, this might be due to pre_set_parameters_callback "
    "modifying the original parameters list."
)


class Parameters:
    """Declared parameters, started from the values that the node was created with."""

    def __init__(
        self,
        node: str,
        overrides: Mapping[str, Any],
        *,
        allow_undeclared: bool = False,
        now_ns: Callable[[], int] = lambda: 0,
    ) -> None:
        self.node = node
        """The node's full name."""
        self.overrides = dict(overrides)
        self.allow_undeclared = allow_undeclared
        self.pre_set: list[PreSet] = []
        self.on_set: list[OnSet] = []
        self.post_set: list[PostSet] = []
        self.publish: Callable[[ParameterEvent], None] = lambda event: None
        """Told of every change."""
        self._now_ns = now_ns
        self._declared: dict[str, Parameter] = {}
        self._descriptors: dict[str, ParameterDescriptor] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Declared names, in the order of declaration."""
        return tuple(self._declared)

    def declare(
        self,
        name: str,
        default: Any,
        descriptor: ParameterDescriptor | None = None,
        *,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare; an override takes the default's place.

        Args:
            name: Of the parameter.
            default: The value, or a `Parameter.Type` for a parameter that has none yet.
            descriptor: What is valid; its name and type are filled in.
            ignore_override: Whether the default holds in any case.

        Raises:
            BridgeError: declared before, or a value that is not valid.
        """
        if not name:
            raise InvalidParameterException(self.node, name)
        if name in self._declared:
            raise ParameterAlreadyDeclaredException(self.node, name)
        descriptor = new(ParameterDescriptor) if descriptor is None else replace(descriptor)
        value = None if isinstance(default, Type) else default
        if not descriptor.dynamic_typing:
            kind = default if isinstance(default, Type) else Parameter(name, value=value).kind
            if kind is Type.NOT_SET:
                raise BridgeError(
                    f"the parameter {name} of {self.node} is declared without a value; "
                    "give a value, a Parameter.Type, or a descriptor with dynamic_typing"
                )
            descriptor.type = kind.value
        if not ignore_override and name in self.overrides:
            value = coerced(self.overrides[name], Type(descriptor.type))
        result = self._set([self._of_type(name, value, descriptor)], {name: descriptor}, keep_not_set=True)
        if not result.successful:
            if result.reason.startswith(_WRONG_TYPE):
                raise InvalidParameterTypeException(self.node, name, value, Type(descriptor.type).name)
            raise InvalidParameterValueException(self.node, name, value, result.reason)
        return self._declared[name]

    def declare_together(self, parameters: Sequence[tuple[str, Any, ParameterDescriptor]]) -> None:
        """Declare many, and tell of them in one event.

        Raises:
            BridgeError: as `declare`.
        """
        together = new(ParameterEvent, stamp=stamp(self._now_ns()), node=self.node)
        publish, self.publish = self.publish, lambda e: together.new_parameters.extend(e.new_parameters)
        try:
            for name, value, descriptor in parameters:
                self.declare(name, value, descriptor)
        finally:
            self.publish = publish
        self.publish(together)

    def undeclare(self, name: str) -> None:
        """Forget a parameter.

        Raises:
            BridgeError: not declared, or read-only.
        """
        if self._known(name).read_only:
            raise ParameterImmutableException(self.node, name)
        del self._declared[name], self._descriptors[name]

    def get(self, name: str) -> Parameter:
        """Return a parameter; one without a value if undeclared ones are allowed.

        Raises:
            BridgeError: not declared, or declared without a value.
        """
        parameter = self._declared.get(name)
        if parameter is None:
            if self.allow_undeclared:
                return Parameter(name)
            raise ParameterNotDeclaredException(self.node, [name], self._declared)
        if parameter.kind is Type.NOT_SET and not self._descriptors[name].dynamic_typing:
            raise ParameterUninitializedException(self.node, name)
        return parameter

    def get_or(self, name: str, alternative: Parameter | None = None) -> Parameter:
        """Return a parameter that has a value, else the alternative."""
        parameter = self._declared.get(name)
        if parameter is None or parameter.kind is Type.NOT_SET:
            return Parameter(name) if alternative is None else alternative
        return parameter

    def type_of(self, name: str) -> Type:
        """Return a parameter's type.

        Raises:
            BridgeError: not declared.
        """
        if name in self._declared:
            return self._declared[name].kind
        if self.allow_undeclared:
            return Type.NOT_SET
        raise ParameterNotDeclaredException(self.node, [name], self._declared)

    def describe(self, name: str) -> ParameterDescriptor:
        """Return a parameter's descriptor.

        Raises:
            BridgeError: not declared.
        """
        return new(ParameterDescriptor) if self._undeclared_is_fine(name) else replace(self._known(name))

    def set_descriptor(
        self, name: str, descriptor: ParameterDescriptor, alternative: Any = None
    ) -> Parameter:
        """Put another descriptor on a parameter; the alternative counts if the present value does not fit.

        Raises:
            BridgeError: not declared, read-only, or neither value fits.
        """
        if self._undeclared_is_fine(name):
            return Parameter(name)
        if self._known(name).read_only:
            raise ParameterImmutableException(self.node, name)
        parameter = self.get(name)
        descriptor = replace(descriptor, name=name)
        reason = self._objection(parameter, descriptor)
        if reason and alternative is not None:
            parameter = Parameter(name, value=alternative)
            reason = self._objection(parameter, descriptor)
        if reason:
            raise InvalidParameterValueException(self.node, name, parameter.value, reason)
        if descriptor.dynamic_typing:
            descriptor.type = parameter.kind.value
        self._declared[name], self._descriptors[name] = parameter, descriptor
        return parameter

    def set_atomically(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Change all or none.

        Raises:
            BridgeError: one is not declared.
        """
        wanted = list(parameters)
        if self.pre_set:
            wanted = [parameter for callback in self.pre_set for parameter in callback(list(wanted))]
            if not wanted:
                return SetParametersResult(False, _EMPTIED)
        missing = [parameter.name for parameter in wanted if parameter.name not in self._declared]
        if missing and not self.allow_undeclared:
            raise ParameterNotDeclaredException(self.node, missing, self._declared)
        return self._set(wanted)

    def set(self, name: str, value: Any) -> Parameter:
        """Change one declared parameter; a whole number is good for a double.

        Raises:
            BridgeError: not declared, another type, out of range, or refused by the node.
        """
        kind = Type(self._known(name).type) if name in self._declared else Type.NOT_SET
        value = coerced(value, kind)
        parameter = self._of_type(name, value, self._descriptors.get(name))
        result = self.set_atomically([parameter])
        if not result.successful:
            if result.reason.startswith(_WRONG_TYPE):
                raise InvalidParameterTypeException(self.node, name, value, kind.name)
            raise InvalidParameterValueException(self.node, name, value, result.reason)
        return self._declared.get(name, parameter)

    def listed(self, prefixes: Sequence[str] = (), depth: int = 0) -> ListParametersResult:
        """Return names below the prefixes, at most `depth` levels deep (0: all), and their parents."""
        return listed(self.names, prefixes, depth)

    def by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, by their names without it; all for an empty one."""
        start = f"{prefix}{SEPARATOR}" if prefix else ""
        return {name[len(start) :]: p for name, p in self._declared.items() if name.startswith(start)}

    def _set(
        self,
        parameters: list[Parameter],
        descriptors: dict[str, ParameterDescriptor] | None = None,
        *,
        keep_not_set: bool = False,
    ) -> SetParametersResult:
        """Check, ask the callbacks, change, tell; with descriptors it is a declaration."""
        for parameter in parameters:
            descriptor = (descriptors or self._descriptors).get(parameter.name)
            reason = descriptor and self._objection(parameter, descriptor, read_only=descriptors is None)
            if reason:
                return SetParametersResult(False, reason)
        for callback in self.on_set:
            try:
                result = callback(parameters)
            except BridgeError as error:
                return SetParametersResult(False, str(error))
            if result is not None and not result.successful:
                return result
        event = new(ParameterEvent, stamp=stamp(self._now_ns()), node=self.node)
        for parameter in parameters:
            self._store(parameter, (descriptors or {}).get(parameter.name), event, keep_not_set)
        self.publish(event)
        for notify in self.post_set:
            notify(parameters)
        return SetParametersResult(True, "")

    def _store(
        self,
        parameter: Parameter,
        descriptor: ParameterDescriptor | None,
        event: ParameterEvent,
        keep_not_set: bool,
    ) -> None:
        name = parameter.name
        if parameter.kind is Type.NOT_SET and not keep_not_set:
            event.deleted_parameters.append(parameter.to_parameter_msg())
            self._declared.pop(name, None)
            self._descriptors.pop(name, None)
            return
        if descriptor is not None:
            self._descriptors[name] = descriptor
        elif name not in self._descriptors:
            self._descriptors[name] = new(ParameterDescriptor, dynamic_typing=True)
        kept = self._descriptors[name]
        kept.name = name
        if kept.dynamic_typing:
            kept.type = parameter.kind.value
        is_new = self.get_or(name).kind is Type.NOT_SET
        (event.new_parameters if is_new else event.changed_parameters).append(parameter.to_parameter_msg())
        self._declared[name] = parameter

    def _objection(
        self, parameter: Parameter, descriptor: ParameterDescriptor, *, read_only: bool = False
    ) -> str:
        declared = parameter.name in self._declared
        return objection(parameter, descriptor, declared=declared, check_read_only=read_only)

    def _undeclared_is_fine(self, name: str) -> bool:
        return self.allow_undeclared and name not in self._declared

    def _known(self, name: str) -> ParameterDescriptor:
        if name not in self._declared:
            raise ParameterNotDeclaredException(self.node, [name], self._declared)
        return self._descriptors[name]

    def _of_type(self, name: str, value: Any, descriptor: ParameterDescriptor | None) -> Parameter:
        """Return the parameter, an empty list as what the descriptor says."""
        kind = Type(descriptor.type) if descriptor is not None and not descriptor.dynamic_typing else None
        if kind is not None and kind.is_array and isinstance(value, list | tuple) and not value:
            return Parameter(name, kind, [])
        return Parameter(name, value=value)
