"""The simulator's truth, to look at."""

from __future__ import annotations

from typing import TYPE_CHECKING

from twin.geometry import Pose3

if TYPE_CHECKING:
    import mujoco

    from twin.sim.contacts import Contact
    from twin.sim.world import World as SimWorld


class Truth:
    """Where everything really is, which no node knows; to look at it changes nothing."""

    def __init__(self, world: SimWorld) -> None:
        self._world = world

    @property
    def time_ns(self) -> int:
        """Simulated time since the start [ns]."""
        return self._world.time_ns

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self._world.time_ns * 1e-9

    @property
    def bodies(self) -> tuple[str, ...]:
        """What can move: links as `<robot>/<link>`, and goods."""
        return self._world.body_names

    def pose(self, name: str) -> Pose3:
        """Return where something is, `T_world_body`.

        Args:
            name: Of a robot, which means its root link; of a link, `<robot>/<link>`; of goods; of something
                that never moves.

        Raises:
            ScenarioError: There is nothing of this name.
        """
        robot = self._world.robots.get(name)
        return self._world.pose(name if robot is None else robot.base)

    def contacts(self) -> list[Contact]:
        """Return what robots touch except for the floor and themselves, as of the last physics step."""
        return list(self._world.contacts())

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's model; names are as in `bodies`."""
        return self._world.model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's state. Whoever writes to it changes the run."""
        return self._world.data
