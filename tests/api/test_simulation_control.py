"""A run that others pause, step, speed up and reset, and that is the same run for all that."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import twin
from tests.processes import free_endpoint, wait_for_listener
from twin.bridge import live, types
from twin.bridge.live import LiveBus
from twin.bridge.msgs import Clock, ns
from twin.bridge.qos import LATCHED
from twin.bridge.types import ServiceType
from twin.errors import SimulationError

SCENARIO = "diff_bot_figure8"
STOPPED, PLAYING, PAUSED = 0, 1, 2
OK, OPERATION_FAILED, ALREADY = 1, 4, 101


class Operator:
    """Asks a run, and hears its time and its state."""

    def __init__(self, process: LiveBus) -> None:
        self.process = process
        self.node = process.bus.create_node("operator")
        self.times: list[int] = []
        self.states: list[Any] = []
        self.node.create_subscription(Clock, "/clock", lambda told: self.times.append(ns(told.clock)), 10)
        state = types.get("twin_msgs/msg/Simulation")
        self.node.create_subscription(state, "/simulation/state", self.states.append, LATCHED)

    def ask(self, service: str, kind: str, **fields: Any) -> Any:
        interface = ServiceType(kind)
        client = self.node.create_client(interface, service)
        assert self.process.spin(lambda: client.service_is_ready, 60.0), service
        request = types.get(f"{kind}_Request")(**fields)
        future = client.call_async(request)
        assert self.process.spin(lambda: future.done, 60.0), service
        assert future.error is None
        return future.result

    def set(self, state: int) -> Any:
        wanted = types.get("simulation_interfaces/msg/SimulationState")(state=state)
        return self.ask(
            "/set_simulation_state", "simulation_interfaces/srv/SetSimulationState", state=wanted
        ).result

    def step(self, steps: int) -> Any:
        return self.ask("/step_simulation", "simulation_interfaces/srv/StepSimulation", steps=steps).result

    def reset(self, scope: int = 0) -> Any:
        return self.ask("/reset_simulation", "simulation_interfaces/srv/ResetSimulation", scope=scope).result

    def set_speed(self, speed: float) -> Any:
        return self.ask("/simulation/set_speed", "twin_msgs/srv/SetSpeed", speed=speed)

    def hears(self, what: Any) -> None:
        assert self.process.spin(what, 60.0)

    def stands(self) -> int:
        """Return the time at which the run stands, after a while in which it could have gone on [ns]."""
        self.process.spin(timeout_s=0.5)
        before = self.times[-1]
        self.process.spin(timeout_s=0.5)
        assert self.times[-1] == before
        return before


@pytest.fixture
def running(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], Operator]]:
    endpoint = free_endpoint()
    words = ("run", SCENARIO, "--free", "--listen", endpoint, "--pace", "1", "--out", str(tmp_path), "--json")
    command = [sys.executable, "-m", "twin.cli", *words, "--bag"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            wait_for_listener(endpoint)
            with live.join([endpoint], timeout_s=60.0) as joined:
                yield process, Operator(joined)
        finally:
            process.kill()


@pytest.mark.long
def test_a_run_is_held_stepped_hurried_and_begun_anew_and_stays_the_same_run(
    running: tuple[subprocess.Popen[str], Operator],
) -> None:
    process, operator = running
    operator.hears(lambda: operator.times)
    assert operator.step(1).result == OPERATION_FAILED, "only a paused one is stepped"

    # Time stands while it is paused, and it answers all the same.
    assert operator.set(PAUSED).result == OK
    refused = operator.set(PAUSED)
    assert (refused.result, refused.error_message) == (ALREADY, "the simulation is paused already")
    before = operator.stands()
    named = operator.ask("/clock/get_parameters", "rcl_interfaces/srv/GetParameters", names=["use_sim_time"])
    assert named.values[0].bool_value

    # A step is one control period.
    assert operator.step(5).result == OK
    assert operator.stands() == before + 5 * 20_000_000

    # A speed that cannot be is refused; another one is told to all.
    answer = operator.set_speed(0.01)
    assert not answer.success
    assert answer.message == ("a speed of 0.01 cannot be; valid: 0.1 or more, or 0 for as fast as possible")
    assert operator.set_speed(0.0).success
    operator.hears(lambda: operator.states[-1].speed == 0.0)

    # A reset begins at the start, in the same process, and keeps that it is paused.
    assert operator.reset(scope=1).error_message == "a part (scope 1) cannot be reset; valid is 0, everything"
    assert operator.reset().result == OK
    operator.hears(lambda: operator.states[-1].resets == 1)
    assert operator.states[-1].state.state == PAUSED
    assert process.poll() is None
    assert operator.step(2).result == OK
    operator.hears(lambda: operator.times[-1] == 3 * 20_000_000)

    # To stop is to pause at the start.
    assert operator.set(STOPPED).result == OK
    operator.hears(lambda: operator.states[-1].resets == 2)
    assert operator.states[-1].state.state == STOPPED
    assert operator.set(9).error_message == (
        "the state 9 cannot be set; valid: 0 stopped, 1 playing, 2 paused"
    )
    assert operator.set(PLAYING).result == OK
    out, errors = process.communicate(timeout=200.0)
    verdict = json.loads(out)
    assert verdict["verdict"] == "pass", errors
    assert verdict["digest"] == twin.run(SCENARIO).digest


def test_who_steps_a_run_is_the_only_one_to_begin_it_anew() -> None:
    endpoint = free_endpoint()
    with twin.Simulation(SCENARIO, listen=[endpoint], free=True, record=False) as simulation:
        client = simulation.bus.create_node("operator").create_client(
            kind := ServiceType("simulation_interfaces/srv/ResetSimulation"), "/reset_simulation"
        )
        future = client.call_async(kind.Request(scope=0))
        assert simulation.run_until(lambda: future.done, timeout=1.0)
        assert "the only one that can begin it anew" in future.result.result.error_message
        assert simulation.step(), "it goes on"
    with pytest.raises(SimulationError):
        simulation.step()
