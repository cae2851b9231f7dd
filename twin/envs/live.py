"""An environment in Rerun's viewer, while it is stepped."""

from __future__ import annotations

import mujoco
import numpy as np

from twin.envs.simulations import Simulations
from twin.geometry import Array
from twin.recording.view.episode_view import EpisodeView
from twin.sim.scene import Scene


class LiveWindow:
    """Shows the first of some simulations."""

    def __init__(self, simulations: Simulations, looks: Scene) -> None:
        """Start the viewer.

        Args:
            simulations: Whose first is shown.
            looks: Its scene, perhaps with more that never moves.

        Raises:
            RecordingError: There is no viewer, or it does not start.
        """
        self._simulations = simulations
        model = simulations.model
        self._data = mujoco.MjData(model)
        named = [(i, model.body(i).name) for i in range(1, model.nbody) if model.body(i).name]
        self._bodies = np.array([i for i, _ in named])
        self._names = [name for _, name in named]
        poses = {static.name: static.T_world_body for static in looks.statics}
        self.view = EpisodeView(simulations.robot.shapes(looks), poses.__getitem__)

    def begin(self, name: str, goal: tuple[float, float], tolerance: float) -> None:
        """Show a new episode, and its goal: a disc of a radius around x, y [m]."""
        self.view.begin(name, goal, tolerance)

    def show(self, time_ns: int, seen: Array) -> None:
        """Show the present, `time_ns` after the begin, and what the lidar sees, shape (n, 3) [m]."""
        data, simulations = self._data, self._simulations
        data.qpos[:] = simulations.qpos[0]
        data.mocap_pos[:], data.mocap_quat[:] = simulations.mocap_pos[0], simulations.mocap_quat[0]
        mujoco.mj_kinematics(simulations.model, data)
        self.view.show(time_ns, self._names, data.xpos[self._bodies], data.xquat[self._bodies], seen)

    def close(self) -> None:
        """End the viewer."""
        self.view.close()
