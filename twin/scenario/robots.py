"""The robots of a scenario."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from twin.models.catalogue import catalogue
from twin.parameters import MetresPerSecondSquared, NotNegative, Positive, Seconds
from twin.scenario.detectors import DetectorEntry
from twin.scenario.fields import ArgumentText, NameOrPath, PoseConfig, RosName, faultless, known
from twin.scenario.localisation import Localisation, Odometry, WheelOdometry
from twin.strict_yaml import Fault, StrictModel
from twin.strict_yaml.later import later

if TYPE_CHECKING:
    from twin.scenario.apriltag import AprilTagParameters
    from twin.scenario.battery import BatteryParameters
    from twin.scenario.estimators.lidar_odometry import LidarOdometryParameters
    from twin.scenario.navigation import NavigationConfig
    from twin.scenario.picture_detectors import PictureDetectorEntry
else:  # most robots of small scenarios have none, and it is as much as all the rest
    NavigationConfig = later("twin.scenario.navigation:NavigationConfig")
    AprilTagParameters = later("twin.scenario.apriltag:AprilTagParameters")
    BatteryParameters = later("twin.scenario.battery:BatteryParameters")
    LidarOdometryParameters = later("twin.scenario.estimators.lidar_odometry:LidarOdometryParameters")
    PictureDetectorEntry = later("twin.scenario.picture_detectors:PictureDetectorEntry")


class RobotConfig(StrictModel):
    """One robot."""

    model: Annotated[NameOrPath, known("robot", catalogue)]
    """Name in the catalogue (`twin robots`), or path of a URDF or xacro file."""
    name: RosName | None = None
    """Name of this robot; absent: the model's. Several robots live in `/<name>/`."""
    args: Mapping[str, ArgumentText] = {}
    """Xacro arguments."""
    pose: PoseConfig | None = None
    """Where it starts, in the world; absent: `start`, else the origin."""
    start: str | None = None
    """Name of one of the arena's poses to start from, instead of `pose`."""
    base: Literal["free", "fixed", "kinematic"] = "free"
    """`free`: moved by physics; `fixed`: bolted to the world; `kinematic`: moved by a publisher of poses."""
    command_latency: Annotated[Seconds, NotNegative] = 0.0
    """Between a command to its motors and their start [s]; a whole number of control periods."""
    emergency_deceleration: Annotated[MetresPerSecondSquared, Positive] = 3.0
    """Of its base, when its [emergency stop](guard.md#in-a-run) is pressed."""
    battery: BatteryParameters | None = None
    """What [powers](robots.md#batteries) it, over what its file says; absent: that alone, else nothing that
    could run out."""
    odometry: Odometry = WheelOdometry(type="wheels")
    """Who publishes odom → base; absent: the wheels' controller."""
    lidar_odometry: LidarOdometryParameters | None = None
    """Odometry from the clouds of a lidar; absent: none, `{}`: all defaults."""
    localisation: Localisation | None = None
    """Who estimates its pose; absent: nobody."""
    navigation: NavigationConfig | None = None
    """Its navigation nodes; absent: none, `{}`: all defaults."""
    cameras: Literal["off", "optional", "required"] | None = None
    """Whether its cameras make images. `off`: none; `optional`: none on a computer that cannot draw them;
    `required`: on such a computer the run fails; absent: it fails if a node, a bag or a check wants one."""
    apriltag: AprilTagParameters | None = None
    """What finds tags in the images of a camera; absent: nothing, `{}`: all defaults."""
    detector: DetectorEntry | None = None
    """What finds the boxes that its gripper is to take in the palm's scans; absent: `box_faces`."""
    picture_detector: PictureDetectorEntry | None = None
    """What finds them in [images of a camera](cameras.md#finding-totes) instead; absent: in scans."""

    @property
    def id(self) -> str:
        """The name in the world and on the bus."""
        return self.name or self.model.rpartition("/")[2].partition(".")[0]

    @property
    def is_localised(self) -> bool:
        """Whether something estimates the pose in `map`."""
        return self.localisation is not None and self.localisation.type != "none"

    @faultless
    def _parts_fit(self) -> Iterator[Fault]:
        if self.pose is not None and self.start is not None:
            yield Fault(("start",), "give the robot either a pose or the name of a start, not both")
        if self.navigation is not None and not self.is_localised:
            yield Fault(("navigation",), "navigation needs a localisation of type odometry, amcl or slam")
        if self.apriltag is not None and self.cameras == "off":
            yield Fault(("apriltag",), "tags are found in images, but this robot's cameras are off")
        if self.picture_detector is not None and self.cameras == "off":
            yield Fault(("picture_detector",), "boxes are found in images, but this robot's cameras are off")
        if self.picture_detector is not None and self.detector is not None:
            yield Fault(
                ("detector",),
                "boxes are found in scans or in images: give either detector or picture_detector",
            )
        if self.navigation is not None and self.base != "free":
            yield Fault(("base",), f"navigation needs the base 'free', not '{self.base}'")
