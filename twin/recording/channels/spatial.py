"""Messages that have a place: scans, rasters, paths, particles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.geometry import xyzw_from_wxyz
from twin.recording.channels.channel import Channel, Context
from twin.recording.columns import Columns, TransformColumns, arrows, points, strips
from twin.recording.frames import WORLD
from twin.recording.placing import Placed, set_time

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

SCAN_COLOUR = (255, 70, 70, 255)
PLAN_COLOUR = (70, 140, 255, 255)
PARTICLE_COLOUR = (235, 60, 170, 255)
LAYER_HEIGHTS = {"map": -0.02, "global_costmap/costmap": -0.015, "local_costmap/costmap": -0.01}
"""Where rasters lie [m]: below the floor's z = 0 and one above the other, so that they do not flicker."""
LAYER_OPACITIES = {"global_costmap/costmap": 0.3, "local_costmap/costmap": 0.8}
PARTICLE_LENGTH = 0.12
"""Of the arrow of a particle [m]."""


class _SpatialChannel(Channel):
    """A topic whose messages have a place each."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.entity = f"/ros{topic}"
        self._placed = Placed(context.recording, self.entity, context.start_ns)
        self._origin = f"origin of {topic}"
        self._transforms = TransformColumns(f"/tf_topics{topic}")
        self.columns.append(self._transforms)

    def place(self, frame_id: str, time_ns: int) -> None:
        """Put what is published now, in a frame, into its place.

        What is in the frame of a body, such as a scan, stays where that body truly was when it was published:
        hung on the moving body, it would turn with the robot until the next message. The rest is in a frame
        of the robot's belief.
        """
        frames = self.context.frames
        body = frames.body(self.namespace, frame_id)
        if body is None:
            self._placed.attach(frames.belief(self.namespace, frame_id), time_ns)
            return
        self._placed.attach(self._origin, time_ns)
        pose = self.context.true_pose(body)
        quat_xyzw = xyzw_from_wxyz(pose.quat_wxyz)
        self._transforms.append(time_ns, WORLD, [self._origin], [pose.xyz], [quat_xyzw])

    def declare(self, look: rr.AsComponents) -> None:
        """Log what all messages of the topic look like."""
        self.context.recording.log(self.entity, look, static=True)


class ScanChannel(_SpatialChannel):
    """sensor_msgs/LaserScan as points in the frame of the true lidar."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._points = Columns(self.entity, points)
        self.columns.append(self._points)
        self._key: tuple[float, float, int] | None = None
        self._directions: NDArray[np.float32] = np.zeros((0, 3), dtype=np.float32)
        self.declare(rr.Points3D.from_fields(colors=[SCAN_COLOUR], radii=rr.Radius.ui_points(1.5)))

    def take(self, sample: Sample[Any]) -> None:
        """Keep the returns between range_min and range_max."""
        scan = sample.message
        self.place(scan.header.frame_id, sample.time_ns)
        ranges = np.asarray(scan.ranges, dtype=np.float32)
        key = (scan.angle_min, scan.angle_increment, len(ranges))
        if key != self._key:
            angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
            self._directions = np.stack((np.cos(angles), np.sin(angles), np.zeros_like(angles)), axis=1)
            self._directions = self._directions.astype(np.float32)
            self._key = key
        hit = (ranges >= scan.range_min) & (ranges <= scan.range_max)
        self._points.append(sample.time_ns, self._directions[hit] * ranges[hit, None])


class GridChannel(_SpatialChannel):
    """nav_msgs/OccupancyGrid as a raster on the floor; sent at once if it changed: they are few and large."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        name = context.frames.split(topic)[1]
        self._height = LAYER_HEIGHTS.get(name, -0.01)
        self._is_map = not name.endswith("costmap")
        self._opacity = LAYER_OPACITIES.get(name, 1.0 if self._is_map else 0.6)
        self._last: tuple[Any, ...] | None = None

    def take(self, sample: Sample[Any]) -> None:
        """Log the raster: row 0 of the message is at its origin, row 0 of Rerun's image at the far side."""
        grid = sample.message
        info = grid.info
        data = np.asarray(grid.data, dtype=np.int8)
        cells = data.reshape(info.height, info.width)[::-1].tobytes()
        origin = info.origin.position
        self.place(grid.header.frame_id, sample.time_ns)
        key = (info.width, info.height, info.resolution, origin.x, origin.y, grid.header.frame_id, cells)
        if key == self._last or not cells:
            return
        self._last = key
        set_time(self.context.recording, sample.time_ns)
        q = info.origin.orientation
        self.context.recording.log(
            self.entity,
            rr.GridMap(
                data=cells,
                format=rr.components.ImageFormat(
                    width=info.width, height=info.height, color_model="L", channel_datatype="U8"
                ),
                cell_size=info.resolution,
                translation=[origin.x, origin.y, origin.z + self._height],
                quaternion=rr.Quaternion(xyzw=[q.x, q.y, q.z, q.w]),
                colormap="RvizMap" if self._is_map else "RvizCostmap",
                opacity=self._opacity,
            ),
        )


class PathChannel(_SpatialChannel):
    """nav_msgs/Path as a line; sent only when it changed."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._strips = Columns(self.entity, strips)
        self.columns.append(self._strips)
        self._last: NDArray[np.float32] | None = None
        self.declare(rr.LineStrips3D.from_fields(colors=[PLAN_COLOUR], radii=rr.Radius.ui_points(1.5)))

    def take(self, sample: Sample[Any]) -> None:
        """Keep the positions."""
        path = sample.message
        positions = [pose.pose.position for pose in path.poses]
        points = np.array([(p.x, p.y, p.z + 0.02) for p in positions], dtype=np.float32).reshape(-1, 3)
        self.place(path.header.frame_id, sample.time_ns)
        if self._last is not None and np.array_equal(points, self._last):
            return
        self._last = points
        self._strips.append(sample.time_ns, points)


class PoseArrayChannel(_SpatialChannel):
    """geometry_msgs/PoseArray, such as AMCL's particles, as short arrows."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._arrows = Columns(self.entity, arrows)
        self.columns.append(self._arrows)
        self.declare(rr.Arrows3D.from_fields(colors=[PARTICLE_COLOUR], radii=[0.008]))

    def take(self, sample: Sample[Any]) -> None:
        """Keep at most `max_particles`, evenly spread over the array.

        The poses are read from the payload, 50 times faster than from the message: CDR ends with them, seven
        little-endian doubles each (OMG DDS-XTypes 1.3, 7.4.3).
        """
        cloud = sample.message
        self.place(cloud.header.frame_id, sample.time_ns)
        n = len(cloud.poses)
        values = np.frombuffer(sample.payload, "<f8", 7 * n, len(sample.payload) - 56 * n).reshape(n, 7)
        values = values[:: max(1, math.ceil(n / self.context.max_particles))]
        xyz, (x, y, z, w) = values[:, :3], values[:, 3:].T
        forward = np.stack((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)), axis=1)
        self._arrows.append(
            sample.time_ns,
            (xyz + np.array((0.0, 0.0, 0.01))).astype(np.float32),
            (PARTICLE_LENGTH * forward).astype(np.float32),
        )
