"""What people see of a run: pictures, or a viewer."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from twin.envs.scenario.episode import Episode

if TYPE_CHECKING:
    from twin.envs.pictures import Camera


_GOAL_M = 0.15
"""Radius of the disc where a goal is."""


class Screen:
    """Opened when it is first needed, and kept for all runs of an environment."""

    def __init__(self, mode: str | None, width: int, height: int) -> None:
        """Take the mode of `gymnasium.Env.render`, and the size of pictures [pixels]."""
        self._mode, self._size = mode, (width, height)
        self._held = ExitStack()
        self._camera: Camera | None = None
        self._of: Any = None
        self._address: str | None = None
        self.page_url: str | None = None
        """Address of the viewer in a browser; None if it has a window of its own, or there is none."""

    @property
    def address(self) -> str | None:
        """Where a run is shown while it goes on; None unless the mode is `human`.

        Raises:
            RecordingError: There is no viewer, or it does not start.
        """
        if self._mode == "human" and self._address is None:
            from twin.recording.player import has_display
            from twin.recording.view.live_viewer import live_viewer

            viewer = self._held.enter_context(live_viewer(web=not has_display()))
            self._address, self.page_url = viewer.data_url, viewer.page_url
        return self._address

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
        self._held.close()
        self._address = self.page_url = None

    def _close_camera(self) -> None:
        if self._camera is not None:
            self._camera.close()
            self._camera = self._of = None
