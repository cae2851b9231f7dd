"""`/twist_mux`: passes the velocity command of the live source with the highest priority on."""

from __future__ import annotations

from collections.abc import Callable

from twin.bridge.bus import Bus
from twin.bridge.msgs import Twist
from twin.bridge.topics import Publisher
from twin.controllers.twist_mux import MuxInput, TwistMux

_WHEELS = "cmd_vel"

_INPUTS = (
    MuxInput(name="navigation", topic="cmd_vel_smoothed", priority=10),
    MuxInput(name="docking", topic="cmd_vel_docking", priority=20, guarded=False),
    MuxInput(name="teleop", topic="cmd_vel_teleop", priority=100),
)


class TwistMuxNode:
    """Subscribes to every input's topic and publishes `cmd_vel`, or what comes before it.

    Docking goes past a collision monitor behind it: it is meant to come near to things, and looks at them.
    """

    def __init__(self, bus: Bus, *, output: str = _WHEELS, namespace: str = "") -> None:
        self.node = bus.create_node("twist_mux", namespace)
        self.mux = TwistMux(_INPUTS)
        guarded = direct = self.node.create_publisher(Twist, output, 10)
        if output != _WHEELS:
            direct = self.node.create_publisher(Twist, _WHEELS, 10)
        for source in _INPUTS:
            publisher = guarded if source.guarded else direct
            on_twist = self._callback(source.name, publisher)
            self.node.create_subscription(Twist, source.topic, on_twist, 10, frozen=True)

    def _callback(self, name: str, publisher: Publisher[Twist]) -> Callable[[Twist], None]:
        def on_twist(message: Twist) -> None:
            if self.mux.accept(name, self.node.steady_ns * 1e-9):
                publisher.publish(message, frozen=True)

        return on_twist
