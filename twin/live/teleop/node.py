"""The node `teleop`: publishes what keys and gamepad ask for, and zeros when they ask for nothing more."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.bridge.msgs import Twist, TwistStamped, Vector3, header
from twin.errors import TwinError
from twin.live.teleop.gamepad import Gamepad
from twin.live.teleop.keys import STILL, Command, Keys

_PERIOD_NS = 50_000_000
_ZEROS_NS = 500_000_000
"""So long zeros are sent after the last command; then others may drive."""
_STAMPED = "geometry_msgs/msg/TwistStamped"
_TWIST = "geometry_msgs/msg/Twist"
_INPUTS = ("guard/teleop", "cmd_vel_teleop", "cmd_vel", "turtle1/cmd_vel")
"""Where robots listen: a guard's, a multiplexer's, a drive's, the turtle's; the first one with a listener."""


def in_namespace(namespace: str, topic: str) -> str:
    """Return the absolute name of a topic."""
    return topic if topic.startswith("/") else f"/{namespace.strip('/')}/{topic}".replace("//", "/")


def listened_to(graph: Graph, namespace: str = "") -> str | None:
    """Return the topic in a namespace on which a robot can be driven by hand; None: nobody listens."""
    names = (in_namespace(namespace, name) for name in _INPUTS)
    return next((name for name in names if _types(graph, name)), None)


def is_stamped(graph: Graph, topic: str) -> bool:
    """Whether those who listen to a topic want stamps: somebody does, and nobody wants none."""
    return _types(graph, topic) == {_STAMPED}


def _types(graph: Graph, topic: str) -> set[str]:
    return {each.type for each in graph.subscriptions(topic)} & {_TWIST, _STAMPED}


class TeleopNode:
    """Publishes at 20 Hz while somebody drives, and for half a second after that."""

    def __init__(
        self,
        bus: Bus,
        keys: Keys,
        *,
        topic: str,
        stamped: bool = False,
        frame: str = "",
        gamepad: Gamepad | None = None,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Begin at standstill, and silent.

        Args:
            bus: Of its process.
            keys: What keys ask for.
            topic: Where it publishes.
            stamped: Whether as TwistStamped.
            frame: In the stamps.
            gamepad: Goes before keys while its button is held.
            monotonic_ns: A clock that is never set [ns].
        """
        self.node = bus.create_node("teleop")
        self._keys, self._gamepad, self._now, self._frame = keys, gamepad, monotonic_ns, frame
        self._stamped = stamped
        kind: type[Any] = TwistStamped if stamped else Twist
        self._publisher = self.node.create_publisher(kind, topic, 1)
        self.command = STILL
        """What it asks for now."""
        self._driven_ns: int | None = None
        self.node.create_timer(_PERIOD_NS, self.update)

    @property
    def topic(self) -> str:
        """Where it publishes."""
        return self._publisher.name

    def press(self, key: str) -> None:
        """Take a key, and go by it at once."""
        self._keys.press(key, self._now())
        self.update()

    def update(self) -> None:
        """Publish, if there is something to say."""
        now_ns = self._now()
        by_hand = None
        if self._gamepad is not None:
            by_hand = self._gamepad.command(self._keys.speed, self._keys.turn)
        self.command = self._keys.command(now_ns) if by_hand is None else by_hand
        if self.command != STILL:
            self._driven_ns = now_ns
        if self._driven_ns is not None:
            self._publish(self.command)
            if now_ns - self._driven_ns > _ZEROS_NS:
                self._driven_ns = None

    def close(self) -> None:
        """Leave the robot standing still, unless somebody else drives it."""
        if self._driven_ns is not None:
            self._publish(STILL)
        self._driven_ns = None

    def _publish(self, command: Command) -> None:
        twist = Twist(Vector3(command.x, command.y, command.z), Vector3(0.0, 0.0, command.yaw))
        message = TwistStamped(header(self.node.now_ns, self._frame), twist) if self._stamped else twist
        self._publisher.publish(message, frozen=True)


def nobody_listens(namespace: str) -> TwinError:
    """Return the fault of a graph without a robot to drive."""
    names = ", ".join(_INPUTS)
    where = f"/{namespace.strip('/')}".rstrip("/") or "/"
    return TwinError(f"nobody in {where} listens to one of {names}: name the topic with --topic")
