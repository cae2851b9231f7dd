"""Check that robots touch nothing they are not meant to touch."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Annotated

from twin.parameters import Newtons, NotNegative
from twin.scenario.checks.check import NOTHING, Check, CheckConfig, CheckResult
from twin.scenario.observation import CheckContext, ContactObservation, Observation
from twin.strict_yaml import StrictModel


class AllowedContact(StrictModel):
    """A contact that is no collision; `*` stands for any text."""

    other: str
    """What may be touched: `tote_*`."""
    body: str = "*"
    """Which link of the robot, or which good that it carries, may touch it: `*finger*`, `tote_a`."""

    def matches(self, contact: ContactObservation) -> bool:
        """Whether the contact is meant."""
        return fnmatchcase(contact.other, self.other) and fnmatchcase(contact.body, self.body)


class NoCollisionConfig(CheckConfig):
    """No robot, nor what it carries, touches anything but the floor and what is allowed.

    What a robot carries may stand on something where it is taken up or set down; to drag it along there, or
    to press it down harder than it is gripped, is a collision.
    """

    robot: str | None = None
    """Name of the robot; absent: all robots."""
    max_force: Annotated[Newtons, NotNegative] = 0.0
    """Normal force up to which a touch is no collision [N]."""
    allowed: Sequence[AllowedContact] = ()
    """Contacts that are no collision, however hard."""


class NoCollision(Check):
    """Keeps the first collision and the hardest one."""

    Config = NoCollisionConfig
    config: NoCollisionConfig
    _first: tuple[float, ContactObservation] | None = None
    _hardest: tuple[float, ContactObservation] | None = None
    _force = 0.0
    _moved = False
    _at_s: float | None = None

    def __init__(self, name: str, config: NoCollisionConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._allowed: dict[tuple[str, str, str], bool] = {}

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._at_s = observation.time_s
        self._moved = bool(observation.moved)
        for contact in filter(None, map(self._of_interest, observation.contacts)):
            if self._is_allowed(contact):
                continue
            self._force = max(self._force, contact.force_N)
            if contact.force_N <= self.config.max_force:
                continue
            if self._first is None:
                self._first = (observation.time_s, contact)
            if self._hardest is None or contact.force_N > self._hardest[1].force_N:
                self._hardest = (observation.time_s, contact)

    def _of_interest(self, contact: ContactObservation) -> ContactObservation | None:
        """Return a contact as the check's robot sees it; None if it is not about that robot."""
        if self.config.robot in (None, contact.robot):
            return contact
        turned = contact.by_the_other(self.context.robots)
        return turned if turned is not None and turned.robot == self.config.robot else None

    def _is_allowed(self, contact: ContactObservation) -> bool:
        pair = (contact.robot, contact.body, contact.other)
        if pair not in self._allowed:
            views = filter(None, (contact, contact.by_the_other(self.context.robots)))
            self._allowed[pair] = any(rule.matches(view) for view in views for rule in self.config.allowed)
        return self._allowed[pair]

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is the hardest contact that is not allowed."""
        reason = "" if self._moved else f"{NOTHING}nothing moved"
        if self._at_s is None:
            reason = "the run made no step"
        if self._first is not None and self._hardest is not None:
            reason = _sentence(*self._first)
            if self._hardest != self._first:
                reason += f"; hardest: {_sentence(*self._hardest)}"
        at_s = self._at_s if self._first is None else self._first[0]
        margin = self.config.max_force - self._force
        return self._judged(reason, self._force, self.config.max_force, "N", at_s, margin)

    @property
    def decided(self) -> bool | None:
        """Whether it holds, whatever comes."""
        return None if self._first is None else False


def _sentence(time_s: float, contact: ContactObservation) -> str:
    where = f"{contact.robot}/{contact.body}"
    if contact.carried:
        where = f"{contact.body}, carried by {contact.robot},"
    return f"{where} hit {contact.other} with {contact.force_N:.1f} N at {time_s:.2f} s"
