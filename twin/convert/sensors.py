"""The robot's sensors as MuJoCo's own, for a model that is simulated without `twin.sim`, which has its own.

Names are as in mujoco_ros2_control: `imu_quat`, `imu_gyro`, `imu_accel`; `scan-000`, `scan-001` and so on.
MuJoCo adds no noise itself; `noise` is what a reader may add.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np

from twin.geometry import Array, Pose3, multiply_wxyz, quat_wxyz_from_rpy, quat_wxyz_from_yaw
from twin.models.description import RobotDescription
from twin.models.specs import CameraSpec, ContactSpec, ImuSpec, LidarSpec, RangeSpec, SensorSpec

MAX_RAYS = 2048
"""A planar lidar with more rays than this is left out: MuJoCo casts every ray anew in every step."""
MAX_RAYS_OF_ALL = 4 * MAX_RAYS
"""Further lidars and sonars are left out likewise."""
CONE_RINGS = 2
"""Rings of rays about a sonar's axis; ring k has 6 k rays, 19 rays in all."""
RAY_ALONG_X = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
"""A rangefinder looks along its site's z axis; this turns it to the sensor's x axis."""
LENS_ALONG_X = (0.5, 0.5, -0.5, -0.5)
"""MuJoCo's cameras look along -z with +y up, Gazebo's along +x with +z up."""
CONTACT_FOUND_AND_FORCE, NET_FORCE, ONE_SLOT = 0b11, 3, 1
"""mjCONDATA_FOUND and mjCONDATA_FORCE as bits, `reduce="netforce"`, `num="1"`."""
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
    builder = _SensorBuilder(spec)
    report = [
        _described(sensor, builder.add(sensor)) for sensor in (*description.sensors, *description.cameras)
    ]
    for joint, states in description.states.items():
        for state in states:
            builder.sensor(f"{joint}_{state}", STATE_SENSORS[state], _OBJECT.mjOBJ_JOINT, joint)
    return report


def rays_of(sensor: LidarSpec | RangeSpec) -> list[tuple[float, float, float, float]]:
    """Return the turn from the sensor's frame to each ray's, whose z axis is the ray, as quat_wxyz.

    A lidar's go from angle_min to angle_max, a sonar's first along its axis and then around it.
    """
    if isinstance(sensor, LidarSpec):
        angles = np.linspace(sensor.angle_min, sensor.angle_max, sensor.samples)
        return [_quat(quat_wxyz_from_yaw(float(angle)), RAY_ALONG_X) for angle in angles]
    turns = [(0.0, 0.0)]
    for ring in range(1, CONE_RINGS + 1):
        tilt = sensor.field_of_view / 2.0 * ring / CONE_RINGS
        turns += [(2.0 * math.pi * k / (6 * ring), tilt) for k in range(6 * ring)]
    return [
        _quat(multiply_wxyz(quat_wxyz_from_rpy(roll, 0.0, 0.0), quat_wxyz_from_yaw(tilt)), RAY_ALONG_X)
        for roll, tilt in turns
    ]


class _SensorBuilder:
    """Adds sensors under names of their own."""

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self._spec = spec
        self._taken: set[str] = set()
        self._rays_cast = 0

    def add(self, sensor: SensorSpec) -> list[str]:
        """Add a sensor; return its names."""
        adders: dict[type, Callable[[Any], Iterator[str]]] = {
            ImuSpec: self._imu,
            LidarSpec: self._rays,
            RangeSpec: self._rays,
            ContactSpec: self._contact,
            CameraSpec: self._camera,
        }
        return list(adders[type(sensor)](sensor))

    def sensor(
        self, name: str, kind: mujoco.mjtSensor, objtype: mujoco.mjtObj, objname: str, **values: Any
    ) -> str:
        """Add a sensor of an object; return its name."""
        name = self._free(name)
        self._spec.add_sensor(name=name, type=kind, objtype=objtype, objname=objname, **values)
        return name

    def _imu(self, sensor: ImuSpec) -> Iterator[str]:
        site = self._site(sensor, sensor.name)
        for suffix, kind, noise in (
            ("quat", _TYPE.mjSENS_FRAMEQUAT, 0.0),
            ("gyro", _TYPE.mjSENS_GYRO, sensor.gyro_noise_stddev),
            ("accel", _TYPE.mjSENS_ACCELEROMETER, sensor.accel_noise_stddev),
        ):
            yield self.sensor(f"{sensor.name}_{suffix}", kind, _OBJECT.mjOBJ_SITE, site, noise=noise)

    def _rays(self, sensor: LidarSpec | RangeSpec) -> Iterator[str]:
        if isinstance(sensor, LidarSpec) and sensor.samples > MAX_RAYS:
            return
        rays = rays_of(sensor)
        if self._rays_cast + len(rays) > MAX_RAYS_OF_ALL:
            return
        self._rays_cast += len(rays)
        digits = max(3, len(str(len(rays) - 1)))
        for index, ray in enumerate(rays):
            name = f"{sensor.name}-{index:0{digits}}"
            yield self.sensor(
                name,
                _TYPE.mjSENS_RANGEFINDER,
                _OBJECT.mjOBJ_SITE,
                self._site(sensor, name, ray),
                intprm=[1 << int(mujoco.mjtRayDataField.mjRAYDATA_DIST), 0, 0],
                cutoff=sensor.range_max,
                noise=sensor.noise_stddev,
            )

    def _contact(self, sensor: ContactSpec) -> Iterator[str]:
        parameters = [CONTACT_FOUND_AND_FORCE, NET_FORCE, ONE_SLOT]
        yield self.sensor(
            sensor.name, _TYPE.mjSENS_CONTACT, _OBJECT.mjOBJ_BODY, sensor.link, intprm=parameters
        )

    def _camera(self, camera: CameraSpec) -> Iterator[str]:
        tangent = math.tan(camera.horizontal_fov / 2.0) * camera.height / camera.width
        pose, name = camera.T_link_sensor, self._free(camera.name)
        self._spec.body(camera.link).add_camera(
            name=name,
            pos=pose.xyz,
            quat=multiply_wxyz(pose.quat_wxyz, LENS_ALONG_X),
            fovy=math.degrees(2.0 * math.atan(tangent)),
            resolution=[camera.width, camera.height],
        )
        yield name

    def _site(self, sensor: SensorSpec, name: str, turn: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> str:
        pose = sensor.T_link_sensor
        quat = multiply_wxyz(pose.quat_wxyz, turn)
        name = name if self._spec.site(name) is None else self._free(f"{name}_site")
        self._spec.body(sensor.link).add_site(name=name, pos=pose.xyz, quat=quat, size=[0.002] * 3)
        return name

    def _free(self, name: str) -> str:
        """Return a name that no sensor has yet."""
        free, number = name, 2
        while free in self._taken:
            free, number = f"{name}_{number}", number + 1
        self._taken.add(free)
        return free


def _quat(turn: Array, ray: tuple[float, ...]) -> tuple[float, float, float, float]:
    w, x, y, z = (float(value) for value in multiply_wxyz(turn, ray))
    return (w, x, y, z)


def _described(sensor: SensorSpec, names: list[str]) -> dict[str, Any]:
    values = {name: value for name, value in vars(sensor).items() if not isinstance(value, Pose3)}
    pose = sensor.T_link_sensor
    return {
        "type": type(sensor).__name__.removesuffix("Spec").lower(),
        **values,
        "line": sensor.line or None,
        "xyz": pose.xyz.tolist(),
        "quat_wxyz": pose.quat_wxyz.tolist(),
        "mujoco": names if len(names) <= 3 else [names[0], "...", names[-1]],
    }
