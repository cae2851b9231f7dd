"""Which frame a message is drawn in: the true body of the simulator, or a frame of the robot's own belief.

The truth lives in `world` with one frame per body (`robot/base_link`). What the robot believes (`map` ->
`odom` -> `base_footprint`, REP-105) keeps its ROS names; with several robots they start with the namespace
(`/r1/odom`), so that they differ from the bodies (`r1/base_footprint`).
"""

from __future__ import annotations

from collections.abc import Sequence

WORLD = "world"
"""Root of the frame tree. The map frame of every robot coincides with it."""

BELIEF_FRAMES = ("map", "odom")
"""Frames of REP-105 that only exist in the robot's belief; whatever hangs below them is the robot."""


class Frames:
    """Names of frames for the messages of a run."""

    def __init__(self, body_names: Sequence[str]) -> None:
        """Index the bodies; `body_names` are `<robot>/<link>` for robots."""
        self._bodies = frozenset(body_names)
        self.robots: tuple[str, ...] = tuple(
            dict.fromkeys(name.split("/", 1)[0] for name in body_names if "/" in name)
        )

    def split(self, topic: str) -> tuple[str, str]:
        """Return namespace ('' or a robot's name) and the topic's name inside it.

        >>> Frames(["r1/base", "r2/base"]).split("/r1/scan")
        ('r1', 'scan')
        """
        name = topic.lstrip("/")
        head, _, tail = name.partition("/")
        return (head, tail) if tail and head in self.robots else ("", name)

    def robot(self, namespace: str) -> str:
        """Return the robot that owns a namespace; the root namespace belongs to the first robot."""
        if namespace:
            return namespace
        return self.robots[0] if self.robots else "robot"

    def body(self, namespace: str, frame_id: str) -> str | None:
        """Return the body that a message's frame id means, if there is one."""
        link = self._link(namespace, frame_id)
        name = f"{self.robot(namespace)}/{link}"
        return name if name in self._bodies else None

    def belief(self, namespace: str, frame_id: str) -> str:
        """Return the frame's name in the robot's belief."""
        link = self._link(namespace, frame_id)
        return f"/{namespace}/{link}" if namespace else link

    @staticmethod
    def _link(namespace: str, frame_id: str) -> str:
        link = frame_id.lstrip("/")
        return link.removeprefix(f"{namespace}/") if namespace else link
