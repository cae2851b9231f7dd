"""A bumper."""

from __future__ import annotations

from dataclasses import dataclass

from twin.models.specs import ContactSpec
from twin.sim.sensors.sensor import Mount


@dataclass(frozen=True, kw_only=True)
class ContactReading:
    """What the bumper feels."""

    time_ns: int
    touched: tuple[str, ...]
    """Names of the bodies that touch the link, the floor and the robot itself not counted; empty for none."""
    force_N: float
    """Sum of the normal forces [N]."""


class ContactSensor:
    """Feels what touches its link."""

    def __init__(self, spec: ContactSpec, mount: Mount) -> None:
        self.spec = spec
        self._world = mount.world
        self._body = mount.body

    def sample(self, time_ns: int) -> ContactReading:
        """Feel."""
        touched: list[str] = []
        force = 0.0
        for contact in self._world.contacts():
            if self._body in (contact.body1, contact.body2):
                touched.append(contact.body2 if contact.body1 == self._body else contact.body1)
                force += contact.force_N
        return ContactReading(time_ns=time_ns, touched=tuple(touched), force_N=force)
