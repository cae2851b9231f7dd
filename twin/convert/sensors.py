"""The robot's sensors as MuJoCo's own, for a model that is simulated without `twin.sim`, which has its own.

Names are as in mujoco_ros2_control: `imu_quat`, `imu_gyro`, `imu_accel`; `scan-000`, `scan-001` and so on.
MuJoCo adds no noise itself; `noise` is what a reader may add.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, is_dataclass
from typing import Any

import mujoco

from twin.convert.bodies import free_name
from twin.geometry import Array, Pose3, multiply_wxyz
from twin.models.description import RobotDescription
from twin.models.sensors import plugin_of
from twin.models.specs import CameraSpec, SensorSpec

LENS_ALONG_X = (0.5, 0.5, -0.5, -0.5)
"""MuJoCo's cameras look along -z with +y up, Gazebo's along +x with +z up."""
_PIXEL = 1e-5
"""MuJoCo wants one for an axis beside the middle; how large it is changes no image [m]."""
_TYPE, _OBJECT = mujoco.mjtSensor, mujoco.mjtObj
STATE_SENSORS = {
    "position": _TYPE.mjSENS_JOINTPOS,
    "velocity": _TYPE.mjSENS_JOINTVEL,
    "effort": _TYPE.mjSENS_JOINTACTFRC,
}


def add_sensors(spec: mujoco.MjSpec, description: RobotDescription) -> list[dict[str, Any]]:
    """Add cameras, sensors and the joint states that `<ros2_control>` reads.

    A lidar is one rangefinder per ray. MuJoCo's other way, a rangefinder that reads every pixel of a camera,
    spaces rays evenly on a plane, not in angle, and sees less than 180 degrees.

    Args:
        spec: The robot of `description`; gets sites, cameras and sensors.
        description: As converted.

    Returns:
        Every sensor's specification with the names that it has in MuJoCo, for the report.
    """
    builder = SensorBuilder(spec)
    report = [
        _described(sensor, builder.add(sensor)) for sensor in (*description.sensors, *description.cameras)
    ]
    for joint, states in description.states.items():
        for state in states:
            builder.sensor(f"{joint}_{state}", STATE_SENSORS[state], _OBJECT.mjOBJ_JOINT, joint)
    return report


class SensorBuilder:
    """Adds sensors under names of their own."""

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self.spec = spec
        self._taken: set[str] = set()

    def add(self, sensor: SensorSpec) -> list[str]:
        """Add a sensor; return its names."""
        if isinstance(sensor, CameraSpec):
            return [self._camera(sensor)]
        plugin = plugin_of(sensor)
        with plugin.guard:
            return list(plugin.load().to_mujoco(sensor, self))

    def sensor(
        self, name: str, kind: mujoco.mjtSensor, objtype: mujoco.mjtObj, objname: str, **values: Any
    ) -> str:
        """Add a sensor of an object; return its name."""
        name = self._free(name)
        self.spec.add_sensor(name=name, type=kind, objtype=objtype, objname=objname, **values)
        return name

    def site(
        self, sensor: SensorSpec, name: str, turn: Sequence[float] | Array = (1.0, 0.0, 0.0, 0.0)
    ) -> str:
        """Add a site at a sensor, turned in its frame (quat_wxyz); return its name."""
        pose = sensor.T_link_sensor
        quat = multiply_wxyz(pose.quat_wxyz, turn)
        name = name if self.spec.site(name) is None else self._free(f"{name}_site")
        self.spec.body(sensor.link).add_site(name=name, pos=pose.xyz, quat=quat, size=[0.002] * 3)
        return name

    def count(self, kind: mujoco.mjtSensor) -> int:
        """Return how many sensors of a kind there are."""
        return sum(sensor.type == kind for sensor in self.spec.sensors)

    def _camera(self, camera: CameraSpec) -> str:
        name = self._free(camera.name)
        lens, size = camera.lens, (camera.width, camera.height)
        add_camera(
            self.spec.body(camera.link), name, camera.T_link_sensor, size, lens.focal_lengths, lens.centre
        )
        return name

    def _free(self, name: str) -> str:
        """Return a name that no sensor has yet."""
        free = free_name(name, self._taken)
        self._taken.add(free)
        return free


def add_camera(
    body: mujoco.MjsBody,
    name: str,
    pose: Pose3,
    size: tuple[int, int],
    focal_lengths: tuple[float, float],
    centre: tuple[float, float],
) -> None:
    """Add a pinhole camera to the body of its link.

    Args:
        body: Of the link.
        name: In the model.
        pose: In the link; it looks along +x.
        size: Width and height of its image [pixels].
        focal_lengths: Along u and v [pixels].
        centre: Where its axis meets the image [pixels].
    """
    camera = body.add_camera(
        name=name,
        pos=pose.xyz,
        quat=multiply_wxyz(pose.quat_wxyz, LENS_ALONG_X),
        fovy=math.degrees(2.0 * math.atan(size[1] / 2.0 / focal_lengths[1])),
        resolution=size,
    )
    u, v = (at - (count - 1) / 2.0 for at, count in zip(centre, size, strict=True))
    if u or v or focal_lengths[0] != focal_lengths[1]:
        camera.sensor_size = [_PIXEL * count for count in size]
        camera.focal_pixel = focal_lengths
        camera.principal_pixel = -u, -v


def _described(sensor: SensorSpec, names: list[str]) -> dict[str, Any]:
    values = {
        name: asdict(value) if is_dataclass(value) and not isinstance(value, type) else value
        for name, value in vars(sensor).items()
        if name not in ("T_link_sensor", "plugin")
    }
    pose = sensor.T_link_sensor
    return {
        "type": type(sensor).__name__.removesuffix("Spec").lower(),
        **values,
        "line": sensor.line or None,
        "xyz": pose.xyz.tolist(),
        "quat_wxyz": pose.quat_wxyz.tolist(),
        "mujoco": names if len(names) <= 3 else [names[0], "...", names[-1]],
    }
