"""The world of a scenario: an arena by name, and what is different from it in this run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from twin.parameters import Hertz, Kilograms, Metres, MetresPerSecond, NotNegative, Positive, Seconds
from twin.perception.tags.families import FAMILIES, FamilyName
from twin.scenario.fields import NameOrPath, PoseConfig, RosName, SpacePoseConfig, faultless, known
from twin.strict_yaml import Fault, StrictModel
from twin.warehouse.catalogue import catalogue

Length = Annotated[Metres, Positive]


class Obstacle(StrictModel):
    """A box, on the floor or above it, that no map shows."""

    name: RosName
    """Name of its body."""
    pose: PoseConfig = PoseConfig()
    """Where its footprint's centre stands, in the world."""
    size: tuple[Length, Length, Length]
    """Extent along its x, y and z [m]."""
    underside: Annotated[Metres, NotNegative] = 0.0
    """Where it begins, above the floor [m]: a table top, a fork, a load that hangs."""
    mass: Annotated[Kilograms, Positive] | None = None
    """Mass of a box that can be pushed [kg]; absent: it never moves."""
    friction: Annotated[float, NotNegative] = 0.8
    """Coulomb coefficient."""
    appears_within: Length | None = None
    """It comes when a robot's base is this near to its footprint [m]; absent: it is there from the start."""

    route: Annotated[tuple[tuple[Metres, Metres], ...], Field(min_length=1)] | None = None
    """It walks from its pose along these points [x, y] and back again; absent: it stays."""
    speed: Annotated[MetresPerSecond, Positive] = 0.5
    """Of walking [m/s]."""
    yields_within: Length = 1.0
    """It stops before a robot whose base is this near to it, or any part 0.3 m, now or soon [m] ..."""
    patience: Annotated[Seconds, NotNegative] = 3.0
    """... and turns back when that has lasted so long [s]."""

    @faultless
    def _appears_or_moves(self) -> Iterator[Fault]:
        if self.route is not None and (self.mass is not None or self.appears_within is not None):
            yield Fault(("route",), "an obstacle that walks is there from the start and cannot be pushed")
        elif self.appears_within is not None and self.mass is not None:
            said = "an obstacle that appears later cannot be pushed; give it no mass"
            yield Fault(("appears_within",), said)
        if self.underside and self.mass is not None:
            yield Fault(("underside",), "a box that can be pushed stands on the floor; give it no mass")


class TagEntry(StrictModel):
    """A printed tag with a number, which only cameras see."""

    name: str | None = None
    """What the world calls it; absent: its family and id, as `tag36h11:3`."""
    family: FamilyName = "tag36h11"
    """Of which tags it is one: AprilTag's, or one of OpenCV's dictionaries of ArUco."""
    id: Annotated[int, NotNegative]
    """Its number."""
    size: Length
    """Side of its black border, as AprilTag counts; around it is as much white as one module [m]."""
    pose: SpacePoseConfig
    """Middle of its face, in the world; x out of the face, z up along it."""

    @property
    def title(self) -> str:
        """Its name."""
        return self.name or f"{self.family}:{self.id}"

    @faultless
    def _exists(self) -> Iterator[Fault]:
        count = FAMILIES[self.family].total
        if self.id >= count:
            yield Fault(("id",), f"{self.family} has the ids 0 to {count - 1}, not {self.id}")


class GoodOverride(StrictModel):
    """Properties of one of the arena's goods in this run; absent keys keep the arena's."""

    name: str
    """Name of the good in the arena."""
    mass: Annotated[Kilograms, Positive] | None = None
    """Mass [kg]."""
    friction: Annotated[float, NotNegative] | None = None
    """Coulomb coefficient; of a good and a gripper's pads the lower one counts."""

    @property
    def properties(self) -> dict[str, Any]:
        """What is given."""
        return self.model_dump(exclude={"name"}, exclude_none=True)


class WorldConfig(StrictModel):
    """What surrounds the robots."""

    arena: Annotated[NameOrPath, known("arena", catalogue)] | None = None
    """Name of an arena (`twin arenas`), or path of an arena file; absent: an empty floor."""
    obstacles: tuple[Obstacle, ...] = ()
    """Boxes added to the arena, on no map."""
    goods: tuple[GoodOverride, ...] = ()
    """Goods that differ from the arena's."""
    tags: tuple[TagEntry, ...] = ()
    """Printed tags for cameras."""

    @faultless
    def _tags_differ(self) -> Iterator[Fault]:
        titles = [tag.title for tag in self.tags]
        for i, title in enumerate(titles):
            if title in titles[:i]:
                yield Fault(("tags", i), f"there is a tag '{title}' before; give this one a name of its own")

    shadows: bool = False
    """Cameras see shadows, which [takes longer](cameras.md#what-it-costs); all else stays as it is."""


class PhysicsConfig(StrictModel):
    """Rates of the simulation."""

    timestep: Annotated[Seconds, Positive] = 0.002
    """Physics step [s]."""
    control_period: Annotated[Seconds, Positive] = 0.02
    """Time between two runs of the controllers [s]; a whole number of physics steps."""


class RecordingConfig(StrictModel):
    """What goes into the Rerun recording."""

    enabled: bool = True
    """Whether to write one."""
    poses_hz: Annotated[Hertz, Positive] = 25.0
    """Rate of the poses [Hz], at most one per control period."""
    images_hz: Annotated[Hertz, NotNegative] = 1.0
    """Rate of the pictures of each camera [Hz], at most the camera's; 0: none."""
    images: Literal["jpeg", "h264"] = "jpeg"
    """As what they are kept: each by itself, or [as a video](recording.md#video)."""
