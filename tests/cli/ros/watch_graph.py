"""A graph to watch: `python watch_graph.py ENDPOINT`; it ends when its input is closed."""

from __future__ import annotations

import math
import sys
import threading
from io import BytesIO
from typing import Any

import numpy as np
from PIL import Image

from twin.bridge import live, types
from twin.bridge.msgs import LaserScan, OccupancyGrid, String, header
from twin.bridge.qos import LATCHED
from twin.bridge.tf import StaticTransformBroadcaster, TransformBroadcaster, transform_stamped
from twin.bridge.types.default_values import new
from twin.geometry import Pose3

URDF = """<robot name="box_bot">
  <link name="base_link"><visual><geometry><box size="0.4 0.2 0.1"/></geometry></visual></link>
  <link name="laser"/><link name="mast"><visual><geometry><mesh filename="package://elsewhere/mast.dae"/></geometry></visual></link>
  <joint name="to_laser" type="fixed"><parent link="base_link"/><child link="laser"/></joint>
  <joint name="to_mast" type="prismatic"><parent link="base_link"/><child link="mast"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


def message(name: str, /, **fields: Any) -> Any:
    """Return a message of a type."""
    return new(types.get(name), **fields)


with live.join([], listen=[sys.argv[1]]) as process:
    node = process.bus.create_node("robot")
    moving = TransformBroadcaster(node)
    StaticTransformBroadcaster(node).send_transform(
        [transform_stamped("base_link", "laser", 0, Pose3.from_xyz_rpy((0.2, 0.0, 0.1)))]
    )
    node.create_publisher(String, "robot_description", LATCHED).publish(String(URDF))
    grid = new(OccupancyGrid)
    grid.header.frame_id = "map"
    grid.info.width, grid.info.height, grid.info.resolution = 40, 20, 0.1
    grid.info.origin.position.x = -2.0
    grid.data = np.zeros(800, np.int8)
    node.create_publisher(OccupancyGrid, "map", LATCHED).publish(grid)
    scans = node.create_publisher(LaserScan, "scan")
    marks = node.create_publisher(types.get("visualization_msgs/msg/Marker"), "marks")
    raw = node.create_publisher(types.get("sensor_msgs/msg/Image"), "camera/image_raw")
    jpegs = node.create_publisher(types.get("sensor_msgs/msg/CompressedImage"), "camera/image_raw/compressed")
    infos = node.create_publisher(types.get("sensor_msgs/msg/CameraInfo"), "camera/camera_info")
    picture = BytesIO()
    Image.new("RGB", (32, 24), "orange").save(picture, "jpeg")
    depths = node.create_publisher(types.get("sensor_msgs/msg/Image"), "depth/image_raw")
    joints = node.create_publisher(types.get("sensor_msgs/msg/JointState"), "joint_states")
    imu = node.create_publisher(types.get("sensor_msgs/msg/Imu"), "imu")

    def tick() -> None:
        """Drive along x, looking to the left."""
        now_ns = node.now_ns
        turned = Pose3.from_xyz_rpy((1.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2.0))
        moving.send_transform(transform_stamped("odom", "base_link", now_ns, turned))
        moving.send_transform(transform_stamped("map", "odom", now_ns, Pose3.from_xyz_rpy((0.0, 0.5, 0.0))))
        scan = new(
            LaserScan, header=header(now_ns, "laser"), angle_min=0.0, angle_max=0.0, angle_increment=0.1
        )
        scan.range_min, scan.range_max, scan.ranges = 0.1, 10.0, np.array([2.0], np.float32)
        scans.publish(scan)
        mark = message(
            "visualization_msgs/msg/Marker", header=header(now_ns, "map"), ns="goals", id=3, type=2
        )
        mark.pose.orientation.w = mark.scale.x = mark.scale.y = mark.scale.z = mark.color.a = 1.0
        marks.publish(mark)
        image = message("sensor_msgs/msg/Image", header=header(now_ns, "laser"), height=2, width=3, step=12)
        image.encoding, image.data = "32FC1", np.full(6, 2.5, np.float32).view(np.uint8)
        depths.publish(image)
        info = message("sensor_msgs/msg/CameraInfo", header=header(now_ns, "laser"), width=32, height=24)
        info.k = np.array([40.0, 0.0, 15.5, 0.0, 40.0, 11.5, 0.0, 0.0, 1.0])
        infos.publish(info)
        jpeg = message("sensor_msgs/msg/CompressedImage", header=header(now_ns, "laser"), format="jpeg")
        jpeg.data = np.frombuffer(picture.getvalue(), np.uint8)
        jpegs.publish(jpeg)
        state = message("sensor_msgs/msg/JointState", header=header(now_ns, ""), name=["to_mast"])
        state.position = np.array([0.25])
        joints.publish(state)
        imu.publish(message("sensor_msgs/msg/Imu", header=header(now_ns, "base_link")))

    node.create_timer(50_000_000, tick)
    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    process.spin(until=over.is_set)
