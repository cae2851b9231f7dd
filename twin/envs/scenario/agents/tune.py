"""An agent that tunes: live parameters of the robot's nodes, while they do the work."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from twin.bridge.node import Node
from twin.bridge.parameters.values import Type
from twin.envs.scenario.agents.agent import Agent, Values, unit_box
from twin.envs.scenario.episode import Episode
from twin.errors import GymError, nearest

_KINDS: Mapping[Type, Callable[[float], Any]] = {Type.DOUBLE: float, Type.INTEGER: round}


class Tune(Agent):
    """Sets parameters as `ros2 param set` does, in every step.

    An action has a number from -1 to 1 for each of `parameters`, in their order: from the lower bound to
    the upper one. The node takes a value in its next run, which ends the tick.
    """

    @dataclass(frozen=True, kw_only=True)
    class Config:
        """What it sets."""

        parameters: Mapping[str, tuple[float, float]]
        """`node:parameter` -> its least and its largest value, in the parameter's unit."""

    ticks: ClassVar[int] = 50
    observes: ClassVar[tuple[str, ...]] = ("odom", "amcl_pose")
    rewards: ClassVar[Mapping[str, float]] = {"progress": 1.0, "collision": 1.0, "checks": 10.0, "time": 0.1}

    def __init__(self, episode: Episode, config: Config) -> None:
        super().__init__(episode, config)
        if not config.parameters or not isinstance(config.parameters, Mapping):
            raise GymError("the agent tune has no parameters; valid is {'node:parameter': (low, high), ...}")
        self._knobs = [_Knob(episode, name, bounds) for name, bounds in config.parameters.items()]
        self.action_space = unit_box(len(self._knobs))

    def act(self, action: Values) -> None:
        """Set all of them."""
        for knob, value in zip(self._knobs, action.tolist(), strict=True):
            knob.turn(value)

    def observation_spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return that of the present values."""
        return {"parameters": unit_box(len(self._knobs))}

    def observe(self) -> dict[str, Values]:
        """Return the present values as an action would set them."""
        return {"parameters": np.array([knob.position for knob in self._knobs])}


class _Knob:
    """One parameter."""

    def __init__(self, episode: Episode, name: str, bounds: tuple[float, float]) -> None:
        node, colon, self._name = name.partition(":")
        if not colon:
            raise GymError(f"the parameter '{name}' has no node; valid is node:parameter")
        self._node = self._find(episode, node)
        declared = self._node.get_parameters_by_prefix("")
        if self._name not in declared:
            said = nearest(self._name, declared)
            raise GymError(f"the node {self._node.fully_qualified_name} has no '{self._name}'; {said}")
        kind = declared[self._name].kind
        if kind not in _KINDS:
            raise GymError(f"the parameter '{name}' is of type {kind.name}; an agent can tune numbers")
        self._as_its_kind = _KINDS[kind]
        try:
            self._low, self._high = (float(bound) for bound in bounds)
        except (TypeError, ValueError):
            raise GymError(f"the bounds of '{name}' are {bounds!r}; valid is (low, high)") from None
        if not (math.isfinite(self._low) and math.isfinite(self._high) and self._low < self._high):
            raise GymError(f"the bounds of '{name}' are {bounds!r}; valid are finite ones, low before high")
        self._require_allowed(name)

    @property
    def position(self) -> float:
        """Where it is, from -1 to 1."""
        value = float(self._node.get_parameter(self._name).value)
        return 2.0 * (value - self._low) / (self._high - self._low) - 1.0

    def turn(self, position: float) -> None:
        """Set it; raises BridgeError if the node refuses."""
        value = self._low + (position + 1.0) / 2.0 * (self._high - self._low)
        self._node.set_parameter(self._name, self._as_its_kind(value))

    @staticmethod
    def _find(episode: Episode, name: str) -> Node:
        nodes = {node.fully_qualified_name: node for node in episode.run.bus.nodes}
        full = name if name.startswith("/") else f"{episode.stack.context.namespace}/{name}"
        if full not in nodes:
            raise GymError(f"there is no node {full} in '{episode.scenario.name}'; {nearest(full, nodes)}")
        return nodes[full]

    def _require_allowed(self, name: str) -> None:
        told = self._node.describe_parameter(self._name)
        if told.read_only:
            raise GymError(f"the parameter '{name}' is read-only")
        ranges: list[Any] = [*told.floating_point_range, *told.integer_range]
        for allowed in ranges:
            if self._low < allowed.from_value or self._high > allowed.to_value:
                raise GymError(
                    f"the bounds of '{name}' are {self._low:g} and {self._high:g}; "
                    f"valid is {allowed.from_value:g} … {allowed.to_value:g}"
                )
