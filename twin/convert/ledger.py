"""What became of every element of a robot file."""

from __future__ import annotations

from collections.abc import Iterator

from twin.convert.command_fates import CommandFates
from twin.convert.conversion import LedgerEntry, Outcome
from twin.convert.gazebo_fates import gazebo_fate
from twin.convert.roles import Roles
from twin.models.description import Joint, Link, RobotDescription
from twin.models.urdf.document import Report, parse

KNOWN = {"link", "joint", "material", "gazebo", "ros2_control", "transmission"}
"""Top-level elements that the loader reads."""


def describe_conversion(description: RobotDescription, roles: Roles, base: str) -> list[LedgerEntry]:
    """Return the entries of links, joints, drive and sensors, in file order."""
    entries = [_entry(f"robot '{description.name}'", "kept", f"{base} base")]
    for link in description.links.values():
        entries += _link(link, roles)
    for joint in description.joints.values():
        entries += _joint(joint)
    drive = description.drive
    if drive is not None:
        note = f"{drive.kind}: the kinematics is the drive controller's"
        entries.append(_entry("drive plugin", "translated", note))
    for sensor in description.sensors:
        note = f"sampled by the simulator in the frame of link '{sensor.link}'"
        entries.append(_entry(f"sensor '{sensor.name}'", "translated", note))
    return [*entries, *_dropped(description)]


def _link(link: Link, roles: Roles) -> Iterator[LedgerEntry]:
    element = f"link '{link.name}'"
    yield _entry(element, "kept", "body" if link.inertial is not None else "massless body, a frame")
    friction = link.surface.friction
    if link.name in roles.wheels:
        yield _entry(f"collision of {element}", "translated", "ellipsoid: a wheel touches in a point")
        yield _entry(f"contact of {element}", "guessed", "carries the robot without sinking in")
    if friction is not None:
        outcome: Outcome = "kept" if link.collisions else "dropped"
        yield _entry(f"mu1 of {element}", outcome, f"friction {friction:g}, whatever it touches")
    elif link.name in roles.casters:
        yield _entry(f"friction of {element}", "guessed", "none: it slides where a caster would roll")
    elif link.collisions:
        yield _entry(f"friction of {element}", "guessed", "the larger of 1 and that of what it touches")
    if link.name in roles.gripping:
        yield _entry(f"contact of {element}", "guessed", "stiff: a commanded joint presses it against things")


def _joint(joint: Joint) -> Iterator[LedgerEntry]:
    element = f"joint '{joint.name}'"
    kinds = {
        "fixed": "weld",
        "prismatic": "slide",
        "planar": "two slides and a hinge",
        "floating": "three slides and a ball",
    }
    kind = kinds.get(joint.type, "hinge")
    yield _entry(element, "kept" if joint.type not in ("planar", "floating") else "translated", kind)
    limit = joint.limit
    if limit.lower is not None and limit.lower == limit.upper:
        yield _entry(
            f"range of {element}", "dropped", "lower equals upper; MuJoCo cannot hold a range of zero"
        )
    if limit.velocity is not None and joint.type in ("revolute", "prismatic"):
        yield _entry(
            f"velocity limit of {element}", "dropped", "the controller's trajectory has to keep to it"
        )
    if joint.mimic is not None:
        yield _entry(f"mimic of {element}", "translated", f"joint equality with '{joint.mimic.joint}'")


def _dropped(description: RobotDescription) -> Iterator[LedgerEntry]:
    root = parse(description.urdf.encode(), Report(description.source))
    commands = CommandFates(root, description)
    for element in root:
        name = element.get("name") or element.get("reference") or ""
        if element.tag == "transmission":
            outcome, note = commands.of(element)
            yield _entry(f"<transmission> '{name}'", outcome, note)
        elif element.tag not in KNOWN:
            yield _entry(f"<{element.tag}> '{name}'", "dropped", "not part of the simulation")
        for child in element if element.tag == "gazebo" else ():
            outcome, note = gazebo_fate(child, description)
            if outcome == "dropped":
                named = child.tag == "sensor"
                kind = f"sensor '{child.get('name')}'" if named else f"<{child.tag}> of gazebo '{name}'"
                yield _entry(kind, "dropped", note)


def _entry(element: str, outcome: Outcome, note: str) -> LedgerEntry:
    return LedgerEntry(element=element, outcome=outcome, note=note)
