"""Parameters and actions across two Zenoh sessions."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from twin.bridge import live
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.parameters.values import Parameter
from twin.bridge.srvs import ListParameters, SetParameters


def both(run: Bus, process: live.LiveBus, until: Any) -> None:
    """Spin a run's bus and a process's until something holds."""

    def step() -> bool:
        run.admit()
        run.spin()
        return bool(until())

    assert process.spin(until=step, timeout_s=100)


def forever(handle: GoalHandle) -> Generator[None, None, Any]:
    while not handle.is_cancel_requested:
        yield
    handle.canceled()
    return Fibonacci.Result(np.zeros(0, np.int32))


def test_another_process_changes_a_parameter(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as run, live.join([endpoint]) as process:
        node = run.create_node("amcl")
        node.declare_parameter("rate", 1.0)
        tool = process.bus.create_node("tool")
        setting = tool.create_client(SetParameters, "/amcl/set_parameters")
        listing = tool.create_client(ListParameters, "/amcl/list_parameters")
        both(run, process, lambda: setting.service_is_ready and listing.service_is_ready)
        changed = setting.call_async(SetParameters.Request([Parameter("rate", value=5.0).to_parameter_msg()]))
        listed = listing.call_async(ListParameters.Request([], 0))
        both(run, process, lambda: changed.done and listed.done)
        assert [r.successful for r in changed.result.results] == [True]
        assert "rate" in listed.result.result.names
        assert node.get_parameter("rate").value == 5.0
        assert tool.get_parameter("use_sim_time").value is False


def test_a_server_that_dies_during_a_goal_is_one_sentence(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as run, live.join([endpoint]) as process:
        server = process.bus.create_node("server")
        action = ActionServer(server, Fibonacci, "fib", forever)
        client = ActionClient(run.create_node("client"), Fibonacci, "fib")
        both(run, process, lambda: client.server_is_ready)
        goal = client.send_goal(Fibonacci.Goal(1))
        both(run, process, lambda: goal.accepted)
        server.remove_execution(action)
        process.bus.session.close()  # type: ignore[no-untyped-call]  # as a killed process: nobody says goodbye
        for _ in range(1000):
            run.external.wait(0.01)
            run.admit()
            run.spin()
            if goal.done:
                break
        assert goal.error == "the server of the action /fib went away before the goal had ended"


def test_a_client_that_dies_does_not_disturb_the_server(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as run, live.join([endpoint]) as process:
        server = ActionServer(run.create_node("server"), Fibonacci, "fib", forever)
        client = ActionClient(process.bus.create_node("client"), Fibonacci, "fib")
        both(run, process, lambda: client.server_is_ready)
        goal = client.send_goal(Fibonacci.Goal(1))
        both(run, process, lambda: goal.accepted)
        process.bus.session.close()  # type: ignore[no-untyped-call]
        (handle,) = server.goals
        handle.abort()
        run.spin()
        assert server.goals == ()
        again = ActionClient(run.create_node("other"), Fibonacci, "fib").send_goal(Fibonacci.Goal(1))
        for _ in range(3):
            run.spin()
        assert again.accepted
