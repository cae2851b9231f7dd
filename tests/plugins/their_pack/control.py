from dataclasses import dataclass
from typing import Annotated

import numpy as np

from their_pack.used import USED
from twin.navigation.control.controller import Controller
from twin.navigation.control.critic import Critic
from twin.navigation.control.goal_checker import GoalChecker
from twin.navigation.control.progress_checker import ProgressChecker
from twin.parameters import Metres, MetresPerSecond, NotNegative, Positive


class Ahead(Controller):
    """Drives straight on."""

    @dataclass(frozen=True, kw_only=True)
    class Config:
        speed: Annotated[MetresPerSecond, Positive] = 0.3

    @property
    def max_speed(self):
        return self.config.speed

    def compute_velocity_commands(self, now):
        USED.add("Ahead")
        return self.speed, 0.0


class Calm(Critic):
    """Turning is bad."""

    @dataclass(frozen=True)
    class Config:
        weight: Annotated[float, NotNegative] = 1.0

    def score(self, trajectories):
        USED.add(f"Calm {'of MPPI' if trajectories.poses.shape[1] > 1 else 'of DWB'}")
        return self.config.weight * np.abs(trajectories.commands[:, :, 1]).mean(axis=1)


class Near(GoalChecker):
    @dataclass(frozen=True)
    class Config:
        xy_goal_tolerance: Annotated[Metres, Positive] = 0.25

    def is_goal_reached(self, pose, goal, velocity=(0.0, 0.0), remaining=0.0):
        USED.add("Near")
        return pose.distance(goal) < self.config.xy_goal_tolerance


class Patient(ProgressChecker):
    def check(self, pose, time_ns):
        USED.add("Patient")
        return True
