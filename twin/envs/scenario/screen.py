"""What people see of a run: pictures, or a viewer."""

from __future__ import annotations

import logging
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from twin.envs.scenario.episode import Episode

if TYPE_CHECKING:
    from twin.envs.picture import Painter

_DISTANCE_M = 5.0
"""From the robot to who looks at it."""
_GOAL_M, _GOAL_RGBA = 0.15, (0.15, 0.7, 0.25, 0.9)
"""Radius and colour of the disc at the goal."""


class Screen:
    """Opened when it is first needed, and kept for all runs of an environment."""

    def __init__(self, mode: str | None, width: int, height: int) -> None:
        """Take the mode of `gymnasium.Env.render`, and the size of pictures [pixels]."""
        self._mode, self._size = mode, (width, height)
        self._held = ExitStack()
        self._painter: Painter | None = None
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
            if self.page_url:
                logging.getLogger("twin.envs").warning("no display: the viewer is at %s", self.page_url)
        return self._address

    def draw(self, episode: Episode) -> NDArray[np.uint8] | None:
        """Return a picture of the robot and its goal, if the mode is `rgb_array`.

        Raises:
            GymError: This computer can draw nothing.
        """
        if self._mode != "rgb_array":
            return None
        from twin.envs.picture import Mark, Painter

        world, goal = episode.world, episode.task.goal
        if self._painter is None or self._of is not world:
            self._close_painter()
            width, height = self._size
            self._painter, self._of = Painter(world.model_to_see(), width=width, height=height), world
        at, data = world.pose(episode.stack.handle.base).xyz, world.data
        marks = [] if goal is None else [Mark((goal.x, goal.y), _GOAL_M, _GOAL_RGBA)]
        return self._painter.draw((data.qpos, data.mocap_pos, data.mocap_quat), marks, at, _DISTANCE_M)

    def close(self) -> None:
        """End both. Harmless when repeated."""
        self._close_painter()
        self._held.close()
        self._address = self.page_url = None

    def _close_painter(self) -> None:
        if self._painter is not None:
            self._painter.close()
            self._painter = self._of = None
