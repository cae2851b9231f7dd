"""R2-D2's state publisher of the URDF tutorial: a circle in `odom`, while its joints sweep."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.msgs import Float64MultiArray, MultiArrayLayout
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.geometry import Pose2, Pose3
from twin.nodes.missions.mission_node import MissionNode
from twin.nodes.navigation.robot_pose import Frames
from twin.periods import period_of

_DEGREE = math.pi / 180.0
_SWEEPS = {"tilt": (-0.5, 0.0), "periscope": (0.0, 0.2)}
_HEIGHT = 0.7
"""z of `axis` in `odom`, as the tutorial publishes it [m]."""


class R2D2StatePublisherNode(MissionNode):
    """Publishes odom → axis and moves the base there; sends the joints' targets to `/position_controller`.

    Each cycle the angle on the circle and swivel grow, tilt sweeps 0 … −0.5 by 1°, periscope 0 … 0.2 by
    5 mm, as in the tutorial; there the periscope's limits were −0.5 … 0, and it never was within them.
    """

    def __init__(
        self,
        bus: Bus,
        *,
        joints: Sequence[str],
        frames: Frames,
        move_base: Callable[[Pose2], None],
        radius: float = 2.0,
        rate_hz: float = 30.0,
        degrees_per_cycle: float = 0.25,
        namespace: str = "",
    ) -> None:
        super().__init__(bus, namespace=namespace)
        self._joints = tuple(joints)
        self._frames = frames
        self._move_base = move_base
        self._radius = radius
        self._step = degrees_per_cycle * _DEGREE
        self._angle = 0.0
        self._positions = {"tilt": 0.0, "swivel": 0.0, "periscope": 0.0}
        self._rates = {"tilt": -_DEGREE, "swivel": _DEGREE, "periscope": 0.005}
        self._tf = TransformBroadcaster(self.node)
        self._commands = self.node.create_publisher(Float64MultiArray, "position_controller/commands", 1)
        self.node.create_timer(period_of(rate_hz), self._cycle)

    def _cycle(self) -> None:
        if self.done:
            return
        if self.state == "start":
            self.enter("driving the circle")
        a = self._angle
        pose = Pose2(self._radius * math.cos(a), self._radius * math.sin(a), a + math.pi / 2.0)
        self._move_base(pose)
        T_odom_axis = Pose3.from_pose2(pose, _HEIGHT)
        self._tf.send_transform(
            transform_stamped(self._frames.odom, self._frames.base, self.node.now_ns, T_odom_axis)
        )
        layout = MultiArrayLayout(dim=[], data_offset=0)
        targets = np.array([self._positions[joint] for joint in self._joints])
        self._commands.publish(Float64MultiArray(layout=layout, data=targets))
        self._advance()
        if self._angle > 2.0 * math.pi:
            self.finish(succeeded=True)

    def _advance(self) -> None:
        self._angle += self._step
        for joint, rate in self._rates.items():
            self._positions[joint] += rate
        for joint, (low, high) in _SWEEPS.items():
            if not low <= self._positions[joint] <= high:
                self._rates[joint] = -self._rates[joint]
                self._positions[joint] += 2.0 * self._rates[joint]
