"""Sensors that measure wrongly, seldom, late or not at all."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np

from twin.bridge.msgs import new
from twin.errors import nearest
from twin.faults.fault import Effect, FaultContext, FaultOfRobot, one_of, refuse
from twin.faults.messages import Counted, linked
from twin.faults.quantities import altered, is_same, numbers, values_of, with_field
from twin.geometry import Array
from twin.models.sensors import plugin_of
from twin.parameters import Fraction, Positive, Seconds, Share
from twin.scenario.faults import LastingRobotFault
from twin.sensors.lidar import Lidar

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

    remembers = False
    """Whether it has to know what was measured before it began."""
    device: ClassVar[type] = object
    """Of which class the sensor must be."""

    def __init__(self, name: str, config: Any, context: FaultContext) -> None:
        super().__init__(name, config, context)
        sensors: dict[str, SensorPublisher | None] = {
            publisher.sensor.spec.topic: publisher
            for publisher in self.robot.sensors
            if isinstance(publisher.sensor, self.device)
        }
        if self.device is object:
            sensors[JOINT_STATES] = None
        what = self.device.__name__.lower() if self.device is not object else "sensor"
        one_of(what, config.sensor, sensors, "sensor", self.robot.name)
        self.publisher = sensors[config.sensor]
        if self.publisher is None:
            self._filters: list[Callable[[Any, int], Any]] = self.hardware.filters
            self.example: Any = self.hardware.read()
            self.measures = "position"
        else:
            self._filters = self.publisher.filters
            kind = plugin_of(self.publisher.sensor.spec).load()
            self.example, self.measures = new(kind.message), kind.measures
        self.text = f"{type(self).__name__.lower()} of {self.robot.name}'s {config.sensor}"
        self.count = self.changed = 0
        self._is_active = False
        if self.remembers:
            self._filters.append(self._pass)

    def begin(self) -> None:
        """Stand between the sensor and its topic."""
        self._is_active = True
        if not self.remembers:
            self._filters.append(self._pass)

    def end(self) -> None:
        """Leave."""
        self._is_active = False
        if not self.remembers:
            self._filters.remove(self._pass)

    @abstractmethod
    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return what becomes of a reading; None: nothing is said."""

    @property
    def did(self) -> str:
        """What it did to readings, in one word."""
        return "altered"

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


class Dropout(ReadingFault):
    """A sensor has nothing to say now and then, or some of its values are missing."""

    @dataclass(frozen=True, kw_only=True)
    class Config(ReadingConfig):
        """Readings, or values, that are missing."""

        share: Annotated[Share, Fraction]
        """Of the readings, or of the values, that are missing; each on its own."""
        of: Literal["readings", "values"] = "readings"
        """`readings`: nothing is said (joints: the last reading again). `values`: single numbers of an array,
        such as rays of a scan, are NaN."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self._stream = self.noise(config.sensor)
        if config.of == "values" and not isinstance(values_of(self.example).get(self.measures), np.ndarray):
            raise refuse("of", f"sensor '{config.sensor}' measures no array of values; valid is readings")

    @property
    def did(self) -> str:
        """What it did."""
        return "dropped" if self.config.of == "readings" else "with missing values"

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return the reading, or what is left of it."""
        tick, share = self.tick(time_ns), self.config.share
        if self.config.of == "readings":
            return None if self._stream.uniform(tick, 1)[0] < share else reading

        def without(values: Array) -> Array:
            return np.where(self._stream.uniform(tick, len(values)) < share, math.nan, values)

        return altered(reading, self.measures, without)


class Freeze(ReadingFault):
    """A sensor says the last reading again and again, with new stamps."""

    remembers = True

    @dataclass(frozen=True, kw_only=True)
    class Config(ReadingConfig):
        """A sensor that says the same again and again."""

    _last: Any = None

    @property
    def did(self) -> str:
        """What it did."""
        return "frozen"

    def saw(self, reading: Any) -> None:
        """Keep a reading."""
        self._last = reading

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return the last one with the stamp of now."""
        if self._last is None:
            self._last = reading
        now = getattr(reading, "header", None)
        return self._last if now is None else with_field(self._last, "header", now)


class Delay(ReadingFault):
    """What a sensor measures is told late, with the stamp of its time."""

    @dataclass(frozen=True, kw_only=True)
    class Config(ReadingConfig):
        """A sensor that is late."""

        time: Annotated[Seconds, Positive]
        """By how much [s]; nodes hear of it at the first control period after that."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self._delay_ns = round(config.time * 1e9)
        self._past: deque[tuple[int, Any]] = deque()
        self._link: Counted | None = None
        if self.publisher is not None:
            node = self.publisher.node
            topic = node.resolve_name(config.sensor)
            full_name = node.fully_qualified_name
            self._link = Counted(
                lambda heard: (self._delay_ns,), lambda h: (h.topic, h.sender) == (topic, full_name)
            )

    @property
    def did(self) -> str:
        """What it did."""
        return "late"

    @property
    def effect(self) -> Effect:
        """How many readings came late."""
        if self._link is None:
            return super().effect
        return Effect(self._link.changed > 0, self._link.told(f"readings of {self.config.sensor}", self.did))

    def begin(self) -> None:
        """Hold back what is measured from now on."""
        if self._link is None:
            super().begin()
        else:
            linked(self.context.bus).append(self._link)

    def end(self) -> None:
        """Hold back no more."""
        if self._link is None:
            super().end()
        else:
            linked(self.context.bus).remove(self._link)

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return what the joints were so long ago."""
        self._past.append((time_ns, reading))
        found = None
        while self._past and self._past[0][0] <= time_ns - self._delay_ns:
            found = self._past.popleft()[1]
        return found


class LidarFailure(Freeze):
    """A lidar delivers nothing, or nothing of use."""

    device = Lidar

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A lidar delivers nothing, or nothing of use."""

        sensor: str = "scan"
        """Topic of the lidar."""
        kind: Literal["stop", "freeze", "nan", "blind"]
        """`stop`: no scan comes. `freeze`: the last one comes again and again, with new stamps. `nan`: every
        reading is NaN. `blind`: every reading is inf, as if nothing were there."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        what = f"lidar '{config.sensor}' of {self.robot.name}"
        self.text, self.end_text = f"{what}: {config.kind}", f"{what} works again"

    @property
    def did(self) -> str:
        """What it did."""
        return {"stop": "dropped", "freeze": "frozen"}.get(self.config.kind, f"all {self.config.kind}")

    def alter(self, reading: Any, time_ns: int) -> Any:
        """Return what a lidar that fails says."""
        if self.config.kind == "stop":
            return None
        if self.config.kind == "freeze":
            return super().alter(reading, time_ns)
        value = math.nan if self.config.kind == "nan" else math.inf
        return altered(reading, "ranges", lambda values: np.full_like(values, value))
