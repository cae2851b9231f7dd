"""What became of `<gazebo>` and of its `<sensor>`s."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from twin.convert.ledger.fates import NO_EFFECT, Fate, container_fate
from twin.models.description import Link, RobotDescription
from twin.models.kinematics import ONE_DOF
from twin.models.sensors import SENSORS, plugin_of
from twin.models.specs import CameraSpec, SensorSpec
from twin.models.urdf.batteries import ELEMENTS as OF_BATTERIES
from twin.models.urdf.batteries import IN_ANY_CASE, batteries, is_battery
from twin.models.urdf.cameras import CAMERA
from twin.models.urdf.document import Element
from twin.models.urdf.drives import CONTROLLER, LEFT, RIGHT, TORQUES, is_drive, library_of
from twin.models.urdf.gazebo import MU1, MU2, SELF_COLLIDE, colour_of, flag_in, number_in, value_of
from twin.models.urdf.sensors import PLUGIN_IMU, kind_of

ELSEWHERE = "not in robot.xml; report.json has it"
TAGS: Mapping[str, Fate] = MappingProxyType(
    {
        "bodyName": ("translated", "body of the site"),
        "pose": ("kept", "pose of the site"),
        "topic": ("dropped", ELSEWHERE),
        "update_rate": ("dropped", f"MuJoCo measures in every step; {ELSEWHERE}"),
        "always_on": ("dropped", "sensors are always on"),
        "collision": ("dropped", "every shape of the link counts"),
    }
)
"""By path below the sensor, without `ray`, `lidar`, `imu`, `camera` and `contact`."""
OF_CAMERAS: Mapping[str, Fate] = MappingProxyType(
    {
        "horizontal_fov": ("translated", "fovy, by the image's shape"),
        "image/width": ("kept", "resolution"),
        "image/height": ("kept", "resolution"),
        "clip/near": ("dropped", f"MuJoCo clips all cameras alike; {ELSEWHERE}"),
        "clip/far": ("dropped", f"MuJoCo clips all cameras alike; {ELSEWHERE}"),
        "image/format": ("dropped", ELSEWHERE),
        "optical_frame_id": ("dropped", ELSEWHERE),
        "camera_info_topic": ("dropped", ELSEWHERE),
        "lens/intrinsics/fx": ("translated", "focalpixel"),
        "lens/intrinsics/fy": ("translated", "focalpixel"),
        "lens/intrinsics/cx": ("translated", "principalpixel"),
        "lens/intrinsics/cy": ("translated", "principalpixel"),
        "segmentation_type": ("dropped", ELSEWHERE),
        "box_type": ("dropped", ELSEWHERE),
        **{
            f"distortion/{name}": ("dropped", f"MuJoCo has no lenses; {ELSEWHERE}")
            for name in ("k1", "k2", "k3", "p1", "p2")
        },
    }
)
WRAPPERS = ("ray", "lidar", "imu", "camera", "contact")


def sensor_fate(element: Element, sensor: Element, link: str, description: RobotDescription) -> Fate:
    """Return the fate of an element of a `<sensor>` on a link or joint, or of that itself."""
    spec = _spec_of(sensor, link, description)
    if spec is None:
        kind = kind_of(sensor) or "without a type"
        left_out = (
            "left out: only runs execute a package's sensor" if kind in SENSORS.names() else "not simulated"
        )
        return "dropped", f"{left_out}: a sensor of type {kind}"
    camera = isinstance(spec, CameraSpec)
    cls = None if camera else plugin_of(spec).load()
    missing = cls.left_out(spec) if cls is not None else ""
    if missing:
        return "dropped", f"{missing}. {ELSEWHERE}"
    if element is sensor:
        return "translated", f"{'camera' if cls is None else cls.in_mujoco}, called '{spec.name}'"
    path = _path(element, sensor)
    own = OF_CAMERAS.get(path) if cls is None else cls.fate(path, element, sensor)
    if own is None and len(element) and path not in TAGS:
        return container_fate(element, lambda child: sensor_fate(child, sensor, link, description))
    if camera and own is None and path.startswith("lens/"):
        return "dropped", f"MuJoCo's cameras are pinholes; {ELSEWHERE}"
    if camera and path.startswith("noise"):
        return "dropped", f"MuJoCo's images are free of noise; {ELSEWHERE}"
    plugin = path.startswith("plugin")
    why = "the plugin is not simulated" if plugin else "no counterpart in MuJoCo"
    return own or TAGS.get(path) or ("dropped", why)


def _spec_of(sensor: Element, link: str, description: RobotDescription) -> SensorSpec | None:
    if sensor.tag == "plugin":
        link = value_of(sensor.find("bodyName"))
    name = sensor.get("name", "")
    for spec in (*description.sensors, *description.cameras):
        lens = isinstance(spec, CameraSpec) and kind_of(sensor) in CAMERA
        if spec.link == link and (
            spec.name in (name, f"{link}_{name}") or (lens and spec.name.startswith(f"{name}_"))
        ):
            return spec
    return None


def _path(element: Element, sensor: Element) -> str:
    tags = []
    while element is not sensor:
        if element.tag not in WRAPPERS or len(element) == 0:
            tags.append(element.tag)
        element = element.getparent()
    return "/".join(reversed(tags))


ONE_FRICTION = "friction is the same in every direction"
SOLVERS = (
    *("maxVel", "minDepth", "maxContacts", "stopCfm", "stopErp", "stopKp", "stopKd"),
    *("fudgeFactor", "cfmDamping"),
)
DROPPED: Mapping[str, str] = MappingProxyType(
    {
        "kp": "MuJoCo's contacts are as stiff as the masses ask for, not in N/m",
        "kd": "MuJoCo's contacts are damped as the masses ask for, not in N s/m",
        "fdir1": ONE_FRICTION,
        "laserRetro": "rays measure no intensity",
        "dampingFactor": "nothing slows down a link as such",
        "kinematic": "bodies move by their joints",
        **dict.fromkeys(SOLVERS, "a matter of Gazebo's solver"),
        "provideFeedback": "MuJoCo computes joint forces anyway; no sensor reads them",
        "initial_joint_position": "joints start at zero",
        "enable_wind": "there is no wind",
        "canonicalBody": "the root link is the model's frame",
    }
)
"""Why tags have no effect; others have no counterpart in MuJoCo."""
UNFUSED = ("preserveFixedJoint", "disableFixedJointLumping")


def gazebo_fate(element: Element, description: RobotDescription) -> Fate:
    """Return the fate of an element of `<gazebo>`, or of that itself."""
    chain = [element]
    while chain[-1].tag != "gazebo" or chain[-1].getparent().getparent() is not None:
        chain.append(chain[-1].getparent())
    gazebo = chain[-1]
    reference = gazebo.get("reference", "").strip()
    if reference and reference not in description.links and reference not in description.joints:
        return "dropped", f"no link or joint is called '{reference}'"
    if element is gazebo:
        return container_fate(element, lambda child: gazebo_fate(child, description))
    top = chain[-2]
    if top.tag == "sensor" or (top.tag == "plugin" and library_of(top) == PLUGIN_IMU):
        return sensor_fate(element, top, reference, description)
    if top.tag == "plugin":
        return _plugin(element, top)
    path = "/".join(item.tag for item in reversed(chain[:-1]))
    if reference in description.links:
        return _of_link(element, path, gazebo, description)
    if reference in description.joints:
        return _of_joint(element, path, reference, description)
    return _of_robot(element, path, description)


def _plugin(element: Element, plugin: Element) -> Fate:
    if is_battery(plugin):
        return _battery(element, plugin)
    if not is_drive(plugin):
        return "dropped", "the plugin is not simulated"
    if element is plugin:
        return "translated", "velocity actuators"
    if element.tag in (*LEFT, *RIGHT):
        return "translated", "velocity actuator of the joint's name"
    if element.tag in TORQUES:
        return "translated", "forcerange of the wheels' actuators"
    if element.tag in CONTROLLER:
        return "dropped", "the drive controller's; not part of the MJCF"
    return "dropped", "the plugin's own business"


def _battery(element: Element, plugin: Element) -> Fate:
    """Return the fate of a battery's plugin, or of what is in it: MuJoCo has none, but runs do."""
    if next(batteries(plugin.getroottree().getroot())) is not plugin:
        return "dropped", "the first battery of the robot counts"
    if element is plugin:
        return "dropped", "MuJoCo has no batteries; twin run drains it, and publishes battery_state"
    if element.tag in IN_ANY_CASE:
        return "dropped", "charge is counted like that in any case"
    if element.tag not in OF_BATTERIES:
        return "dropped", "the plugin's own business"
    if plugin.find(element.tag) is not element:
        return "dropped", f"the first <{element.tag}> counts"
    return "dropped", f"the battery's; {ELSEWHERE}"


