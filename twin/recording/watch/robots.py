"""Robots of a graph: drawn as their descriptions say, with a trail where they went."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from twin.errors import ModelError
from twin.models.description import RobotDescription
from twin.models.loader import parse_urdf
from twin.models.options import ReadOptions
from twin.recording.channels.belief import ESTIMATE_COLOUR, FLOOR_HEIGHT
from twin.recording.columns import STRIPS, Chunk, sim_time
from twin.recording.extents import RobotBox
from twin.recording.frames import WORLD, Frames
from twin.recording.shapes import Drawing, Solid, draw_solids, rgba8
from twin.recording.view.posture import Posture
from twin.recording.view.robot_view import extent
from twin.recording.watch.frame_tree import FrameTree, GraphFrames

_PATIENCE_NS = 1_000_000_000
"""How long a robot waits for the transforms that tell its frames' prefix."""
_STEP_M = 0.05
"""Length of a segment of a trail."""
_LEAP_M = 1.0
"""Who is found so far away was not driven there."""
_READ = ReadOptions(missing_mesh="skip")
"""Meshes of another computer are not here."""


class _Robot:
    def __init__(self, name: str, description: RobotDescription) -> None:
        self.name, self.description = name, description
        self.prefix: str | None = None
        """Of its frames, once they are known."""
        self.waits_until_ns = 0
        self.positions: dict[str, float] = {}
        self.end: tuple[float, float, float] | None = None
        """Of its trail."""


class Robots:
    """All robots that tell what they look like."""

    def __init__(self, recording: rr.RecordingStream, frames: GraphFrames, tree: FrameTree) -> None:
        self._recording, self._frames, self._tree = recording, frames, tree
        self._robots: dict[str, _Robot] = {}
        self._texts: dict[str, str] = {}
        self._faults: list[str] = []
        self.boxes: list[RobotBox] = []
        """Around those that are drawn."""
        self.wheels: dict[str, set[str]] = {}
        """By robot: joints that turn without end."""

    def describe(self, topic: str, text: str) -> None:
        """Take a robot's description, URDF."""
        if self._texts.get(topic) == text:
            return
        self._texts[topic] = text
        try:
            description = parse_urdf(text, Path(topic.strip("/")).absolute(), _READ)
        except ModelError as fault:
            self._faults.append(f"the robot of {topic}: {str(fault).splitlines()[0]}")
            return
        if description.skipped_meshes:
            self._faults.append(
                f"{len(description.skipped_meshes)} meshes of {topic}, whose files are not here"
            )
        name = _namespace(topic) or "robot"
        self._robots[topic] = _Robot(name, description)
        joints = description.joints.values()
        self.wheels[name] = {joint.name for joint in joints if joint.type == "continuous"}

    def move(self, topic: str, state: Any, time_ns: int) -> None:
        """Take a JointState."""
        for described, robot in self._robots.items():
            if _namespace(described) == _namespace(topic):
                told = zip(state.name, np.asarray(state.position).tolist(), strict=False)
                robot.positions.update((name, at) for name, at in told if math.isfinite(at))
                if robot.prefix is not None:
                    self._tree.take_joints(robot.description, robot.prefix, robot.positions, time_ns)

    def draw(self, now_ns: int) -> list[str]:
        """Draw who is new, at a time of the screen [ns]; return what cannot be drawn, in words."""
        for topic, robot in self._robots.items():
            if robot.prefix is not None:
                continue
            robot.waits_until_ns = robot.waits_until_ns or now_ns + _PATIENCE_NS
            robot.prefix = self._prefix(topic, robot, may_guess=now_ns >= robot.waits_until_ns)
            if robot.prefix is not None:
                self._draw(robot, robot.prefix, now_ns)
        faults, self._faults = self._faults, []
        return faults

    def trails(self, now_ns: int) -> Iterator[Chunk]:
        """Yield where robots went since."""
        for robot in self._robots.values():
            if robot.prefix is None:
                continue
            self._tree.stamp_ns = 0
            x, y, _ = self._tree.pose(robot.prefix + robot.description.root).xyz.tolist()
            point = (x, y, FLOOR_HEIGHT)
            start = robot.end = robot.end or point
            step = math.dist(start, point)
            if step >= _STEP_M:
                robot.end = point
            if _STEP_M <= step < _LEAP_M:
                segment = np.array((start, point), dtype=np.float32)
                yield f"/trails/{robot.name}/estimate", sim_time([now_ns]), (STRIPS.column([segment]),)

    def _prefix(self, topic: str, robot: _Robot, *, may_guess: bool) -> str | None:
        """Return what the robot's frames begin with; None if that may still become known."""
        namespace = self._frames.split(topic)[0]
        links = robot.description.links
        own = Frames.belief(self._frames, namespace, "") if namespace else ""
        for prefix in (own, f"{_namespace(topic)}/"):
            if any(prefix + link in self._tree for link in links):
                return prefix
        return own if may_guess else None

    def _draw(self, robot: _Robot, prefix: str, now_ns: int) -> None:
        description = robot.description
        drawings = [
            Drawing(
                f"/world/{robot.name}" + rr.new_entity_path([link.name]),
                prefix + link.name,
                [Solid(item.geometry, item.T_link_geometry, rgba8(item.rgba)) for item in link.visuals],
            )
            for link in description.links.values()
        ]
        draw_solids(self._recording, drawings)
        self._frames.used.add(prefix + description.root)
        self._tree.take_joints(description, prefix, robot.positions, now_ns)
        low, high = extent(description, Posture(description))
        box = RobotBox(robot=robot.name, base=prefix + description.root, low=low, high=high)
        self.boxes = [each for each in self.boxes if each.robot != robot.name] + [box]
        look = rr.LineStrips3D.from_fields(colors=[ESTIMATE_COLOUR], radii=rr.Radius.ui_points(0.8))
        self._recording.log(f"/trails/{robot.name}/estimate", look, rr.CoordinateFrame(WORLD), static=True)


def _namespace(topic: str) -> str:
    return topic.strip("/").rpartition("/")[0]
