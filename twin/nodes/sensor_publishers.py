"""One function per kind of sensor: a reading becomes the ROS message that its topic carries."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.msgs import Bool, Header, Imu, LaserScan, Quaternion, Range, Vector3, stamp
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.topics import Publisher
from twin.geometry import Array
from twin.models.specs import ContactSpec, ImuSpec, LidarSpec, RangeSpec, SensorSpec


class SensorDevice(Protocol):
    """A sensor that can be sampled; simulated by `twin.sim.sensors`, or a physical one's driver."""

    @property
    def spec(self) -> SensorSpec:
        """What it is."""

    def sample(self, time_ns: int) -> Any:
        """Return the reading at `time_ns`; None: there is none."""


def _laser_scan(spec: LidarSpec, header: Header, reading: Any) -> LaserScan:
    return LaserScan(
        header=header,
        angle_min=spec.angle_min,
        angle_max=spec.angle_max,
        angle_increment=(spec.angle_max - spec.angle_min) / max(1, spec.samples - 1),
        time_increment=0.0,
        scan_time=1.0 / spec.rate_hz,
        range_min=spec.range_min,
        range_max=spec.range_max,
        ranges=reading.ranges.astype(np.float32),
        intensities=np.zeros(0, np.float32),
    )


_NO_ORIENTATION = np.array([-1.0] + [0.0] * 8)
"""REP-145: this sensor gives no orientation."""


@lru_cache
def _isotropic(stddev: float) -> Array:
    """Return the covariance of three axes of equal noise, row by row, shape (9,)."""
    return (np.eye(3) * stddev**2).ravel()


def _imu(spec: ImuSpec, header: Header, reading: Any) -> Imu:
    gyro, accel = reading.angular_velocity.tolist(), reading.linear_acceleration.tolist()
    return Imu(
        header=header,
        orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=_NO_ORIENTATION,
        angular_velocity=Vector3(*gyro),
        angular_velocity_covariance=_isotropic(spec.gyro_noise_stddev),
        linear_acceleration=Vector3(*accel),
        linear_acceleration_covariance=_isotropic(spec.accel_noise_stddev),
    )


def _range(spec: RangeSpec, header: Header, reading: Any) -> Range:
    return Range(
        header=header,
        radiation_type=Range.ULTRASOUND,
        field_of_view=spec.field_of_view,
        min_range=spec.range_min,
        max_range=spec.range_max,
        range=float(reading.range),
        variance=spec.noise_stddev**2,
    )


def _contact(_spec: ContactSpec, _header: Header, reading: Any) -> Bool:
    return Bool(data=bool(reading.touched))


_MESSAGES: Mapping[type[SensorSpec], tuple[type, Callable[[Any, Header, Any], Any]]] = {
    LidarSpec: (LaserScan, _laser_scan),
    ImuSpec: (Imu, _imu),
    RangeSpec: (Range, _range),
    ContactSpec: (Bool, _contact),
}


class SensorPublisher:
    """Publishes one sensor's readings on its topic; the runtime calls it when the sensor is due."""

    def __init__(self, bus: Bus, sensor: SensorDevice, *, namespace: str = "") -> None:
        self.sensor = sensor
        self.node = bus.create_node(f"{sensor.spec.name}_driver", namespace)
        msgtype, self._to_message = _MESSAGES[type(sensor.spec)]
        self._publisher: Publisher[Any] = self.node.create_publisher(msgtype, sensor.spec.topic, SENSOR_DATA)

    def publish(self, time_ns: int) -> None:
        """Sample at `time_ns` and publish, stamped with it; a sensor that fails may have nothing to say."""
        spec, reading = self.sensor.spec, self.sensor.sample(time_ns)
        if reading is not None:
            header = Header(stamp=stamp(time_ns), frame_id=spec.link)
            self._publisher.publish(self._to_message(spec, header, reading))
