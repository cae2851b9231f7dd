"""What people see of a run: pictures, or a viewer."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from twin.envs.scenario.episode import Episode

if TYPE_CHECKING:
    from twin.envs.pictures import Camera
    from twin.recording.live_screen import LiveScreen


_GOAL_M = 0.15
"""Radius of the disc where a goal is."""


class Screen:
    """Opened when it is first needed, and kept for all runs of an environment."""

    def __init__(self, mode: str | None, width: int, height: int) -> None:
        """Take the mode of `gymnasium.Env.render`, and the size of pictures [pixels]."""
        self._mode, self._size = mode, (width, height)
        self._camera: Camera | None = None
        self._of: Any = None
        self._live: LiveScreen | None = None

    @property
    def live(self) -> LiveScreen | None:
        """Shows a run while it goes on, and is never waited for; None unless the mode is `human`.

        Raises:
            RecordingError: There is no viewer.
        """
        if self._mode == "human" and self._live is None:
            from twin.recording.live_screen import LiveScreen

            self._live = LiveScreen(logging.getLogger("twin.envs").warning)
        return self._live

    @property
    def page_url(self) -> str | None:
        """Address of the viewer in a browser; None if it has a window of its own, or there is none."""
        return None if self._live is None else self._live.page_url

    def draw(self, episode: Episode) -> NDArray[np.uint8] | None:
        """Return a picture of the robot and its goal, if the mode is `rgb_array`.

        Raises:
            SimulationError: This computer can draw nothing.
        """
        if self._mode != "rgb_array":
            return None
        from twin.envs.pictures import Camera, Mark, Placed

        world = episode.world
        if self._camera is None or self._of is not world:
            self._close_camera()
            self._camera, self._of = Camera(world.model_to_see(), *self._size), world
        at, data, goal = world.pose(episode.stack.handle.base).xyz, world.data, episode.task.goal
        placed = Placed(data.qpos, data.mocap_pos, data.mocap_quat)
        marks = () if goal is None else (Mark(goal.x, goal.y, _GOAL_M, yaw=goal.yaw),)
        return self._camera.take(placed, at, marks=marks)

    def close(self) -> None:
        """End both. Harmless when repeated."""
        self._close_camera()
        if self._live is not None:
            self._live.close()
            self._live = None

    def _close_camera(self) -> None:
        if self._camera is not None:
            self._camera.close()
            self._camera = self._of = None
