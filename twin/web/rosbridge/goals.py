"""Actions: goals that clients send, and actions that clients offer."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.actions.client import ClientGoal
from twin.bridge.graph import Graph
from twin.bridge.msgs import GoalStatus, new
from twin.bridge.node import Node
from twin.errors import BridgeError
from twin.web.rosbridge.access import READING_ACTIONS, matches
from twin.web.rosbridge.calls import APPEAR_S
from twin.web.rosbridge.learner import Learner, type_name
from twin.web.rosbridge.values import to_message, to_values

if TYPE_CHECKING:
    from twin.web.rosbridge.session import Session

_MOST_CLIENTS = 100


@dataclass(eq=False)
class _Sent:
    session: Session
    key: str | None
    action: str
    """As the client wrote it."""
    name: str
    args: Any
    feedback: bool
    until_s: float
    """When it is given up if nobody offers the action [s]."""
    client: ActionClient | None = None
    goal: ClientGoal | None = None
    cancelled: bool = False


@dataclass(eq=False)
class _Executed:
    """A goal that a client executes."""

    handle: GoalHandle
    done: bool = False
    result: Any = None


@dataclass(eq=False)
class _Offered:
    session: Session
    type: types.ActionType
    server: ActionServer
    goals: dict[str, _Executed] = field(default_factory=dict)


class Goals:
    """All goals that clients have sent and that have not ended, and all actions that clients offer."""

    def __init__(self, node: Node, graph: Graph, learner: Learner, now_s: Callable[[], float]) -> None:
        self._node, self._graph, self._learner, self._now_s = node, graph, learner, now_s
        self._sent: list[_Sent] = []
        self._clients: dict[tuple[str, str], ActionClient] = {}
        self._offered: dict[str, _Offered] = {}
        self._numbers = count(1)

    @property
    def is_waiting(self) -> bool:
        """Whether `update` has something to do soon."""
        return bool(self._sent)

    def count(self, session: Session) -> int:
        """Return how many goals a client has sent, and how many actions it offers."""
        return sum(sent.session is session for sent in self._sent) + sum(
            offered.session is session for offered in self._offered.values()
        )

    def send(self, session: Session, key: str | None, action: str, args: Any, *, feedback: bool) -> None:
        """Send a goal for a client, which is sent feedback and the result.

        Raises:
            BridgeError: an invalid name.
        """
        name, until_s = self._node.resolve_name(action), self._now_s() + APPEAR_S
        sent = _Sent(session, key, action, name, args, feedback, until_s)
        self._sent.append(sent)
        self._go_on(sent)

    def cancel(self, session: Session, key: str | None, action: str) -> None:
        """Cancel a client's goal.

        Raises:
            BridgeError: it has none of this id that has not ended.
        """
        name = self._node.resolve_name(action)
        for sent in self._sent:
            if sent.session is session and sent.name == name and sent.key == key:
                sent.cancelled = True
                if sent.goal is not None:
                    sent.goal.cancel()
                return
        raise BridgeError(f"this client has no goal {key!r} of {name} that goes on")

    def update(self) -> None:
        """Send goals whose server has appeared, tell results."""
        for sent in tuple(self._sent):
            self._go_on(sent)

    def offer(self, session: Session, name: str, given: str) -> None:
        """Let a client execute an action's goals, several at a time.

        Raises:
            BridgeError: an invalid name, an unknown type, or another client offers it.
        """
        action, action_type = self._node.resolve_name(name), types.ActionType(type_name(given, "action"))
        types.get(f"{action_type.name}_Goal")
        if action in self._offered:
            if self._offered[action].session is not session:
                raise BridgeError(f"{action} is offered by another client")
            self._withdraw(action)

        def execute(handle: GoalHandle) -> Generator[None, None, Any]:
            key = f"action_goal:{action}:{next(self._numbers)}"
            executed = offered.goals[key] = _Executed(handle)
            goal = {"op": "send_action_goal", "id": key, "action": name, "action_type": given}
            session.send_values({**goal, "args": to_values(handle.request), "feedback": True})
            told = False
            try:
                while not executed.done:
                    if handle.is_cancel_requested and not told:
                        told = True
                        session.send_values({"op": "cancel_action_goal", "id": key, "action": name})
                    yield
            finally:
                del offered.goals[key]
            return executed.result

        server = ActionServer(self._node, action_type, action, execute, policy="parallel")
        offered = self._offered[action] = _Offered(session, action_type, server)

    def withdraw(self, session: Session, name: str) -> None:
        """Let a client execute an action no more.

        Raises:
            BridgeError: it does not.
        """
        action = self._node.resolve_name(name)
        offered = self._offered.get(action)
        if offered is None or offered.session is not session:
            raise BridgeError(f"{action} is not offered by this client")
        self._withdraw(action)

    def feedback(self, session: Session, name: str, key: str, values: Any) -> None:
        """Pass a client's feedback on.

        Raises:
            BridgeError: it executes no such goal, or values that the fields cannot hold.
        """
        offered, executed = self._executed(session, name, key)
        if executed.handle.is_active:
            executed.handle.publish_feedback(to_message(offered.type.Feedback, values, self._node.now_ns))

    def result(self, session: Session, name: str, key: str, values: Any, status: int, result: bool) -> None:
        """End a goal that a client executes.

        Raises:
            BridgeError: it executes no such goal, or values that the fields cannot hold.
        """
        offered, executed = self._executed(session, name, key)
        given = to_message(offered.type.Result, values, self._node.now_ns) if result else None
        executed.result = new(offered.type.Result) if given is None else given
        handle = executed.handle
        if not handle.is_active:
            pass
        elif result and status == GoalStatus.STATUS_SUCCEEDED:
            handle.succeed()
        elif status == GoalStatus.STATUS_CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        executed.done = True

    def leave(self, session: Session) -> None:
        """End what a client offers; goals that it has sent go on, as after a page is loaded again.

        Not those that only tell something: nobody would hear it.
        """
        for sent in self._sent:
            if sent.session is session and sent.goal is not None and matches(sent.name, READING_ACTIONS):
                sent.goal.cancel()
        self._sent = [sent for sent in self._sent if sent.session is not session]
        for action, offered in tuple(self._offered.items()):
            if offered.session is session:
                self._withdraw(action)

    def _withdraw(self, action: str) -> None:
        self._offered.pop(action).server.destroy()  # goals that go on end as aborted

    def _executed(self, session: Session, name: str, key: str) -> tuple[_Offered, _Executed]:
        action = self._node.resolve_name(name)
        offered = self._offered.get(action)
        if offered is None or offered.session is not session or key not in offered.goals:
            raise BridgeError(f"this client executes no goal {key!r} of {action}")
        return offered, offered.goals[key]

    def _go_on(self, sent: _Sent) -> None:
        try:
            if sent.goal is None:
                self._send(sent)
        except BridgeError as error:
            self._finish(sent, {"values": str(error), "status": GoalStatus.STATUS_UNKNOWN, "result": False})
            return
        goal = sent.goal
        if goal is None or not goal.done:
            return
        if goal.error is not None:
            self._finish(sent, {"values": goal.error, "status": int(goal.status), "result": False})
        else:
            self._finish(sent, {"values": to_values(goal.result), "status": int(goal.status), "result": True})

    def _send(self, sent: _Sent) -> None:
        servers = self._graph.servers(f"{sent.name}/_action/send_goal")
        is_late = self._now_s() > sent.until_s
        if servers and sent.client is None:
            typename = servers[0].type.removesuffix("_SendGoal")
            try:
                goal_type = types.ActionType(typename).Goal
            except BridgeError:
                self._learner.ask(servers, self._now_s())
                if is_late:
                    raise
                return
            sent.args = to_message(goal_type, sent.args, self._node.now_ns, is_finite=True)
            sent.client = self._client(sent.name, typename)
        if sent.client is None or not sent.client.server_is_ready:
            if is_late:
                raise BridgeError(f"the action {sent.name} does not exist")
            return
        sent.goal = sent.client.send_goal(sent.args, self._teller(sent) if sent.feedback else None)
        if sent.cancelled:
            sent.goal.cancel()

    def _teller(self, sent: _Sent) -> Callable[[Any], None]:
        def tell(feedback: Any) -> None:
            values = {"op": "action_feedback", "action": sent.action, "values": to_values(feedback)}
            sent.session.send_values(_with_id(values, sent.key))

        return tell

    def _client(self, name: str, typename: str) -> ActionClient:
        key = name, typename
        if key not in self._clients:
            busy = {id(sent.client) for sent in self._sent}
            idle = [old for old, client in self._clients.items() if id(client) not in busy]
            if len(self._clients) >= _MOST_CLIENTS and idle:
                self._clients.pop(idle[0]).destroy()
            self._clients[key] = ActionClient(self._node, types.ActionType(typename), name)
        return self._clients[key]

    def _finish(self, sent: _Sent, told: dict[str, Any]) -> None:
        self._sent.remove(sent)
        if not told["result"]:
            sent.session.status("error", f"send_action_goal {sent.name}: {told['values']}", sent.key)
        sent.session.send_values(_with_id({"op": "action_result", "action": sent.action, **told}, sent.key))


def _with_id(values: dict[str, Any], key: str | None) -> dict[str, Any]:
    return values if key is None else {**values, "id": key}
