"""From a URDF or xacro file, or a robot's name, to a `RobotDescription`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from twin.models.catalogue import resolve
from twin.models.description import WORLD, Joint, Link, RobotDescription, Surface
from twin.models.expansion.expand import expand
from twin.models.kinematics import rigid_groups
from twin.models.mass_properties import describe_repair
from twin.models.options import DEFAULTS, ReadOptions
from twin.models.urdf.batteries import read_battery
from twin.models.urdf.cameras import read_cameras
from twin.models.urdf.commands import read_commands, read_states, read_transmissions
from twin.models.urdf.document import Element, Report, parse
from twin.models.urdf.drives import read_drive
from twin.models.urdf.gazebo import (
    colour_visuals,
    read_self_collide,
    read_springs,
    read_static,
    read_surfaces,
)
from twin.models.urdf.joints import check_tree, read_joint, unique, without_idle_mimics
from twin.models.urdf.line_table import LineTable
from twin.models.urdf.links import LinkContext, read_link, read_materials
from twin.models.urdf.packages import PackagePath, Packages
from twin.models.urdf.sensors import read_sensors
from twin.models.urdf.xml_text import as_utf8, read_utf8

VERSIONS = ("1", "1.0", "1.1", "1.2")
"""1.1 adds the capsule, 1.2 quaternions (urdfdom 5); most files say nothing."""
XACRO_PREFIX = re.compile(rb"xmlns:xacro\s*=")
XACRO_MARKS = (b"$", b"<xacro:")
MOST = {
    "link": 2000,
    "joint": 2000,
    "link/visual": 10_000,
    "link/collision": 5000,
    "gazebo": 10_000,
    "gazebo/sensor": 500,
    "gazebo/plugin": 500,
    "transmission": 2000,
    "ros2_control/joint": 2000,
}
"""Elements of a kind; the largest robots known have 200 links."""


_MOST_KNOWN = 4
_known: dict[tuple[bytes, Path, LineTable | None, str], RobotDescription] = {}
"""Robots that were read, whose text alone says all: another run of one need not read it again."""


def load(name_or_path: str | Path, options: ReadOptions = DEFAULTS) -> RobotDescription:
    """Return a robot as data.

    Args:
        name_or_path: A robot of `catalogue()`, or the path of a URDF or xacro file.
        options: How to read it.

    Raises:
        ModelError: With every fault of the file, each with its line where that is the user's.
    """
    source = resolve(name_or_path)
    raw = read_utf8(source)
    urdf, lines = raw, None
    if _has_xacro(source, raw):
        expanded = expand(source, options)
        urdf, lines = expanded.urdf.encode(), expanded.lines
    if b"mesh" in urdf or options.sensors:  # it is made of more than its text
        return parse_urdf(urdf, source, options, lines=lines)
    key = (urdf, source, lines, repr(options))
    if key not in _known:
        while len(_known) >= _MOST_KNOWN:
            del _known[next(iter(_known))]
        _known[key] = parse_urdf(urdf, source, options, lines=lines)
    return _known[key]


def parse_urdf(
    urdf: str | bytes,
    source: Path,
    options: ReadOptions = DEFAULTS,
    *,
    lines: LineTable | None = None,
) -> RobotDescription:
    """Return the description in a URDF text.

    Args:
        urdf: The text, without xacro.
        source: The file it came from: named in messages, and meshes are relative to it.
        options: What to do about what is missing or impossible.
        lines: Where its elements come from, if `urdf` is not the text of `source`.

    Raises:
        ModelError: With every fault of the text.
    """
    raw = urdf.encode() if isinstance(urdf, str) else as_utf8(urdf, source)
    report = Report(source, lines)
    root = parse(raw, report)
    _refuse_too_many(root, report)
    _check_version(root, report)
    colour_visuals(root)
    surfaces = read_surfaces(root, report)
    report.packages = packages = Packages(PackagePath.of(source, options))
    links = _read_links(root, surfaces, packages, report, options)
    joints, elements = _read_joints(root, report)
    joints = without_idle_mimics(joints, elements, report)
    known = len(report.problems)
    root_link = check_tree(links, joints, elements, report)
    is_tree = len(report.problems) == known
    description = RobotDescription(
        name=report.required(root, "name"),
        source=source,
        urdf=raw.decode(errors="replace"),
        links=links,
        joints=joints,
        root=root_link,
        drive=read_drive(root, joints, report),
        battery=read_battery(root, report),
        commands=read_transmissions(root, joints, report, read_commands(root, joints, report)),
        states=read_states(root, joints),
        sensors=(sensors := read_sensors(root, links, report, options)),
        cameras=read_cameras(root, links, report, taken=[sensor.name for sensor in sensors]),
        springs=read_springs(root, joints),
        static=read_static(root),
        self_collide=read_self_collide(root),
        skipped_meshes=tuple(report.skipped_meshes),
        warnings=tuple(dict.fromkeys(report.warnings)),
        lines=lines,
    )
    if is_tree and not options.repair and len(rigid_groups(description)) == len(links):
        _refuse_impossible(description, root, report)
    # In the order of the files, each once: a material may be used by many visuals.
    distinct = dict.fromkeys(report.problems)
    report.problems = sorted(distinct, key=lambda problem: (str(problem.file), problem.line or 0))
    report.raise_if_any()
    return description


def _refuse_too_many(root: Element, report: Report) -> None:
    for path, most in MOST.items():
        found = len(root.findall(path))
        if found > most:
            what = path.rpartition("/")[2]
            report.add(None, f"the robot has {found} <{what}>; at most {most} are read", code="too-large")
    report.raise_if_any()


def _check_version(root: Element, report: Report) -> None:
    version = root.get("version", "1.0")
    if version not in VERSIONS:
        report.add(root, f"URDF version '{version}' is unknown; valid: 1.0, 1.1, 1.2", code="version")


def _has_xacro(source: Path, raw: bytes) -> bool:
    """Tell whether there is anything to expand: a file without it keeps its line numbers.

    As xacro itself, this goes by the prefix; files of real robots give it several addresses.
    """
    is_xacro = source.suffix == ".xacro" or XACRO_PREFIX.search(raw) is not None
    return is_xacro and any(mark in raw for mark in XACRO_MARKS)


def _read_links(
    root: Element,
    surfaces: Mapping[str, Surface],
    packages: Packages,
    report: Report,
    options: ReadOptions,
) -> dict[str, Link]:
    context = LinkContext(
        report=report,
        packages=packages,
        options=options,
        materials=read_materials(root, report),
        surfaces=surfaces,
    )
    return unique(
        "link", [(element, read_link(element, context)) for element in root.iterfind("link")], report
    )


def _read_joints(root: Element, report: Report) -> tuple[dict[str, Joint], dict[str, Element]]:
    items = [(element, read_joint(element, report)) for element in root.findall("joint")]
    elements: dict[str, Element] = {joint.name: element for element, joint in reversed(items)}
    return unique("joint", items, report), elements


def _refuse_impossible(description: RobotDescription, root: Element, report: Report) -> None:
    """Note rigid bodies with an impossible inertia, unless they never move or only rounding makes them so."""
    settlement = description.settlement
    elements = {element.get("name"): element for element in root.findall("link/inertial/..")}
    for head, repair in settlement.repaired.items():
        if repair.fault and head != WORLD:
            message, nearest = describe_repair(head, repair, settlement.bodies[head])
            element = elements.get(head, elements.get(repair.parts[0] if repair.parts else head))
            inertia = None if element is None else element.find("inertial/inertia")
            report.add(inertia, f"{message}; {nearest}: give --repair to take it", code="impossible-inertia")
