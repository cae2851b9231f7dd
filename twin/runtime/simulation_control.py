"""`/simulation`: others pause, step, hurry and reset a run, by the services of simulation_interfaces."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from twin.bridge import types
from twin.bridge.node.options import NodeOptions
from twin.bridge.qos import LATCHED
from twin.bridge.services import Respond
from twin.bridge.types import ServiceType
from twin.runtime.open_run import OpenRun

NODE = "/simulation"
SLOWEST = 0.1
"""Simulated seconds per second; less looks like a run that hangs."""
_OPTIONS = NodeOptions(enable_rosout=False, start_parameter_event_publisher=False)
"""It publishes nothing that counts: that somebody looks on, or waits, is no part of what the run was."""
_GET_FEATURES = ServiceType("simulation_interfaces/srv/GetSimulatorFeatures")
_GET = ServiceType("simulation_interfaces/srv/GetSimulationState")
_SET = ServiceType("simulation_interfaces/srv/SetSimulationState")
_RESET = ServiceType("simulation_interfaces/srv/ResetSimulation")
_STEP = ServiceType("simulation_interfaces/srv/StepSimulation")
_SET_SPEED = ServiceType("twin_msgs/srv/SetSpeed")
_STOPPED, _PLAYING, _PAUSED = range(3)
_STATES = ("stopped", "playing", "paused")
_EVERYTHING = (0, 255)
"""Scopes of a reset that mean all of them."""


@dataclass(kw_only=True)
class SimulationState:
    """What somebody has made of a run; it outlasts a reset."""

    state: int = _PLAYING
    """A constant of `simulation_interfaces/msg/SimulationState`."""
    speed: float = 0.0
    """Simulated seconds per second; 0: as fast as possible."""
    resets: int = 0


class SimulationControl:
    """Holds a run between two ticks. What nodes are told while it is held, they hear at once.

    It is no part of the run: neither pauses nor speeds change its digest.
    """

    def __init__(
        self,
        run: OpenRun,
        state: SimulationState,
        *,
        can_reset: Callable[[], bool],
        keeps_inputs: bool = False,
    ) -> None:
        """Make the node; the run closes it.

        Args:
            run: Before its first tick.
            state: How it is to go on, and what becomes of that.
            can_reset: Whether somebody makes the run anew when `is_to_reset` has ended it.
            keeps_inputs: Whether what comes in is played back, tick by tick: then it waits while time stands.
        """
        self.state = state
        self.is_to_reset = False
        """Whether the run is to end for another one, with the same state."""
        self._run, self._can_reset = run, can_reset
        self._stepping: tuple[int, Respond] | None = None
        """Until when [ns], and who waits for it."""
        self._result = types.get("simulation_interfaces/msg/Result")
        self.node = node = run.run.bus.create_node(NODE.strip("/"), options=_OPTIONS)
        self._told = types.get("twin_msgs/msg/Simulation")
        self._publisher = node.create_publisher(self._told, f"{NODE}/state", LATCHED, on_demand=True)
        node.create_service(_GET_FEATURES, "/get_simulator_features", self._on_get_features)
        node.create_service(_GET, "/get_simulation_state", self._on_get)
        node.create_service(_SET, "/set_simulation_state", self._on_set)
        node.create_service(_RESET, "/reset_simulation", self._on_reset)
        node.create_deferred_service(_STEP, "/step_simulation", self._on_step)
        node.create_service(_SET_SPEED, f"{NODE}/set_speed", self._on_set_speed)
        run.is_held = self._is_held
        run.heard_when_held = node if keeps_inputs else None
        self._tell()

    def _is_held(self) -> bool:
        if self._stepping is not None:
            until_ns, respond = self._stepping
            if self._run.run.world.time_ns < until_ns:
                return False
            self._stepping = None
            respond(_STEP.Response(result=self._ok()))
        return self.state.state != _PLAYING and not self.is_to_reset

    def _on_get_features(self, request: Any) -> Any:
        features = types.get("simulation_interfaces/msg/SimulatorFeatures")
        has = [
            features.SIMULATION_STATE_GETTING,
            features.SIMULATION_STATE_SETTING,
            features.SIMULATION_STATE_PAUSE,
            features.STEP_SIMULATION_SINGLE,
            features.STEP_SIMULATION_MULTIPLE,
            *([features.SIMULATION_RESET] if self._can_reset() else []),
        ]
        info = f"twin; its speed is set by {NODE}/set_speed"
        return _GET_FEATURES.Response(features=features(features=has, spawn_formats=[], custom_info=info))

    def _on_get(self, request: Any) -> Any:
        state = types.get("simulation_interfaces/msg/SimulationState")
        return _GET.Response(state=state(state=self.state.state), result=self._ok())

    def _on_set(self, request: Any) -> Any:
        wanted, now = int(request.state.state), self.state.state
        if wanted == now:
            why = f"the simulation is {_STATES[now]} already"
            return _SET.Response(result=self._result(_SET.Response.ALREADY_IN_TARGET_STATE, why))
        if wanted not in (_STOPPED, _PLAYING, _PAUSED):
            why = f"the state {wanted} cannot be set; valid: 0 stopped, 1 playing, 2 paused"
            return _SET.Response(result=self._result(self._result.RESULT_FEATURE_UNSUPPORTED, why))
        if wanted == _STOPPED and (refusal := self._begin_anew()) is not None:
            return _SET.Response(result=refusal)
        self.state.state = wanted
        if wanted == _PLAYING:
            self._run.go_on(self.state.speed or math.inf)
        if wanted != _STOPPED:  # the next one tells that it stands at the start
            self._tell()
        return _SET.Response(result=self._ok())

    def _on_reset(self, request: Any) -> Any:
        if request.scope not in _EVERYTHING:
            why = f"a part (scope {request.scope}) cannot be reset; valid is 0, everything"
            return _RESET.Response(result=self._result(self._result.RESULT_FEATURE_UNSUPPORTED, why))
        return _RESET.Response(result=self._begin_anew() or self._ok())

    def _begin_anew(self) -> Any | None:
        """End the run for another one; return why that cannot be."""
        if not self._can_reset():
            why = "the program that steps this run is the only one that can begin it anew"
            return self._result(self._result.RESULT_FEATURE_UNSUPPORTED, why)
        self.is_to_reset = True
        self.state.resets += 1
        return None

    def _on_step(self, request: Any, respond: Respond) -> None:
        if self.state.state == _PLAYING or self._stepping is not None:
            now = "making steps" if self._stepping is not None else "playing"
            why = f"the simulation is {now}; steps can be made when it is paused"
            respond(_STEP.Response(result=self._result(self._result.RESULT_OPERATION_FAILED, why)))
            return
        parts = self._run.run.parts
        self._run.go_on(self.state.speed or math.inf)
        self._stepping = parts.world.time_ns + request.steps * parts.control_period_ns, respond

    def _on_set_speed(self, request: Any) -> Any:
        speed = request.speed
        if speed != 0.0 and not SLOWEST <= speed < math.inf:
            why = f"a speed of {speed:g} cannot be; valid: {SLOWEST:g} or more, or 0 for as fast as possible"
            return _SET_SPEED.Response(success=False, message=why)
        self.state.speed = speed
        self._run.go_on(speed or math.inf)
        self._tell()
        return _SET_SPEED.Response(
            success=True, message=f"{speed:g} times real time" if speed else "as fast as possible"
        )

    def _tell(self) -> None:
        state = types.get("simulation_interfaces/msg/SimulationState")(state=self.state.state)
        self._publisher.publish(
            self._told(state=state, speed=self.state.speed, resets=self.state.resets), frozen=True
        )

    def _ok(self) -> Any:
        return self._result(self._result.RESULT_OK, "")