def _of_link(element: Element, path: str, gazebo: Element, description: RobotDescription) -> Fate:
    link = description.links[gazebo.get("reference", "").strip()]
    if path in MU1 or path in MU2:
        return _friction(element, path, link)
    if path in SELF_COLLIDE:
        return _self_collide(element, link)
    if path in ("gravity", "turnGravityOff"):
        pulled = flag_in(element) is (path == "gravity")
        if flag_in(element) is None or pulled is not link.surface.gravity:
            return "dropped", "it is neither true nor false, or another one counts"
        return ("kept", "gravity pulls it") if pulled else ("translated", "gravcomp 1")
    if path.split("/")[0] in ("material", "visual"):
        return _colour(element, path, gazebo, description)
    if len(element) and path.split("/")[0] == "collision":
        return container_fate(
            element, lambda child: _of_link(child, f"{path}/{child.tag}", gazebo, description)
        )
    return "dropped", DROPPED.get(path, "no counterpart in MuJoCo")


def _friction(element: Element, path: str, link: Link) -> Fate:
    value, surface = number_in(element), link.surface
    if value is None:
        return "dropped", "it is no number"
    if not link.collisions:
        return "dropped", "its link has no collision shape"
    if path in MU1:
        if value != surface.friction:
            return "dropped", "another mu1 of the link counts"
        return "kept", f"friction {value:g}; in twin run that of goods counts if it is lower"
    if value == surface.friction:
        return "kept", f"{ONE_FRICTION}, as here"
    return "dropped", f"{ONE_FRICTION}; mu1 counts"


