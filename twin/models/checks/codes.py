"""Every kind of fault that a robot file can have: its code, its severity and how it is mended in general."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

Severity = Literal["error", "warning"]

ERRORS: Mapping[str, str] = MappingProxyType(
    {
        "no-file": "name an existing file, or a robot of `twin robots`",
        "no-package": "give an existing folder: --package NAME=PATH",
        "too-large": "split the file, or keep meshes in files of their own",
        "bad-xml": "close every tag and quote every attribute",
        "doctype": "remove the DOCTYPE and its entities",
        "not-urdf": "make <robot name='...'> the outermost element",
        "version": "remove the attribute, or set version='1.0'",
        "xacro": "mend the xacro expression, include or argument that is named",
        "missing-attribute": "add the attribute",
        "bad-number": "write plain finite numbers, separated by spaces",
        "missing-link": "add <parent link='...'/> and <child link='...'/>",
        "unknown-link": "define the link, or correct the name",
        "bad-name": "remove line breaks, and spaces at the ends of the name",
        "duplicate-name": "rename one of them",
        "no-links": "add at least one <link name='...'/>",
        "two-parents": "let one of the joints lead to another link",
        "cycle": "turn one of the joints around, or remove it",
        "several-roots": "connect the parts by joints",
        "joint-type": "use one of the types listed",
        "zero-axis": "give a direction such as <axis xyz='0 0 1'/>",
        "missing-limit": "add <limit lower='' upper='' effort='' velocity=''/>",
        "negative-limit": "give the magnitude, without a sign",
        "swapped-limits": "exchange lower and upper",
        "mimic-cycle": "let one of the joints move on its own",
        "bad-inertial": "give one <inertial> with <mass value=''/> and <inertia ixx='' iyy='' izz=''/>",
        "bad-mass": "give a positive mass [kg], or remove <inertial> from a mere frame",
        "impossible-inertia": "no principal moment exceeds the sum of the others: take it from CAD",
        "bad-geometry": "give one shape with positive dimensions",
        "missing-mesh": "correct the path, or give --package NAME=PATH",
        "outside-path": "keep files in the robot's folder or package, or give --allow-path DIR",
        "bad-friction": "give a coefficient of at least 0",
        "bad-drive": "complete the drive plugin",
        "bad-battery": "complete the battery plugin",
        "bad-command": "correct <ros2_control>",
        "bad-sensor": "complete the <sensor>",
        "massless": "give it an <inertial>, or make the joint above it fixed",
        "mesh-format": "export the mesh as STL, OBJ or COLLADA, whole",
        "bad-mesh": "repair or simplify the mesh",
        "mujoco": "change what MuJoCo names",
    }
)
"""Faults that keep the file from being used, and how to mend them."""

WARNINGS: Mapping[str, str] = MappingProxyType(
    {
        "wheel-axis": "the wheel's cylinder does not lie along its joint's axis: it tumbles",
        "wheel-fixed": "a wheel that cannot turn",
        "wheel-rubs": "the wheel's collision shape touches its neighbour's",
        "drive-mismatch": "the drive plugin's numbers are not those of the wheels it names",
        "missing-drive": "the robot has wheels and no drive plugin; if they allow it, twin guesses a drive",
        "base-on-ground": "a part that is no wheel and no caster rests on the ground beside the wheels",
        "wheels-off-ground": "something reaches lower than a wheel does",
        "few-supports": "the robot stands on fewer than three points",
        "skipped-mesh": "a shape that was left out, as its mesh is missing or unreadable",
        "overlap": "collision shapes of links that no joint connects overlap at joint position zero",
        "visual-collision": "what is seen and what is touched are in different places",
        "inertia-too-large": "no mass distribution inside the link's shapes has this inertia",
        "inertia-too-small": "less than a tenth of what the shapes would give: simulations get unstable",
        "turned-mesh": "a COLLADA file says that another axis than z is up, which RViz and Gazebo ignore",
        "undefined-material": "no color of the material is defined; the shape is gray",
        "idle-mimic": "a <mimic> without effect: its leader does not exist, or its joint cannot follow",
        "lumped-inertia": "no body has this inertia; it counts as part of the link to which it is fixed",
        "repaired-inertia": "no body has this inertia; the nearest possible one is taken",
        "inertia-placeholder": "the same moment about every axis, for a shape that is not alike",
        "massless-base": "the base has no mass and can only stand fixed",
        "no-collision": "parts that can be seen but not touched",
        "limits-exclude-zero": "joint position zero, where every simulation starts, is outside of the range",
        "no-range": "lower and upper limit are equal",
        "no-effort": "the joint's effort limit is missing or zero",
        "no-velocity": "the joint's velocity limit is missing or zero",
        "weak-motor": "the motor cannot hold its load against gravity",
        "axis-length": "the axis is no unit vector",
        "rounded-angle": "an angle that is nearly, not exactly, a multiple of 90 degrees",
        "material-elsewhere": "the material is defined in another link, which other readers do not look into",
        "ignored-tag": "an element that URDF does not have here; it has no effect",
        "repeated-tag": "an element that stands twice where URDF has it once",
        "ignored-attribute": "an attribute that URDF does not have here; it has no effect",
        "not-simulated": "a plugin, sensor, transmission or value without the effect that it has in Gazebo",
        "unknown-reference": "`<gazebo reference=''>` names neither a link nor a joint",
        "ignored-value": "the value of a tag in `<gazebo>` is no number",
        "several-interfaces": "a joint can be commanded in several ways, of which the first counts",
        "camera-frame": "the camera is on an optical frame and looks sideways",
    }
)
"""Faults that a robot can be simulated with, and what they mean."""


def severity_of(code: str) -> Severity:
    """Return the severity of a code."""
    return "warning" if code in WARNINGS else "error"
