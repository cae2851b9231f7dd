"""A bumper."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import mujoco

from twin.bridge.msgs import Bool, Header
from twin.convert.sensors import SensorBuilder
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report
from twin.models.urdf.sensors import Common
from twin.sensors.sensor import Sensor

CONTACT_FOUND_AND_FORCE, NET_FORCE, ONE_SLOT = 0b11, 3, 1
"""mjCONDATA_FOUND and mjCONDATA_FORCE as bits, `reduce="netforce"`, `num="1"`."""


@dataclass(frozen=True, kw_only=True)
class ContactSpec(SensorSpec):
    """A bumper: tells whether its link touches anything."""

    kind: ClassVar[str] = "contact"


@dataclass(frozen=True, kw_only=True)
class ContactReading:
    """What the bumper feels."""

    time_ns: int
    touched: tuple[str, ...]
    """Names of the bodies that touch the link, the floor and the robot itself not counted; empty for none."""
    force_N: float
    """Sum of the normal forces [N]."""


class ContactSensor(Sensor):
    """Feels what touches its link."""

    types = ("contact",)
    topic, rate_hz = "bumper", 50.0
    message = Bool
    at_origin = False
    in_mujoco = "contact sensor of the body"

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> ContactSpec:
        """Read nothing but what all sensors have."""
        return ContactSpec(**common)

    def sample(self, time_ns: int) -> ContactReading:
        """Feel."""
        every = self.mount.world.contacts()
        body = self.mount.body if every else ""
        mine = [contact for contact in every if body in (contact.body1, contact.body2)]
        touched = tuple(other.body2 if other.body1 == body else other.body1 for other in mine)
        force = sum((contact.force_N for contact in mine), 0.0)
        return ContactReading(time_ns=time_ns, touched=touched, force_N=force)

    @classmethod
    def to_message(cls, spec: ContactSpec, header: Header, reading: ContactReading) -> Bool:
        """Return whether anything touches."""
        return Bool(data=bool(reading.touched))

    @classmethod
    def to_mujoco(cls, spec: ContactSpec, model: SensorBuilder) -> Iterator[str]:
        """Add the number and the net force of the link's contacts."""
        kind, body = mujoco.mjtSensor.mjSENS_CONTACT, mujoco.mjtObj.mjOBJ_BODY
        yield model.sensor(
            spec.name, kind, body, spec.link, intprm=[CONTACT_FOUND_AND_FORCE, NET_FORCE, ONE_SLOT]
        )