def _self_collide(element: Element, link: Link) -> Fate:
    wish = flag_in(element)
    if wish is None:
        return "dropped", "it is neither true nor false"
    if not link.collisions:
        return "dropped", "its link has no collision shape"
    if wish is not link.surface.self_collide:
        return "dropped", "another one of the link counts"
    return ("kept", "it touches other links") if wish else ("translated", "contact excludes with other links")


def _colour(element: Element, path: str, gazebo: Element, description: RobotDescription) -> Fate:
    """Return the fate of what gives visuals a colour; only those without a material of their own take it."""
    colour = colour_of(gazebo)
    source = gazebo.find("visual/material/diffuse")
    source = gazebo.find("material") if source is None else source
    if source is None:
        source = gazebo.find("visual/material/script/name")
    if element is not source:
        if path == "visual" or (path.startswith("visual/") and len(element)):
            return container_fate(
                element, lambda child: _colour(child, f"{path}/{child.tag}", gazebo, description)
            )
        return "dropped", "visuals have a colour, nothing else"
    if colour is None:
        return "dropped", "it is no plain colour that twin knows"
    return _takers(gazebo, colour)


def _takers(gazebo: Element, colour: str) -> Fate:
    name = gazebo.get("reference", "").strip()
    links = [link for link in gazebo.getparent().findall("link") if link.get("name") == name]
    bare = [v for link in links for v in link.findall("visual") if v.find("material") is None]
    if not bare:
        return "dropped", "every visual of its link has a material of its own"
    later = [g for g in gazebo.getparent().findall("gazebo") if g.get("reference", "").strip() == name]
    if [g for g in later if colour_of(g)][-1] is not gazebo:
        return "dropped", "a later colour of the link counts"
    return "translated", f"rgba {colour} of the visuals without a material"


def _of_joint(element: Element, path: str, name: str, description: RobotDescription) -> Fate:
    joint = description.joints[name]
    if path in ("springStiffness", "springReference"):
        spring, value = description.springs.get(name), number_in(element)
        if spring is None or joint.type not in ONE_DOF:
            return "dropped", "the joint has no spring"
        if value != (spring.stiffness if path == "springStiffness" else spring.reference):
            return "dropped", "another one of the joint counts, or it is no number"
        return "kept", "stiffness" if path == "springStiffness" else "springref"
    if path == "implicitSpringDamper":
        if flag_in(element):
            return "kept", "MuJoCo integrates damping implicitly"
        return "dropped", "MuJoCo integrates damping implicitly all the same"
    if path in UNFUSED:
        return ("kept", "no link is fused") if flag_in(element) else ("dropped", "no link is ever fused")
    return "dropped", DROPPED.get(path, "no counterpart in MuJoCo")


def _of_robot(element: Element, path: str, description: RobotDescription) -> Fate:
    flag = flag_in(element)
    if path == "static":
        if flag is not description.static:
            return "dropped", "another one counts, or it is neither true nor false"
        return ("translated", "fixed base") if flag else ("kept", "free base")
    if path in SELF_COLLIDE:
        if flag is None or flag is not description.self_collide:
            return "dropped", "another one counts, or it is neither true nor false"
        return ("kept", "links touch each other") if flag else ("translated", "contact excludes")
    return "dropped", DROPPED.get(path, NO_EFFECT[1] if len(element) else "no counterpart in MuJoCo")
