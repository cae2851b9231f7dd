"""One client's side of the protocol: what its messages mean, and what it may do. No I/O, no threads."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from twin.bridge.msgs import GoalStatus
from twin.errors import BridgeError, TwinError
from twin.web.rosbridge.access import (
    READING_ACTIONS,
    STEERING_SERVICES,
    STEERING_TOPICS,
    STEERING_TYPES,
    STOPS,
    RefusedError,
    Role,
    matches,
)
from twin.web.rosbridge.control import NAME as CONTROL
from twin.web.rosbridge.flow import Wanted
from twin.web.rosbridge.frames import COMPRESSIONS, Fragments, Send, in_fragments, to_json

if TYPE_CHECKING:
    from twin.web.rosbridge.bridge import Bridge

_LEVELS = ("none", "error", "warning", "info")
_LONGEST_TEXT = 300
_REFUSED_S = 1.0
"""How often the audit tells that the same was refused [s]: who asks all the time does not fill it."""
Message = dict[str, Any]


class Session:
    """A client: its messages come in by `handle`, what it is told goes out by `send`."""

    def __init__(
        self,
        bridge: Bridge,
        number: int,
        name: str,
        role: Role,
        send: Send,
        *,
        is_known: bool = False,
    ):
        self.number = number
        """Unique in the bridge."""
        self.identity = f"{name} #{number}"
        """Who it is: the token's name, or an address; for the audit."""
        self.name = self.identity
        """What it is called, for people."""
        self._known = name if is_known else ""
        self.role = role
        self.send = send
        self._bridge = bridge
        self._level = _LEVELS.index("error")
        self._fragments = Fragments(bridge.limits.message_bytes)
        self._number = 0
        self._is_over = False
        self._refused: dict[tuple[str, str], float] = {}
        self._ops: dict[str, Callable[[Message], None]] = {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "advertise_service": self._advertise_service,
            "unadvertise_service": self._unadvertise_service,
            "service_response": self._service_response,
            "send_action_goal": self._send_action_goal,
            "cancel_action_goal": self._cancel_action_goal,
            "advertise_action": self._advertise_action,
            "unadvertise_action": self._unadvertise_action,
            "action_feedback": self._action_feedback,
            "action_result": self._action_result,
            "set_level": self._set_level,
            "status": lambda message: None,
            "auth": lambda message: None,  # the server has looked at it
            "fragment": self._fragment,
        }

    def handle(self, message: Message) -> None:
        """Do what a message says; what is wrong with it becomes a `status` for the client."""
        if self._is_over:  # that it went overtakes what it had said before
            return
        key = message.get("id")
        try:
            op = _text(message, "op")
            if op not in self._ops:
                raise BridgeError(f"the operation {op[:80]!r} is not known; valid: {', '.join(self._ops)}")
            self._ops[op](message)
        except TwinError as error:
            if isinstance(error, RefusedError):
                self._audit_refused(message, str(error))
            self.status("error", str(error), key if isinstance(key, str) else None)

    def call(self, name: str) -> None:
        """Take the name that somebody gives himself; whom a token names stays known by that, too."""
        if name:
            self.name = f"{name} ({self._known})" if self._known and name != self._known else name

    def status(self, level: str, text: str, key: str | None = None) -> None:
        """Tell the client what it wants to know of this level."""
        if _LEVELS.index(level) <= self._level:
            told = {"op": "status", "level": level, "msg": text[:_LONGEST_TEXT]}
            self.send(to_json(told if key is None else {**told, "id": key[:_LONGEST_TEXT]}), None)

    def send_values(self, values: Message, fragment_size: int | None = None) -> None:
        """Send a message that is no topic's."""
        self._number += 1
        for frame in in_fragments(to_json(values), fragment_size, self._number):
            self.send(frame, None)

    def audit(self, op: str, name: str, values: Any = None) -> None:
        """Note a command."""
        self._bridge.audit(self, op, name, values)

    def _audit_refused(self, message: Message, why: str) -> None:
        target = next((message[field] for field in ("topic", "service", "action") if field in message), "")
        op, target, now_s = str(message["op"]), str(target)[:_LONGEST_TEXT], self._bridge.now_s()
        self._refused = {key: at_s for key, at_s in self._refused.items() if now_s - at_s < _REFUSED_S}
        if (op, target) not in self._refused:
            self._refused[op, target] = now_s
            self.audit(op, target, {"refused": why})

    def close(self) -> None:
        """End all that the client had, and do no more of what it said. Harmless when repeated."""
        self._is_over = True
        self._bridge.leave(self)

    def _advertise(self, message: Message) -> None:
        topic = self._bridge.resolve(_text(message, "topic"))
        self.role.check("topic", topic)
        self._limit(self._bridge.topics.count(self))
        self._bridge.topics.advertise(
            self,
            topic,
            _text(message, "type"),
            _id(message),
            latch=bool(message.get("latch", False)),
            depth=_whole(message, "queue_size", 100),
        )

    def _unadvertise(self, message: Message) -> None:
        self._bridge.topics.unadvertise(self, _text(message, "topic"), _id(message))

    def _publish(self, message: Message) -> None:
        bridge, topic = self._bridge, self._bridge.resolve(_text(message, "topic"))
        self.role.check("topic", topic)
        steers = bridge.topics.type_of(topic) in STEERING_TYPES
        is_command = steers or matches(topic, STEERING_TOPICS)
        if steers:
            bridge.check_way(self.role, topic)
        if is_command and not matches(topic, STOPS):
            bridge.control.command(self)
        published = bridge.topics.publish(
            self, topic, message.get("msg"), latch=bool(message.get("latch", False)), is_finite=is_command
        )
        if steers:
            bridge.control.steered(self, topic, published)
        self.audit("publish", topic, message.get("msg"))

    def _subscribe(self, message: Message) -> None:
        self.role.check("heard topic", self._bridge.resolve(_text(message, "topic")))
        compression = message.get("compression", "none") or "none"
        if compression not in COMPRESSIONS:
            raise BridgeError(
                f"the compression {str(compression)[:80]!r} is not known; valid: {', '.join(COMPRESSIONS)}"
            )
        self._limit(self._bridge.topics.count(self))
        size = message.get("fragment_size")
        wanted = Wanted(
            _number(message, "throttle_rate") * 1e-3,
            _whole(message, "queue_length", 0),
            None if size is None else max(1, _whole(message, "fragment_size", 1)),
            compression,
        )
        given = message.get("type")
        self._bridge.topics.subscribe(
            self,
            _text(message, "topic"),
            None if given is None else _text(message, "type"),
            _id(message),
            wanted,
        )

    def _unsubscribe(self, message: Message) -> None:
        self._bridge.topics.unsubscribe(self, _text(message, "topic"), _id(message))

    def _call_service(self, message: Message) -> None:
        bridge, key, args = self._bridge, _id(message), message.get("args")
        service = bridge.resolve(_text(message, "service"))
        answer = {"op": "service_response", "service": message["service"]}
        answer = answer if key is None else {**answer, "id": key}
        if service == CONTROL:
            args = args if isinstance(args, dict) else {}
            command, name = str(args.get("command", "")), str(args.get("name", ""))
            is_renewal = command == "take" and bridge.control.holder is self
            done, words = bridge.control.ask(self, command, name)
            if command and not is_renewal:
                self.audit("control", service, args)
            me = {"success": done, "message": words, "id": self.number, "role": self.role.name}
            self.send_values({**answer, "values": {**me, **bridge.control.state()}, "result": True})
            return
        try:
            self.role.check("service", service)
            self._limit(bridge.calls.count(self))
            if matches(service, STEERING_SERVICES):
                bridge.control.command(self)
            size = message.get("fragment_size")
            bridge.calls.call(
                self,
                key,
                _text(message, "service"),
                args,
                timeout_s=_number(message, "timeout"),
                fragment_size=None if size is None else max(1, _whole(message, "fragment_size", 1)),
            )
        except BridgeError as error:  # who waits for an answer gets one
            self.send_values({**answer, "values": str(error), "result": False})
            raise
        if not bridge.is_reading(service):
            self.audit("call_service", service, args)

    def _advertise_service(self, message: Message) -> None:
        self._may_offer()
        self._limit(self._bridge.calls.count(self))
        self._bridge.calls.offer(self, _text(message, "service"), _text(message, "type"))
        self.audit("advertise_service", _text(message, "service"))

    def _unadvertise_service(self, message: Message) -> None:
        self._bridge.calls.withdraw(self, _text(message, "service"))

    def _service_response(self, message: Message) -> None:
        self._bridge.calls.respond(
            self,
            _text(message, "service"),
            _text(message, "id"),
            message.get("values"),
            bool(message.get("result", True)),
        )

    def _send_action_goal(self, message: Message) -> None:
        bridge, key, action = self._bridge, _id(message), self._bridge.resolve(_text(message, "action"))
        try:
            self.role.check("action", action)
            self._limit(bridge.goals.count(self))
            is_command = not matches(action, READING_ACTIONS)
            if is_command:
                bridge.control.command(self)
            bridge.goals.send(
                self,
                key,
                _text(message, "action"),
                message.get("args"),
                feedback=bool(message.get("feedback", False)),
            )
        except BridgeError as error:
            answer = {"op": "action_result", "action": message["action"], "values": str(error)}
            answer = answer if key is None else {**answer, "id": key}
            self.send_values({**answer, "status": GoalStatus.STATUS_UNKNOWN, "result": False})
            raise
        if is_command:
            self.audit("send_action_goal", action, message.get("args"))

    def _cancel_action_goal(self, message: Message) -> None:
        self._bridge.goals.cancel(self, _id(message), _text(message, "action"))
        self.audit("cancel_action_goal", _text(message, "action"))

    def _advertise_action(self, message: Message) -> None:
        self._may_offer()
        self._limit(self._bridge.goals.count(self))
        self._bridge.goals.offer(self, _text(message, "action"), _text(message, "type"))
        self.audit("advertise_action", _text(message, "action"))

    def _unadvertise_action(self, message: Message) -> None:
        self._bridge.goals.withdraw(self, _text(message, "action"))

    def _action_feedback(self, message: Message) -> None:
        self._bridge.goals.feedback(
            self, _text(message, "action"), _text(message, "id"), message.get("values")
        )

    def _action_result(self, message: Message) -> None:
        self._bridge.goals.result(
            self,
            _text(message, "action"),
            _text(message, "id"),
            message.get("values"),
            _whole(message, "status", GoalStatus.STATUS_SUCCEEDED),
            bool(message.get("result", True)),
        )

    def _set_level(self, message: Message) -> None:
        level = _text(message, "level")
        if level not in _LEVELS:
            raise BridgeError(f"the level {level[:80]!r} is not known; valid: {', '.join(_LEVELS)}")
        self._level = _LEVELS.index(level)

    def _fragment(self, message: Message) -> None:
        whole = self._fragments.add(message, self._bridge.now_s())
        if whole is not None and whole.get("op") == "fragment":
            raise BridgeError("a fragment of fragments")
        if whole is not None:
            self.handle(whole)

    def _limit(self, count: int) -> None:
        most = self._bridge.limits.subscriptions
        if count >= most:
            raise BridgeError(f"a client has {most} subscriptions, calls or goals at a time, and no more")

    def _may_offer(self) -> None:
        if not self.role.may_offer:
            raise RefusedError(f"the role {self.role.name} may not offer services or actions")


def _text(message: Message, field: str) -> str:
    value = message.get(field)
    if not isinstance(value, str) or not value:
        raise BridgeError(f"{message.get('op', 'a message')!s:.40} needs {field}, a text")
    return value


def _id(message: Message) -> str | None:
    value = message.get("id")
    if value is not None and (not isinstance(value, str) or len(value) > _LONGEST_TEXT):
        raise BridgeError(f"the id of a message is a text of {_LONGEST_TEXT} characters at most")
    return value


def _number(message: Message, field: str) -> float:
    value = message.get(field, 0)
    value = 0 if value is None else value
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float))
        or not (value >= 0 and math.isfinite(value))
    ):
        raise BridgeError(f"{field} is a number that is not negative")
    return float(value)


def _whole(message: Message, field: str, default: int) -> int:
    value = message.get(field, default)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**31:
        raise BridgeError(f"{field} is a whole number that is not negative")
    return value
