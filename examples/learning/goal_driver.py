"""A mission: what was learned drives to a point. It sees the topics `scan` and `odom`, nothing else."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import LaserScan, Odometry, Twist
from twin.nodes.missions.mission_node import MissionNode
from twin.parameters import Metres, MetresPerSecond, Positive, RadiansPerSecond, Seconds

sys.path.insert(0, str(Path(__file__).parent))
from ppo import Policy


class GoalDriver(MissionNode):
    """`cmd_vel` for each scan, until the goal is reached by odometry."""

    @dataclass(frozen=True, kw_only=True)
    class Config:
        """Where to, with what, and what was so in training."""

        ahead: Metres
        """Goal in `odom`: along x, where the robot looks at the start."""
        left: Metres
        """... and along y."""
        policy: str = "goal.npz"
        """File, from the folder of this one on."""
        tolerance: Annotated[Metres, Positive] = 0.25
        """Distance at which the goal is reached."""
        max_linear: Annotated[MetresPerSecond, Positive] = 1.0
        """Speed of action 1, as in training."""
        max_angular: Annotated[RadiansPerSecond, Positive] = 3.0
        """Rate of action 1, as in training."""
        beams: Annotated[int, Positive] = 36
        """Of a scan, as in training."""
        far: Annotated[Metres, Positive] = 15.0
        """Goals farther away look so far, as in training."""
        patience: Annotated[Seconds, Positive] = 30.0
        """Time for the way."""

    def __init__(self, context, config):
        super().__init__(context.bus, namespace=context.namespace)
        self.config = config
        self.policy = Policy.load(Path(__file__).parent / config.policy)
        self.action = np.zeros(2)
        self.odometry = None
        self.commands = self.node.create_publisher(Twist, "cmd_vel", 10)
        self.node.create_subscription(Odometry, "odom", self.move, 10)
        self.node.create_subscription(LaserScan, "scan", self.look, 10)
        self.enter("driving")

    def move(self, message):
        """Keep where the wheels say that it is."""
        self.odometry = message

    def look(self, scan):
        """Decide what to do until the next scan."""
        if self.done or self.odometry is None:
            return
        config = self.config
        position, q = self.odometry.pose.pose.position, self.odometry.pose.pose.orientation
        yaw = 2.0 * math.atan2(q.z, q.w)
        x, y = config.ahead - position.x, config.left - position.y
        distance, bearing = math.hypot(x, y), math.atan2(y, x) - yaw
        if distance < config.tolerance or self.node.now_ns > config.patience * 1e9:
            self.commands.publish(twist_from_planar(0.0, 0.0))
            if distance >= config.tolerance:
                self.note(f"{distance:.1f} m to go after {config.patience:g} s")
            self.finish(succeeded=distance < config.tolerance)
            return
        ranges = np.asarray(scan.ranges)[:: len(scan.ranges) // config.beams]
        ranges = np.clip(np.nan_to_num(ranges, nan=scan.range_max), 0.0, scan.range_max)
        speeds = self.odometry.twist.twist.linear.x, self.odometry.twist.twist.angular.z
        polar = min(distance, config.far), math.cos(bearing), math.sin(bearing)
        self.action = self.policy(np.array([*polar, *speeds, *self.action, *ranges]))
        v, w = self.action * (config.max_linear, config.max_angular)
        self.commands.publish(twist_from_planar(float(v), float(w)))
