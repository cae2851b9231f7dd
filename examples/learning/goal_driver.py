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
from twin.envs.agent import DrivingAgent
from twin.nodes.missions.mission_node import MissionNode
from twin.parameters import Metres, Positive, Seconds
from twin.runtime.defaults.from_description import scan_lidar

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
        beams: Annotated[int, Positive] = 36
        """Of a scan, as in training."""
        farthest: Annotated[Metres, Positive] = 15.0
        """Goals farther away look so far, as in training."""
        patience: Annotated[Seconds, Positive] = 30.0
        """Time for the way."""

    def __init__(self, context, config):
        super().__init__(context.bus, namespace=context.namespace)
        robot = context.robot
        self.config = config
        self.policy = Policy.load(Path(__file__).parent / config.policy)
        self.agent = DrivingAgent(
            robot.drive.config.drive,
            scan_lidar(robot.handle.description),
            beams=config.beams,
            points=1,
            farthest=config.farthest,
        )
        self.goal = np.array([config.ahead, config.left])
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
        pose, twist, agent = self.odometry.pose.pose, self.odometry.twist.twist, self.agent
        here = np.array([pose.position.x, pose.position.y])
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        left = math.dist(here, self.goal)
        if left < self.config.tolerance or self.node.now_ns > self.config.patience * 1e9:
            self.commands.publish(twist_from_planar(0.0, 0.0))
            if left >= self.config.tolerance:
                self.note(f"{left:.1f} m to go after {self.config.patience:g} s")
            self.finish(succeeded=left < self.config.tolerance)
            return
        seen = agent.observe(
            poses=np.array([[*here, yaw]]),
            points=self.goal[None, None],
            velocities=np.array([[twist.linear.x, twist.angular.z]]),
            actions=self.action[None],
            ranges=agent.ranges(scan)[None],
        )
        self.action = np.asarray(self.policy(seen)[0], float)
        v, w = agent.velocities(self.action)
        self.commands.publish(twist_from_planar(float(v), float(w)))
