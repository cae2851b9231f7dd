"""Readings of sensors as the ROS messages that their topics carry."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from twin.bridge.bus import Bus
from twin.bridge.msgs import Header, stamp
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.topics import Publisher
from twin.models.sensors import plugin_of
from twin.models.specs import SensorSpec


class SensorDevice(Protocol):
    """A sensor that can be sampled; simulated by `twin.sensors`, or a physical one's driver."""

    @property
    def spec(self) -> SensorSpec:
        """What it is."""

    def sample(self, time_ns: int) -> Any:
        """Return the reading at `time_ns`; None: there is none."""


class SensorPublisher:
    """Publishes one sensor's readings on its topic; the runtime calls it when the sensor is due."""

    def __init__(self, bus: Bus, sensor: SensorDevice, *, namespace: str = "") -> None:
        self.sensor = sensor
        self.filters: list[Callable[[Any, int], Any]] = []
        """What faults make of a message at a time [ns]; None: nothing is said."""
        self.node = bus.create_node(f"{sensor.spec.name}_driver", namespace)
        self._plugin = plugin_of(sensor.spec)
        kind = self._plugin.load()
        self._message, self._to_message = kind.message, kind.to_message
        self._publisher: Publisher[Any] = self.node.create_publisher(
            kind.message, sensor.spec.topic, SENSOR_DATA, on_demand=kind.on_demand
        )
        self._on_demand = kind.on_demand

    def publish(self, time_ns: int) -> None:
        """Sample at `time_ns` and publish, stamped with it; a sensor that fails may have nothing to say."""
        if self._on_demand and not self._publisher.is_wanted:
            return
        if (
            self._plugin.ships
        ):  # and needs no guard; a user's may say the same object again, with other values
            message = self._measure(time_ns)
            if message is not None:
                self._publisher.publish(message, frozen=True)
            return
        with self._plugin.guard:
            message = self._measure(time_ns)
            if message is None:
                return
            if type(message) is self._message:
                self._publisher.publish(message)
                return
        raise self._plugin.error(f"makes a {type(message).__name__}, not a {self._message.__name__}")

    def _measure(self, time_ns: int) -> Any:
        spec, reading = self.sensor.spec, self.sensor.sample(time_ns)
        if reading is None:
            return None
        message = self._to_message(spec, Header(stamp(self.node.now_ns), spec.link), reading)
        for passed in self.filters:
            if message is not None:
                message = passed(message, time_ns)
        return message
