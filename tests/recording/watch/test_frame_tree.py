"""Frames of a graph: each has one way to `world`, by tf, else by what a robot is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from twin.bridge.msgs import TFMessage
from twin.bridge.tf import transform_stamped
from twin.geometry import Pose3
from twin.recording.watch.frame_tree import FrameTree, GraphFrames
from twin.recording.watch.graph_time import GraphTime

S = 1_000_000_000


def told(tree: FrameTree, now_ns: int) -> dict[str, str]:
    """Parents by child, as sent last."""
    found: dict[str, str] = {}
    for _, _, columns in tree.take_chunks(now_ns):
        by_name = {column.descriptor.component: column.array.flatten().to_pylist() for column in columns}
        parents, children = by_name["Transform3D:parent_frame"], by_name["Transform3D:child_frame"]
        found |= dict(zip(children, parents, strict=True))
    return found


def take(tree: FrameTree, time: GraphTime, *links: tuple[Any, ...], namespace: str = "") -> None:
    transforms = [transform_stamped(parent, child, at, pose) for parent, child, at, pose in links]
    tree.take_transforms(namespace, TFMessage(transforms), time, static=False)


@pytest.fixture
def frames() -> GraphFrames:
    return GraphFrames()


def test_a_root_is_in_the_world_until_it_has_a_parent(frames: GraphFrames) -> None:
    tree, time = FrameTree(frames), GraphTime(S, simulated=True)
    at = Pose3.from_xyz_rpy((1.0, 0.0, 0.0))
    take(tree, time, ("odom", "base", S, at))
    assert told(tree, S) == {"odom": "world", "base": "odom"}
    assert told(tree, S) == {}  # nothing has moved
    take(tree, time, ("map", "odom", S, at))
    assert told(tree, S) == {"odom": "map", "map": "world"}
    assert told(tree, 20 * S) == {"map": "world", "odom": "map", "base": "odom"}  # for who comes late


def test_what_comes_late_is_shown_after_what_was(frames: GraphFrames) -> None:
    tree, time = FrameTree(frames), GraphTime(S, simulated=True)
    time.advance(3 * S)
    take(tree, time, ("odom", "base", 3 * S, Pose3.from_xyz_rpy()))
    told(tree, 3 * S)
    take(tree, time, ("map", "odom", 2 * S, Pose3.from_xyz_rpy()))
    ((_, times, columns),) = tree.take_chunks(3 * S)
    children = columns[3].array.flatten().to_pylist()
    assert times is not None
    shown_ns = times.array.cast("int64").to_pylist()[children.index("odom")]
    assert shown_ns == 3 * S  # else that it was in the world would be the latest


def test_a_pose_is_that_of_its_stamp(frames: GraphFrames) -> None:
    tree, time = FrameTree(frames), GraphTime(S, simulated=True)
    for i in range(3):
        turned = Pose3.from_xyz_rpy((float(i), 0.0, 0.0), (0.0, 0.0, math.pi / 2.0))
        take(tree, time, ("odom", "base", (1 + i) * S, turned))
    tree.stamp_ns = 3 * S // 2
    np.testing.assert_allclose(tree.pose("base").xyz, (0.5, 0.0, 0.0), atol=1e-9)
    tree.stamp_ns = 9 * S  # not known yet: the latest
    np.testing.assert_allclose(tree.pose("base").xyz, (2.0, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(tree.pose("nowhere").xyz, np.zeros(3))


def test_robots_with_a_tf_of_their_own_do_not_share_frames(frames: GraphFrames) -> None:
    frames.add("r1")
    tree, time = FrameTree(frames), GraphTime(S, simulated=True)
    take(tree, time, ("odom", "base", S, Pose3.from_xyz_rpy((1.0, 0.0, 0.0))), namespace="r1")
    assert told(tree, S) == {"/r1/odom": "world", "/r1/base": "/r1/odom"}
    assert frames.split("/r1/scan") == ("r1", "scan")
    assert frames.body("r1", "base") == "/r1/base"
    assert frames.body("r1", "odom") is None
    np.testing.assert_allclose(tree.pose("/r1/base").xyz, (1.0, 0.0, 0.0))


def test_what_cannot_be_is_left_out(frames: GraphFrames) -> None:
    tree, time = FrameTree(frames), GraphTime(S, simulated=True)
    nan = Pose3.from_xyz_rpy((math.nan, 0.0, 0.0))
    take(tree, time, ("odom", "base", S, nan), ("a", "a", S, Pose3.from_xyz_rpy()))
    take(tree, time, ("a", "b", S, Pose3.from_xyz_rpy()), ("b", "a", S, Pose3.from_xyz_rpy()))  # a ring
    told(tree, S)
    assert np.isfinite(tree.pose("a").xyz).all()
    assert "base" not in tree
