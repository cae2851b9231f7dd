"""Dock and grasp by rules in `twin/WarehousePick-v0`: `python examples/python/pick_tote.py`."""

from __future__ import annotations

from collections.abc import Mapping

import gymnasium as gym
import numpy as np

STEP_S = 0.1
STOP, DEPTH = 0.56, 0.15
"""From the base to the tote's face when the robot reaches for it, and from there to its middle [m]."""


class Rules:
    """Look for the tote, drive up to it, reach, close the gripper, lift."""

    def __init__(self) -> None:
        self.doing = self.look
        self.middle, self.gripped_s = 0.0, 0.0

    def __call__(self, seen: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return (forward, turn, lift, reach, gripper)."""
        action = self.doing(seen)
        if self.doing != self.lift:
            action[2] = np.clip(-5.0 * seen["grasp"][1], -1.0, 1.0)  # to the height of the tote's middle
        return action

    def look(self, seen: Mapping[str, np.ndarray]) -> np.ndarray:
        """Wait until the palm is as high as the tote and sees it."""
        if abs(seen["grasp"][1]) < 0.01 and seen["age"][0] < 0.3:
            self.doing = self.drive
        return np.array([0.0, 0.0, 0.0, 0.0, -1.0])

    def drive(self, seen: Mapping[str, np.ndarray]) -> np.ndarray:
        """Drive up along the line straight before the tote."""
        x, y, yaw = seen["tote_poses"].tolist()
        aside = np.sin(yaw) * x - np.cos(yaw) * y  # of the robot, from the line straight before the tote
        if x < STOP + 0.015:
            self.doing = self.aim
        turn = -4.0 * aside + 2.0 * yaw
        return np.array([np.clip(4.0 * (x - STOP), 0.0, 1.0), np.clip(turn / 0.6, -1.0, 1.0), 0.0, 0.0, -1.0])

    def aim(self, seen: Mapping[str, np.ndarray]) -> np.ndarray:
        """Turn to the tote."""
        x, y, _ = seen["tote_poses"].tolist()
        if abs(y) < 0.012:
            self.middle, self.doing = x + DEPTH, self.reach
        return np.array([0.0, np.clip(3.0 * y, -1.0, 1.0), 0.0, 0.0, -1.0])

    def reach(self, seen: Mapping[str, np.ndarray]) -> np.ndarray:
        """Bring the tote between the fingers."""
        to_go = self.middle - seen["grasp"][0]
        if abs(to_go) < 0.01:
            self.doing = self.grip
        return np.array([0.0, 0.0, 0.0, np.clip(4.0 * to_go, -1.0, 1.0), -1.0])

    def grip(self, seen: Mapping[str, np.ndarray]) -> np.ndarray:
        """Close them."""
        self.gripped_s += STEP_S
        if self.gripped_s > 1.2:
            self.doing = self.lift
        return np.array([0.0, 0.0, 0.0, 0.0, 1.0])

    def lift(self, seen: Mapping[str, np.ndarray]) -> np.ndarray:
        """Lift."""
        return np.array([0.0, 0.0, 0.4, 0.0, 1.0])


def main() -> None:
    """Pick the tote from some places."""
    env = gym.make("twin.envs:twin/WarehousePick-v0")
    for seed in (1, 2):
        rules, over, total = Rules(), False, 0.0
        observation, info = env.reset(seed=seed)
        while not over:
            observation, reward, terminated, truncated, info = env.step(rules(observation))
            total, over = total + reward, terminated or truncated
        done = "picked" if info["is_success"] else "not picked"
        print(f"seed {seed}: {done} after {info['time_s']:.1f} s, reward {total:.1f}")
    env.close()


if __name__ == "__main__":
    main()
