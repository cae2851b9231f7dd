"""A bag of a minute: a robot drives along x at 0.1 m/s, and now and then something happens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.web.hall import walls
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.offered_qos import OfferedQoS
from twin.bridge.bags.writer import BagConfig, BagWriter, Storage
from twin.bridge.cdr.codec import codec
from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import (
    LaserScan,
    Log,
    Odometry,
    PoseArray,
    PoseStamped,
    String,
    TFMessage,
    TransformStamped,
    header,
    new,
    stamp,
)
from twin.bridge.msgs import (
    Path as PathMsg,
)
from twin.geometry import Pose2
from twin.nodes.navigation.mapping.map_server import grid_msg

NS = 1_000_000_000
SECONDS = 60
MISSION = {5: "to the shelf", 35: "to the dock"}
TOTE_S = 25
"""When a tote is seen, from where the robot is then."""
LINES = {10: "all is well", 50: "a wheel slips"}
LATCHED = (OfferedQoS(history="keep_last", depth=1, durability="transient_local"),)


def link(parent: str, child: str, pose: Pose2, now_ns: int) -> Any:
    made = new(TransformStamped, header=header(now_ns, parent), child_frame_id=child)
    made.transform.translation.x, made.transform.translation.y = pose.x, pose.y
    made.transform.rotation = pose_from_pose2(pose).orientation
    return made


def write(folder: Path, storage: Storage = "mcap", seconds: int = SECONDS) -> Path:
    """Write it; log time begins at 0."""
    with BagWriter(folder, BagConfig(storage=storage)) as bag:

        def say(topic: str, now_ns: int, message: Any, qos: Any = ()) -> None:
            form = codec(type(message))
            bag.add_topic(BagTopic(name=topic, type=form.msgtype, qos=qos))
            bag.write(BagMessage(topic, form.encode(message), now_ns, now_ns))

        grid = grid_msg(np.asarray(walls(120, 160), np.int8), 0.05, Pose2(-1.0, -1.0, 0.0), "map", 0)
        say("/map", 0, grid, LATCHED)
        for tenth in range(seconds * 10 + 1):
            now_ns = tenth * NS // 10
            pose = Pose2(tenth / 100, 1.0, 0.0)
            odometry = new(Odometry, header=header(now_ns, "odom"), child_frame_id="base_link")
            odometry.pose.pose = pose_from_pose2(pose)
            odometry.twist.twist.linear.x = 0.1
            say("/odom", now_ns, odometry)
            say("/tf", now_ns, TFMessage([link("odom", "base_link", pose, now_ns)]))
            if tenth % 20 == 0:
                say("/tf", now_ns, TFMessage([link("map", "odom", Pose2(0.0, 0.5, 0.0), now_ns)]))
                scan = new(LaserScan, header=header(now_ns, "base_link"), angle_increment=0.1, range_max=9.0)
                scan.ranges = np.full(60, 1.0, np.float32)
                say("/scan", now_ns, scan)
            second = tenth // 10
            if tenth % 10 == 0 and second in MISSION:
                say("/mission/state", now_ns, String(MISSION[second]))
            if tenth % 10 == 0 and second in LINES:
                line = new(Log, stamp=stamp(now_ns), level=40, name="driver", msg=LINES[second])
                say("/rosout", now_ns, line)
            if tenth == 10 * TOTE_S:
                tote = [pose_from_pose2(Pose2(0.8, 0.6, 0.0))]
                say("/tote_poses", now_ns, PoseArray(header(now_ns, "base_link"), tote))
            if tenth == 300:
                poses = [new(PoseStamped, pose=pose_from_pose2(Pose2(x, 1.0, 0.0))) for x in (3.0, 4.0, 5.0)]
                say("/plan", now_ns, PathMsg(header(now_ns, "map"), poses))
    return folder
