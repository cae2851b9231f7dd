"""When sensors fire."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

from twin.nodes.sensor_publishers import SensorPublisher
from twin.periods import Period, latest, next_due

if TYPE_CHECKING:
    from twin.nodes.cameras.camera import CameraPublisher

    Due: TypeAlias = SensorPublisher | CameraPublisher


class SensorSchedule:
    """Fires each sensor at the first physics step at or after its due time.

    Due times are the multiples of its period: any rate up to that of the physics works, its mean is exact.
    """

    def __init__(self, sensors: Sequence[Due], timestep_ns: int) -> None:
        """Take in sensors at time 0, and tell of each how late it can be; `timestep_ns` of the physics."""
        self._sensors = tuple(sensors)
        self._timestep_ns = timestep_ns
        self._periods = [sensor.sensor.spec.period for sensor in self._sensors]
        self._strides = [period // timestep_ns if not period % timestep_ns else 0 for period in self._periods]
        """Physics steps from one due time to the next; 0 where these differ."""
        self._steps = [self._step_after(period, 0) for period in self._periods]
        self.next_step = min(self._steps, default=sys.maxsize)
        """The physics step at which a sensor fires next."""
        self.prepare: Callable[[Sequence[Due], int], None] | None = None
        """Called with the sensors that are about to fire, and the time [ns]."""
        self._tell_lateness()

    def fire(self, step: int) -> None:
        """Let the sensors due at a physics step publish, in their order, stamped with its time."""
        if step < self.next_step:
            return
        time_ns = step * self._timestep_ns
        if self.prepare is not None:
            self.prepare([s for i, s in enumerate(self._sensors) if step >= self._steps[i]], time_ns)
        for i, sensor in enumerate(self._sensors):
            if step >= self._steps[i]:
                sensor.publish(time_ns)
                stride = self._strides[i]
                self._steps[i] = (
                    (step // stride + 1) * stride if stride else self._step_after(self._periods[i], time_ns)
                )
        self.next_step = min(self._steps)

    def _step_after(self, period: Period, time_ns: int) -> int:
        return -(-next_due(period, time_ns) // self._timestep_ns)

    def _tell_lateness(self) -> None:
        """Warn, in one sentence per robot and rate, of sensors that cannot be sampled when they are due.

        Not of cameras: the usual 30 Hz never fits, and nobody minds.
        """
        alike: dict[tuple[str, float], list[int]] = {}
        for i, sensor in enumerate(self._sensors):
            is_camera = not isinstance(sensor, SensorPublisher)
            if latest(self._periods[i], self._timestep_ns) > 0 and not is_camera:
                alike.setdefault((sensor.node.namespace, sensor.sensor.spec.rate_hz), []).append(i)
        for (_, rate_hz), group in alike.items():
            names = ", ".join(self._sensors[i].sensor.spec.name for i in group)
            late_ns = latest(self._periods[group[0]], self._timestep_ns)
            self._sensors[group[0]].node.get_logger().warn(
                f"sampled at {rate_hz:g} Hz on average, but up to {late_ns / 1e6:.3g} ms late, as the "
                f"period is no whole number of physics steps ({self._timestep_ns / 1e6:g} ms): {names}"
            )
