"""What all types of sensors have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from twin.bridge.msgs import Header
from twin.convert.ledger.fates import Fate
from twin.convert.sensors import SensorBuilder
from twin.geometry import Array
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report
from twin.models.urdf.sensors import Common
from twin.sim.sensors import Mount


class Sensor(ABC):
    """One type of sensor; an object of it measures the world as it is now."""

    types: ClassVar[tuple[str, ...]] = ()
    """`type` of the `<sensor>`s in robot files that it is."""
    topic: ClassVar[str]
    """Relative ROS name, if the file gives none."""
    rate_hz: ClassVar[float]
    """Samples per second, if the file gives none."""
    message: ClassVar[type]
    """The class of its messages."""
    measures: ClassVar[str] = ""
    """The field of its message that tells what it measures, if there are several with numbers."""
    at_origin: ClassVar[bool] = True
    """Whether it measures at the origin of its link, wherever its `<pose>` is."""
    on_demand: ClassVar[bool] = False
    """Whether it measures only if somebody wants its messages, which then are not in the digest of a run."""
    in_mujoco: ClassVar[str] = ""
    """What `to_mujoco` adds, in words; empty: MuJoCo has nothing like it."""
    fates: ClassVar[Mapping[str, Fate]] = MappingProxyType({})
    """What becomes in MuJoCo of the elements below its `<sensor>`, by path; beside those of all sensors."""

    def __init__(self, spec: Any, mount: Mount) -> None:
        """Take what the file says of it, and where it is in a compiled world."""
        self.spec, self.mount = spec, mount
        self._stream = mount.noise(spec.name)

    def _normal(self, time_ns: int, n: int) -> Array:
        """Return `n` standard normal numbers, shape (n,), the same at the same time, seed and name."""
        return self._fill_normal(time_ns, np.empty(n))

    def _fill_normal(self, time_ns: int, out: Array) -> Array:
        """Write the same numbers into `out`, shape (n,), and return it."""
        return self._stream.fill_normal(time_ns // self.mount.world.timestep_ns, out)

    @classmethod
    @abstractmethod
    def read(cls, element: Element, common: Common, report: Report) -> SensorSpec:
        """Return what a `<sensor>` says; `common` are the values of all sensors, faults go into `report`."""

    @abstractmethod
    def sample(self, time_ns: int) -> Any:
        """Return a reading; None: there is none. `time_ns` is the world's time."""

    @classmethod
    @abstractmethod
    def to_message(cls, spec: Any, header: Header, reading: Any) -> Any:
        """Return the message of a reading."""

    @classmethod
    def for_element(cls, element: Element) -> type[Sensor]:
        """Return the class that a `<sensor>` of its types asks for."""
        return cls

    @classmethod
    def companions(cls, element: Element, spec: Any, report: Report) -> Iterator[SensorSpec]:
        """Yield what the same `<sensor>` is besides `spec`, under other names and topics."""
        return iter(())

    @classmethod
    def unlike_gazebo(cls, element: Element) -> Iterator[tuple[str, str]]:
        """Yield what is not simulated of a `<sensor>` as predicates (`has 4 layers`), each with a way out."""
        return iter(())

    @classmethod
    def left_out(cls, spec: Any) -> str:
        """Return why MuJoCo gets none of it; empty if it does."""
        return "" if cls.in_mujoco else "MuJoCo has no sensor like it"

    @classmethod
    def to_mujoco(cls, spec: Any, model: SensorBuilder) -> Iterator[str]:
        """Add MuJoCo's own sensors that measure the same; yield their names."""
        return iter(())

    @classmethod
    def fate(cls, path: str, element: Element, sensor: Element) -> Fate | None:
        """Return what became of an element below its `<sensor>`; None: what becomes of it in all sensors."""
        return cls.fates.get(path)
