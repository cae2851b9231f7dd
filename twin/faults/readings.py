"""Sensors that measure wrongly, seldom, late or not at all."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from twin.bridge.msgs import new
from twin.errors import nearest
from twin.faults.fault import Effect, FaultContext, FaultOfRobot, one_of, refuse
from twin.faults.quantities import altered, is_same, numbers
from twin.geometry import Array
from twin.models.sensors import plugin_of
from twin.parameters import Positive
from twin.scenario.faults import LastingRobotFault

if TYPE_CHECKING:
    from twin.nodes.sensor_publishers import SensorPublisher

JOINT_STATES = "joint_states"
"""The sensor that measures the joints: what odometry is made of."""


@dataclass(frozen=True, kw_only=True)
class ReadingConfig(LastingRobotFault):
    """A fault of a sensor."""

    sensor: str
    """Topic of the sensor; `joint_states` is what measures the joints, of which odometry is made as well."""


@dataclass(frozen=True, kw_only=True)
class QuantityConfig(ReadingConfig):
    """A fault of what a sensor measures."""

    field: str | None = None
    """Field of its message, such as `linear_acceleration` or `angular_velocity.z`; absent: what it is for
    (`ranges` of a lidar, `angular_velocity` of an IMU, `position` of joints)."""
    joint: str | None = None
    """Of `joint_states`: which joint; absent: all."""


class ReadingFault(FaultOfRobot):
    """Changes the readings of a sensor, before anybody hears of them."""

    devices: ClassVar[tuple[type, ...]] = (object,)
    """Of which classes the sensor must be one."""
    did = "altered"
    """What it does to readings, in a word."""

    def __init__(self, name: str, config: Any, context: FaultContext) -> None:
        super().__init__(name, config, context)
        sensors: dict[str, SensorPublisher | None] = {
            publisher.sensor.spec.topic: publisher
            for publisher in self.robot.sensors
            if isinstance(publisher.sensor, self.devices)
        }
        if object in self.devices:
            sensors[JOINT_STATES] = None
        what = "sensor" if object in self.devices else self.devices[0].__name__.lower()
        one_of(what, config.sensor, sensors, "sensor", self.robot.name)
        self.publisher = sensors[config.sensor]
        if self.publisher is None:
            filters: list[Callable[[Any, int], Any]] = self.hardware.filters
            self.example: Any = self.hardware.read()
            self.measures = "position"
        else:
            filters = self.publisher.filters
            kind = plugin_of(self.publisher.sensor.spec).load()
            self.example, self.measures = new(kind.message), kind.measures
        self.text = f"{type(self).__name__.lower()} of {self.robot.name}'s {config.sensor}"
        self.count = self.changed = 0
        self._is_active = False
        filters.append(self._pass)  # in the order of the scenario, whichever begins first

    def begin(self) -> None:
        """Alter readings from now on."""
        self._is_active = True

    def end(self) -> None:
        """Let them pass."""
        self._is_active = False

    @abstractmethod
    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return what becomes of a reading; None: nothing is said."""

    @property
    def effect(self) -> Effect:
        """How many readings are other than they would be."""
        text = f"{self.changed} of {self.count} readings of {self.config.sensor} {self.did}"
        return Effect(self.changed > 0, text)

    def tick(self, time_ns: int) -> int:
        """Return the physics step of a time."""
        return time_ns // self.context.world.timestep_ns

    def saw(self, reading: Any) -> None:
        """Take note of a reading before the fault begins."""

    def _pass(self, reading: Any, time_ns: int) -> Any:
        if not self._is_active:
            self.saw(reading)
            return reading
        self.count += 1
        made = self.alter(reading, time_ns)
        self.changed += made is None or not is_same(made, reading)
        return made


class QuantityFault(ReadingFault):
    """Changes one quantity of the readings."""

    def __init__(self, name: str, config: Any, context: FaultContext) -> None:
        super().__init__(name, config, context)
        valid = numbers(self.example)
        tops = [path for path in valid if "." not in path]
        field = config.field or self.measures or (tops[0] if len(tops) == 1 else None)
        if not valid:
            raise refuse("sensor", f"sensor '{config.sensor}' measures no number")
        if field is None:
            raise refuse(
                "", f"sensor '{config.sensor}' measures several quantities; name one: {', '.join(tops)}"
            )
        if field not in valid:
            raise refuse("field", f"sensor '{config.sensor}' measures no '{field}'; {nearest(field, valid)}")
        self.field: str = field
        self._index: int | None = None
        if config.joint is not None:
            if self.publisher is not None:
                raise refuse("joint", f"only the sensor '{JOINT_STATES}' has joints, not '{config.sensor}'")
            names = self.hardware.joint_names
            one_of("joint", config.joint, names, "joint", self.robot.name)
            self._index = names.index(config.joint)

    @abstractmethod
    def changed_values(self, values: Array, time_ns: int) -> Array:
        """Return what numbers of shape (n,) become, as a new array."""

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return a reading with another quantity."""
        return altered(reading, self.field, lambda values: self._at_joint(values, time_ns))

    def _at_joint(self, values: Array, time_ns: int) -> Array:
        made = self.changed_values(values, time_ns)
        if self._index is not None:
            own, made = made[self._index], values.copy()
            made[self._index] = own
        return made


class Noise(QuantityFault):
    """A sensor is noisier than it says: normal noise on top of its own."""

    @dataclass(frozen=True, kw_only=True)
    class Config(QuantityConfig):
        """Noise of a sensor."""

        stddev: Annotated[float, Positive]
        """Of the noise, in the SI unit of the quantity."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self._stream = self.noise(config.sensor)

    def changed_values(self, values: Array, time_ns: int) -> Array:
        """Return values with noise."""
        noise = self._stream.normal(self.tick(time_ns), len(values))
        return values + self.config.stddev * noise


class Bias(QuantityFault):
    """A sensor measures too much, or too little, all the time."""

    @dataclass(frozen=True, kw_only=True)
    class Config(QuantityConfig):
        """Bias of a sensor."""

        by: float
        """What is added, in the SI unit of the quantity."""

    def changed_values(self, values: Array, time_ns: int) -> Array:
        """Return values that are too large."""
        return values + self.config.by
