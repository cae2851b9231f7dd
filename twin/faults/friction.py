"""Wheels that slide, and casters that do not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.faults.fault import Effect, Fault, FaultContext, FaultOfRobot, some
from twin.faults.wheels import wheels_of
from twin.parameters import NotNegative, Positive
from twin.scenario.faults import LastingFault, LastingRobotFault, Near

_AT_LIMIT = 0.98
"""Of what friction can give: a wheel that uses more of it slides."""


class Sliding(Fault):
    """Tells in how many ticks shapes needed more than friction gives, or than it would give without it."""

    touched = slid = 0
    _most = 0.0

    def look(self, geoms: list[int], factor: float) -> None:
        """Look at the last physics step; `factor` of their friction the shapes have now."""
        grip = self.context.world.alterations.grip(geoms)
        self.touched += grip.touches
        self._most = max(self._most, grip.share)
        self.slid += grip.share * max(1.0, factor) >= (_AT_LIMIT if factor <= 1.0 else 1.0)

    @property
    def effect(self) -> Effect:
        """Whether wheels slid."""
        text = f"wheels at the limit of friction in {self.slid} of {self.touched} ticks"
        if self.touched and not self.slid:
            text += f"; they used at most {100.0 * self._most:.0f} % of it"
        return Effect(self.slid > 0, text)


class Friction(FaultOfRobot, Sliding):
    """Driven wheels have less grip than they should, or more."""

    value = "factor"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """Driven wheels with another friction."""

        factor: Annotated[float, NotNegative]
        """Of the wheels' own coefficient."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        joint = getattr(config, "joint", None)
        joints = some("driven wheel", joint, wheels_of(self), "joint", self.robot.name)
        handle = self.robot.handle
        shapes = context.world.alterations.wheels(handle.name, handle.description)
        self._geoms = [geom for joint in joints for geom in shapes[joint]]
        self.text = f"{', '.join(joints)} of {self.robot.name}: {config.factor:g} times the friction"

    def begin(self) -> None:
        """Take grip away."""
        self.context.world.alterations.scale_friction(self._geoms, self.config.factor, self)

    def end(self) -> None:
        """Give it back."""
        self.context.world.alterations.scale_friction(self._geoms, None, self)

    def update(self) -> None:
        """See whether the wheels slide."""
        self.look(self._geoms, self.config.factor)


class WheelSlip(Friction):
    """One wheel spins and slides: it is worn, wet or hardly touches."""

    value = ""

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A wheel that spins and slides."""

        joint: str
        """Of the wheel."""
        factor: Annotated[float, NotNegative] = 0.1
        """Of the wheel's own coefficient of friction."""


class SlipperyFloor(Sliding):
    """The floor, or a patch of it, is wet, oily or icy."""

    value = "friction"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingFault):
        """A slippery floor, for the driven wheels of all robots."""

        friction: Annotated[float, NotNegative]
        """Coefficient of friction of wheels there; wheels with less keep theirs."""
        patch: Near | None = None
        """Where; absent: everywhere."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        shapes_of, robots = context.world.alterations.wheels, context.robots.values()
        wheels = [shapes_of(robot.name, robot.handle.description) for robot in robots]
        self._geoms = [geom for robot in wheels for shapes in robot.values() for geom in shapes]
        where = "everywhere" if config.patch is None else "in one place"
        self.text = f"the floor is slippery {where}: {config.friction:g}"

    def begin(self) -> None:
        """Wet the floor."""
        alterations, on_it = self.context.world.alterations, set(self._on_it())
        for geom in self._geoms:
            own = alterations.friction(geom)
            slips = geom in on_it and own > self.config.friction
            alterations.scale_friction((geom,), self.config.friction / own if slips else None, self)

    def end(self) -> None:
        """Dry it."""
        self.context.world.alterations.scale_friction(self._geoms, None, self)

    def update(self) -> None:
        """See which wheels are on the patch, and whether they slide."""
        if on_it := self._on_it():
            self.look(on_it, 0.0)
        self.begin()

    def _on_it(self) -> list[int]:
        patch, alterations = self.config.patch, self.context.world.alterations
        if patch is None:
            return self._geoms
        at = ((geom, alterations.position(geom)) for geom in self._geoms)
        return [g for g, (x, y, _) in at if math.hypot(x - patch.x, y - patch.y) <= patch.within]


class StuckCaster(FaultOfRobot):
    """A caster does not roll any more: it is dragged over the floor."""

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A caster that is dragged over the floor."""

        link: str | None = None
        """Of the caster; absent: all casters."""
        friction: Annotated[float, Positive] = 0.8
        """Coefficient of friction with which it is dragged."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        handle = self.robot.handle
        shapes = context.world.alterations.casters(handle.name, handle.description)
        links = some("caster", config.link, list(shapes), "link", self.robot.name)
        self._geoms = [geom for link in links for geom in shapes[link]]
        self.text = f"{', '.join(links)} of {self.robot.name} stuck"
        self._most = 0.0

    def begin(self) -> None:
        """Block it."""
        self.context.world.alterations.set_friction(self._geoms, self.config.friction)

    def end(self) -> None:
        """Free it."""
        self.context.world.alterations.set_friction(self._geoms, None)

    def update(self) -> None:
        """See how it brakes."""
        self._most = max(self._most, self.context.world.alterations.grip(self._geoms).tangential_N)

    @property
    def effect(self) -> Effect:
        """How hard it braked."""
        return Effect(self._most > 1e-3, f"dragged with up to {self._most:.3g} N")
