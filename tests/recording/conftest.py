"""A synthetic run: a robot of boxes circles in a hall with racks, and every topic that is shown.

Stand-ins for `World` and `Sample`, so that the recording is tested alone.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

os.environ["RERUN_ANALYTICS"] = "0"
os.environ["RERUN_STRICT"] = "1"

from twin.geometry import Pose2, Pose3, wxyz_from_xyzw
from twin.models.shapes import Box, Capsule, Cylinder, Sphere
from twin.recording.read_back import Recording
from twin.recording.sink import RecordingConfig, RerunSink
from twin.sim.scene import Scene

ROS = get_typestore(Stores.ROS2_JAZZY)
NS = 1_000_000_000
HALL = (20.0, 14.0)
RESOLUTION = 0.1
BEAMS = 360


def msg(kind: str, /, **fields: Any) -> Any:
    """Build a message: `msg("geometry_msgs/Twist", linear=..., ...)`."""
    package, short = kind.split("/")
    return ROS.types[f"{package}/msg/{short}"](**fields)


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return msg("geometry_msgs/Vector3", x=x, y=y, z=z)


def point(x: float, y: float, z: float = 0.0) -> Any:
    return msg("geometry_msgs/Point", x=x, y=y, z=z)


def quaternion(yaw: float) -> Any:
    return msg("geometry_msgs/Quaternion", x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def pose(p: Pose2) -> Any:
    return msg("geometry_msgs/Pose", position=point(p.x, p.y), orientation=quaternion(p.yaw))


def stamp(time_ns: int) -> Any:
    return msg("builtin_interfaces/Time", sec=time_ns // NS, nanosec=time_ns % NS)


def header(time_ns: int, frame_id: str) -> Any:
    return msg("std_msgs/Header", stamp=stamp(time_ns), frame_id=frame_id)


def twist(linear: float, angular: float) -> Any:
    return msg("geometry_msgs/Twist", linear=vector(linear), angular=vector(z=angular))


@dataclass(frozen=True)
class FakeSample:
    topic: str
    msgtype: str
    time_ns: int
    payload: bytes
    message: Any
    publisher: ClassVar[Any] = SimpleNamespace(on_demand=False)


@dataclass(frozen=True, kw_only=True)
class FakeShape:
    body: str
    geometry: Any
    T_body_geometry: Pose3 = field(default_factory=Pose3.from_xyz_rpy)
    rgba: tuple[float, float, float, float] = (0.7, 0.7, 0.7, 1.0)
    static: bool = False
    material: str = ""


def box(body: str, size: tuple[float, float, float], at: Any = (0, 0, 0), **more: Any) -> FakeShape:
    return FakeShape(body=body, geometry=Box(size=size), T_body_geometry=Pose3.from_xyz_rpy(at), **more)


RACKS = [(x, y) for y in (-3.5, 0.0, 3.5) for x in (-6.0, -1.5, 3.0)]
BLUE, ORANGE, WOOD, WALL = (
    (0.16, 0.3, 0.6, 1.0),
    (0.9, 0.45, 0.1, 1.0),
    (0.72, 0.53, 0.33, 1.0),
    (0.8, 0.8, 0.78, 1.0),
)


def hall() -> list[FakeShape]:
    lx, ly = HALL
    shapes = [
        box("north", (lx, 0.15, 1.2), (0, ly / 2, 0.6), rgba=WALL, static=True),
        box("south", (lx, 0.15, 1.2), (0, -ly / 2, 0.6), rgba=WALL, static=True),
        box("east", (0.15, ly, 1.2), (lx / 2, 0, 0.6), rgba=WALL, static=True),
        box("west", (0.15, ly, 1.2), (-lx / 2, 0, 0.6), rgba=WALL, static=True),
    ]
    for i, (x, y) in enumerate(RACKS):
        for z in (0.4, 1.1, 1.8):
            shapes.append(box(f"rack_{i}", (2.6, 0.8, 0.05), (x, y, z), rgba=ORANGE, static=True))
            shapes += [
                box(f"rack_{i}", (0.5, 0.5, 0.4), (x + k, y, z + 0.225), rgba=WOOD, static=True)
                for k in (-0.8, 0.0, 0.8)
            ]
        for dx, dy in ((-1.3, -0.4), (-1.3, 0.4), (1.3, -0.4), (1.3, 0.4)):
            shapes.append(box(f"rack_{i}", (0.06, 0.06, 2.0), (x + dx, y + dy, 1.0), rgba=BLUE, static=True))
    return shapes


def robot(name: str = "robot") -> list[FakeShape]:
    tyre = Pose3.from_xyz_rpy(rpy=(math.pi / 2, 0, 0))
    return [
        box(f"{name}/base_link", (0.6, 0.45, 0.2), (0, 0, 0.16), rgba=(0.15, 0.55, 0.75, 1)),
        box(f"{name}/lift", (0.5, 0.35, 0.04), rgba=(0.95, 0.75, 0.1, 1)),
        FakeShape(
            body=f"{name}/base_scan", geometry=Cylinder(radius=0.05, length=0.07), rgba=(0.1, 0.1, 0.1, 1)
        ),
        FakeShape(
            body=f"{name}/wheel_left_link",
            geometry=Cylinder(radius=0.1, length=0.05),
            T_body_geometry=tyre,
            rgba=(0.1, 0.1, 0.1, 1),
        ),
        FakeShape(
            body=f"{name}/wheel_right_link",
            geometry=Cylinder(radius=0.1, length=0.05),
            T_body_geometry=tyre,
            rgba=(0.1, 0.1, 0.1, 1),
        ),
        FakeShape(body=f"{name}/caster", geometry=Sphere(radius=0.04), rgba=(0.3, 0.3, 0.3, 1)),
        FakeShape(body=f"{name}/mast", geometry=Capsule(radius=0.02, length=0.4), rgba=(0.4, 0.4, 0.4, 1)),
    ]


class FakeWorld:
    """A robot on a circle, and crates of which one is carried."""

    def __init__(self, crates: int = 20, robot_name: str = "robot") -> None:
        name = robot_name
        links = ("base_footprint", "base_link", "lift", "base_scan", "wheel_left_link", "wheel_right_link")
        self.links = (*links, "caster", "mast")
        self.body_names = tuple(f"{name}/{link}" for link in self.links) + tuple(
            f"crate_{i}" for i in range(crates)
        )
        self._shapes = hall() + robot(name)
        self._shapes += [box(f"crate_{i}", (0.3, 0.3, 0.2), rgba=WOOD) for i in range(crates)]
        self._at = [Pose3.from_xyz_rpy((8.5, -5 + 0.5 * i, 0.1)) for i in range(crates)]
        self.time_ns = 0
        self.scene = Scene(name="hall")

    def shapes(self) -> list[FakeShape]:
        return self._shapes

    @property
    def base(self) -> Pose2:
        """On an ellipse around the racks."""
        phase = 0.12 * self.time_ns / NS - 2.0
        return Pose2(8.0 * math.cos(phase), 5.4 * math.sin(phase), self.yaw(phase))

    @staticmethod
    def yaw(phase: float) -> float:
        return math.atan2(5.4 * math.cos(phase), -8.0 * math.sin(phase))

    @property
    def lift(self) -> float:
        return 0.15 * (1 - math.cos(self.time_ns / NS))

    def pose(self, body: str) -> Pose3:
        if body not in self.body_names:
            return Pose3.from_xyz_rpy()
        xyz, quat = self.body_poses()
        i = self.body_names.index(body)
        return Pose3(xyz[i], quat[i])

    def body_poses(self) -> tuple[np.ndarray, np.ndarray]:
        base = Pose3.from_pose2(self.base)
        spin = (0.0, 5.0 * self.time_ns / NS % (2 * math.pi), 0.0)
        local = [
            Pose3.from_xyz_rpy(),
            Pose3.from_xyz_rpy(),
            Pose3.from_xyz_rpy((-0.02, 0, 0.3 + self.lift)),
            Pose3.from_xyz_rpy((0.3, 0, 0.22)),
            Pose3.from_xyz_rpy((0, 0.25, 0.1), spin),
            Pose3.from_xyz_rpy((0, -0.25, 0.1), spin),
            Pose3.from_xyz_rpy((-0.25, 0, 0.04)),
            Pose3.from_xyz_rpy((-0.27, 0, 0.45)),
        ]
        poses = [base @ T for T in local] + self._at
        if self._at:
            poses[len(local)] = base @ Pose3.from_xyz_rpy((-0.02, 0, 0.42 + self.lift))
        return np.array([p.xyz for p in poses]), np.array([p.quat_wxyz for p in poses])


def occupancy(inflate: int = 0) -> np.ndarray:
    """The hall as a grid (rows, columns), row 0 in the south."""
    lx, ly = HALL
    grid = np.zeros((round(ly / RESOLUTION), round(lx / RESOLUTION)), dtype=np.int8)
    xs = (np.arange(grid.shape[1]) + 0.5) * RESOLUTION - lx / 2
    ys = (np.arange(grid.shape[0]) + 0.5) * RESOLUTION - ly / 2
    distance = np.minimum(lx / 2 - np.abs(xs)[None, :], ly / 2 - np.abs(ys)[:, None])
    for x, y in RACKS:
        outside = np.hypot(
            np.maximum(np.abs(xs - x)[None, :] - 1.3, 0), np.maximum(np.abs(ys - y)[:, None] - 0.4, 0)
        )
        distance = np.minimum(distance, outside)
    if inflate:
        grid[:] = np.clip(98 * np.exp(-3.0 * distance), 0, 98)
    grid[distance < RESOLUTION] = 100
    grid[:8, :8] = -1  # an unknown corner in the south-west
    return grid


class FakeRun:
    """Publishes what a run publishes, at its rates; the order of a tick is that of the runtime."""

    def __init__(
        self, *, duration_s: float = 3.0, namespace: str = "", world: FakeWorld | None = None
    ) -> None:
        self.world = world or FakeWorld()
        self.duration_s = duration_s
        self.samples: list[FakeSample] = []
        self._prefix = f"/{namespace}" if namespace else ""
        self._rng = np.random.default_rng(1)
        self._start = self.world.base
        self._static_grid = (occupancy(), occupancy(inflate=1))

    def publish(self, topic: str, message: Any) -> FakeSample:
        kind = message.__msgtype__
        payload = bytes(ROS.serialize_cdr(message, kind))
        sample = FakeSample(self._prefix + topic, kind, self.world.time_ns, payload, message)
        self.samples.append(sample)
        return sample

    def ticks(self) -> Iterator[list[FakeSample]]:
        """Yield the samples of each tick of 20 ms; the world has moved when they are handed out."""
        for tick in range(round(self.duration_s * 50) + 1):
            self.world.time_ns = tick * 20_000_000
            self.samples = []
            self._fast(tick)
            if tick % 5 == 0:
                self.publish("/scan", self._scan())
            if tick % 25 == 0:
                self._slow(tick)
            yield self.samples

    def play(self, sink: RerunSink, verdict: dict[str, Any] | None = None) -> None:
        sink.declare(self.world)
        for samples in self.ticks():
            for sample in samples:
                sink.on_sample(sample)
            sink.on_tick(self.world)
        sink.close(verdict)

    def _tf(self, parent: str, child: str, p: Pose2) -> Any:
        return msg(
            "geometry_msgs/TransformStamped",
            header=header(self.world.time_ns, parent),
            child_frame_id=child,
            transform=msg(
                "geometry_msgs/Transform", translation=vector(p.x, p.y), rotation=quaternion(p.yaw)
            ),
        )

    def _fast(self, tick: int) -> None:
        t = tick / 50
        drift = Pose2(0.02 * t, -0.015 * t, 0.004 * t)
        T_odom_base = self._start.inverse() @ self.world.base @ drift
        v, w = 0.8 + 0.1 * math.sin(t), 0.12
        self.publish("/cmd_vel", twist(round(v, 1), w))
        covariance = np.zeros(36)
        self.publish(
            "/odom",
            msg(
                "nav_msgs/Odometry",
                header=header(self.world.time_ns, "odom"),
                child_frame_id="base_footprint",
                pose=msg("geometry_msgs/PoseWithCovariance", pose=pose(T_odom_base), covariance=covariance),
                twist=msg("geometry_msgs/TwistWithCovariance", twist=twist(v, w), covariance=covariance),
            ),
        )
        transforms = [
            self._tf("odom", "base_footprint", T_odom_base),
            self._tf("base_link", "lift", Pose2(0, 0, 0)),
        ]
        if tick % 5 == 0 and tick >= 25:
            wobble = Pose2(0.15 * math.sin(t), 0.1 * math.cos(1.3 * t), 0.03)
            transforms.insert(0, self._tf("map", "odom", self.world.base @ wobble @ T_odom_base.inverse()))
        self.publish("/tf", msg("tf2_msgs/TFMessage", transforms=transforms))
        names = ["wheel_left_joint", "wheel_right_joint", "lift_joint", "gripper_joint"]
        position = np.array([5 * t, 5 * t, self.world.lift, 0.04 * (t > 1)])
        self.publish(
            "/joint_states",
            msg(
                "sensor_msgs/JointState",
                header=header(self.world.time_ns, ""),
                name=names,
                position=position,
                velocity=np.zeros(4),
                effort=np.zeros(4),
            ),
        )

    def _scan(self) -> Any:
        base = self.world.base @ Pose2(0.3, 0.0, 0.0)
        angles = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False) + base.yaw
        with np.errstate(divide="ignore"):
            x = np.where(np.cos(angles) > 0, HALL[0] / 2 - base.x, HALL[0] / 2 + base.x) / np.abs(
                np.cos(angles)
            )
            y = np.where(np.sin(angles) > 0, HALL[1] / 2 - base.y, HALL[1] / 2 + base.y) / np.abs(
                np.sin(angles)
            )
        ranges = np.minimum(x, y).astype(np.float32)
        ranges[ranges > 12.0] = np.inf
        return msg(
            "sensor_msgs/LaserScan",
            header=header(self.world.time_ns, "base_scan"),
            angle_min=-math.pi,
            angle_max=math.pi,
            angle_increment=2 * math.pi / BEAMS,
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.1,
            range_max=12.0,
            ranges=ranges,
            intensities=np.zeros(0, dtype=np.float32),
        )

    def grid(self, data: np.ndarray, frame: str, x: float, y: float) -> Any:
        return msg(
            "nav_msgs/OccupancyGrid",
            header=header(self.world.time_ns, frame),
            info=msg(
                "nav_msgs/MapMetaData",
                map_load_time=stamp(0),
                resolution=RESOLUTION,
                width=data.shape[1],
                height=data.shape[0],
                origin=pose(Pose2(x, y, 0.0)),
            ),
            data=data.ravel(),
        )

    def _slow(self, tick: int) -> None:
        time_ns, base = self.world.time_ns, self.world.base
        static, cost = self._static_grid
        if tick == 0:
            self.publish("/map", self.grid(static, "map", -HALL[0] / 2, -HALL[1] / 2))
            self.publish("/global_costmap/costmap", self.grid(cost, "map", -HALL[0] / 2, -HALL[1] / 2))
        column = min(max(round((base.x + HALL[0] / 2) / RESOLUTION) - 15, 0), cost.shape[1] - 30)
        row = min(max(round((base.y + HALL[1] / 2) / RESOLUTION) - 15, 0), cost.shape[0] - 30)
        window = cost[row : row + 30, column : column + 30]
        origin = (column * RESOLUTION - HALL[0] / 2, row * RESOLUTION - HALL[1] / 2)
        self.publish("/local_costmap/costmap", self.grid(np.ascontiguousarray(window), "map", *origin))
        phases = 0.12 * (time_ns / NS + np.arange(0, 12, 0.25)) - 2.0
        self.publish(
            "/plan",
            msg(
                "nav_msgs/Path",
                header=header(time_ns, "map"),
                poses=[
                    msg(
                        "geometry_msgs/PoseStamped",
                        header=header(time_ns, "map"),
                        pose=pose(Pose2(8.0 * math.cos(p), 5.4 * math.sin(p), 0.0)),
                    )
                    for p in phases
                ],
            ),
        )
        spread = self._rng.normal(0.0, (0.25, 0.25, 0.2), (600, 3))
        particles = [pose(base @ Pose2(*row)) for row in spread]
        self.publish(
            "/particle_cloud", msg("geometry_msgs/PoseArray", header=header(time_ns, "map"), poses=particles)
        )
        if tick >= 75:  # a topic that begins late, in a frame of the robot
            seen = msg("geometry_msgs/PoseArray", header=header(time_ns, "base_link"), poses=particles[:1])
            self.publish("/tote_poses", seen)
        states = ("drive to pick", "align", "grasp", "drive to place")
        self.publish("/mission/state", msg("std_msgs/String", data=states[tick // 75 % 4]))
        self.publish(
            "/rosout",
            msg(
                "rcl_interfaces/Log",
                stamp=stamp(time_ns),
                level=30 if tick % 100 == 0 else 20,
                name="bt_navigator",
                msg=f"goal is {12 - tick / 50:.1f} m away",
                file="",
                function="",
                line=0,
            ),
        )


VERDICT = {
    "scenario": "demo",
    "seed": 7,
    "verdict": "pass",
    "checks": [
        {"name": "no_collision", "passed": True, "value": 0, "limit": 0, "unit": "", "at_s": None},
        {
            "name": "localisation_error",
            "passed": False,
            "value": 0.31,
            "limit": 0.25,
            "unit": "m",
            "at_s": 2.4,
        },
    ],
    "metrics": {"sim_time_s": 3.0, "wall_time_s": 1.0, "distance_m": 2.4},
    "digest": "00ff",
}


@pytest.fixture
def make_run() -> type[FakeRun]:
    return FakeRun


@pytest.fixture
def make_world() -> type[FakeWorld]:
    return FakeWorld


@pytest.fixture
def make_message() -> Any:
    return msg


@pytest.fixture
def make_shape() -> type[FakeShape]:
    return FakeShape


@pytest.fixture
def make_box() -> Any:
    return box


@pytest.fixture
def verdict() -> dict[str, Any]:
    return VERDICT


@dataclass(frozen=True)
class Recorded:
    """A recording and every sample that went into it."""

    path: Path
    samples: list[FakeSample]

    def of(self, topic: str) -> list[FakeSample]:
        return [sample for sample in self.samples if sample.topic == topic]


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """Three seconds of the synthetic run."""
    path = tmp_path_factory.mktemp("recording") / "demo.rrd"
    run = FakeRun(duration_s=3.0)
    sink = RerunSink(path, config=RecordingConfig(), recording_id="demo")
    sink.declare(run.world, {"robot": {"wheel_left_joint", "gripper_joint"}})
    samples: list[FakeSample] = []
    for tick in run.ticks():
        for sample in tick:
            sink.on_sample(sample)
        samples += tick
        sink.on_tick(run.world)
    sink.close(VERDICT)
    return Recorded(path, samples)


def _recorded_poses(recording: Recording, root: str) -> dict[str, Pose3]:
    """Return `T_root_link` of every frame, from the transforms in a recording alone."""
    columns = {
        name: [row[0] for row in recording.column("/tf", f"Transform3D:{name}").values]
        for name in ("translation", "quaternion", "parent_frame", "child_frame")
    }
    edges = {
        child: (parent, Pose3(np.array(xyz, dtype=float), wxyz_from_xyzw(xyzw)))
        for xyz, xyzw, parent, child in zip(*columns.values(), strict=True)
    }

    def pose(frame: str) -> Pose3:
        if frame == root:
            return Pose3.from_xyz_rpy()
        parent, T_parent_frame = edges[frame]
        return pose(parent) @ T_parent_frame

    return {frame: pose(frame) for frame in (root, *edges)}


@pytest.fixture
def recorded_poses() -> Any:
    return _recorded_poses
