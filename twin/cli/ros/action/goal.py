"""`twin action send_goal`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.ros.graph_names import absolute, full_type, hint_at_nearest, unknown
from twin.cli.ros.joining import PATIENCE_S, Joining, tool_node
from twin.cli.ros.service.call import know
from twin.cli.ros.yaml_values import message_of, text_of
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.actions.client import ActionClient, ClientGoal
    from twin.bridge.live import LiveBus

_CANCEL_S = 5.0
_INTERRUPTED = 130


def send_goal(
    action: Annotated[str, typer.Argument(metavar="ACTION", help="Such as /fibonacci.")],
    action_type: Annotated[
        str, typer.Argument(metavar="TYPE", help="Such as example_interfaces/action/Fibonacci.")
    ],
    goal: Annotated[
        str | None, typer.Argument(metavar="VALUES", help="The goal as YAML; defaults if left out.")
    ] = None,
    stdin: Annotated[bool, typer.Option("--stdin", help="Read the goal from standard input.")] = False,
    feedback: Annotated[bool, typer.Option("--feedback", "-f", help="Print feedback too.")] = False,
    timeout: Annotated[
        float | None,
        typer.Option("--timeout", "-t", metavar="S", min=0.0, help="Give up, and cancel, after so long."),
    ] = None,
    *,
    joining: Joining,
) -> None:
    """Send a goal and wait for its result; Ctrl-C cancels the goal."""
    from twin.bridge import types
    from twin.bridge.actions.client import ActionClient
    from twin.bridge.messages.as_text import message_to_yaml
    from twin.bridge.wire.interrupts import noted_signals

    text = text_of(goal, stdin)
    with joining.open(PATIENCE_S if timeout is None else timeout) as process, noted_signals() as signals:
        example = "example_interfaces/action/Fibonacci"
        kind = types.ActionType(full_type(action_type, "action", "action", example))
        node = tool_node(process.bus, f"send_goal_{kind.name.replace('/', '_')}")
        know(process, node, _used(kind.name, f"{absolute(action)}/_action"))
        message = message_of(kind.Goal, text)
        client = ActionClient(node, kind, absolute(action))
        typer.echo("Waiting for an action server to become available...")
        _wait_for_server(process, client, kind.name, timeout, signals)
        typer.echo(f"Sending goal:\n     {message_to_yaml(message)}")
        heard: list[Any] = []
        sent = client.send_goal(message, heard.append if feedback else None)
        _follow(process, client, sent, timeout, signals, heard)


def _wait_for_server(
    process: LiveBus, client: ActionClient, typename: str, timeout_s: float | None, signals: list[int]
) -> None:
    from twin.bridge.graph import Graph

    _refuse_other_type(process, client.name, typename)
    if not client.server_is_ready:
        others = Graph.snapshot(process.bus).actions().keys() - {client.name}
        hint_at_nearest("action", client.name, others)
    in_time = process.spin(lambda: client.server_is_ready or bool(signals), timeout_s)
    if signals:
        raise typer.Exit(_INTERRUPTED)
    if not in_time:
        _refuse_other_type(process, client.name, typename)
        actions = [name for name in Graph.snapshot(process.bus).actions() if name != client.name]
        fault = unknown("action", client.name, actions)
        raise BridgeError(f"Action server is not available after waiting {timeout_s:g} seconds: {fault}")


def _follow(
    process: LiveBus,
    client: ActionClient,
    goal: ClientGoal,
    timeout_s: float | None,
    signals: list[int],
    feedback: list[Any],
) -> None:
    """Tell what becomes of a goal; feedback may come before the answer that it is accepted."""
    from twin.bridge.actions.goal import NAMES
    from twin.bridge.messages.as_text import message_to_yaml

    def is_over() -> bool:
        while feedback:
            typer.echo(f"Feedback:\n    {message_to_yaml(feedback.pop(0))}")
        return goal.done or bool(signals)

    answered = process.spin(lambda: goal.accepted is not None or bool(signals), timeout_s)
    if goal.accepted is False and goal.error and "rejected" in goal.error:
        typer.echo("Goal was rejected.")
        return
    if goal.accepted:
        typer.echo(f"Goal accepted with ID: {goal.goal_id.hex()}\n")
        answered = process.spin(is_over, timeout_s)
    if goal.done:
        if goal.error is not None:
            raise BridgeError(f"the goal has no result: {goal.error}")
        typer.echo(f"Result:\n    {message_to_yaml(goal.result)}")
        typer.echo(f"Goal finished with status: {NAMES.get(goal.status, 'UNKNOWN')}")
        return
    _cancel(process, goal)
    if not answered:
        raise BridgeError(f"the action {client.name} gave no result in {timeout_s:g} s")
    raise typer.Exit(_INTERRUPTED)


def _cancel(process: LiveBus, goal: ClientGoal) -> None:
    """Ask the server to end a goal and wait until it agrees.

    Raises:
        BridgeError: it does not.
    """
    typer.echo("Canceling goal...")
    future = goal.cancel()
    if not process.spin(lambda: future.done, _CANCEL_S):
        raise BridgeError(f"Failed to cancel goal: no answer in {_CANCEL_S:g} s")
    canceling = [bytes(info.goal_id.uuid) for info in future.result.goals_canceling]
    if goal.goal_id not in canceling:
        raise BridgeError("Failed to cancel goal: the action server does not agree")
    typer.echo("Goal canceled.")


def _refuse_other_type(process: LiveBus, name: str, typename: str) -> None:
    from twin.bridge.graph import Graph

    for server in Graph.snapshot(process.bus).servers(f"{name}/_action/send_goal"):
        offered = server.type.removesuffix("_SendGoal")
        if offered != typename:
            raise BridgeError(f"the action {name} is of type {offered}, not {typename}")


def _used(typename: str, base: str) -> dict[str, tuple[str, str]]:
    """Return the parts of an action's type, and what carries them."""
    return {
        f"{typename}_Goal": (f"{base}/send_goal", f"{typename}_SendGoal"),
        f"{typename}_Result": (f"{base}/get_result", f"{typename}_GetResult"),
        f"{typename}_Feedback": (f"{base}/feedback", f"{typename}_FeedbackMessage"),
    }
