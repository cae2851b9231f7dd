"""`<joint>` elements as data, and the checks that make them a tree."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TypeVar, get_args

from twin.errors import nearest, shortened
from twin.models.description import Joint, JointType, Limit, Link, Mimic
from twin.models.kinematics import ONE_DOF
from twin.models.urdf.document import Element, Report, describe
from twin.models.urdf.links import read_origin

_Item = TypeVar("_Item", Link, Joint)
JOINT_TYPES: tuple[str, ...] = get_args(JointType)
BOUNDED = ("revolute", "prismatic")
SHOWN = 20
"""Names of many that are told."""


def read_joint(element: Element, report: Report) -> Joint:
    """Return a `<joint>`; faults are noted in the report."""
    name = report.required(element, "name")
    kind = element.get("type", "")
    if kind not in JOINT_TYPES:
        message = f"joint '{name}' has type '{kind}'; {nearest(kind, JOINT_TYPES)}"
        report.add(element, message, code="joint-type")
        kind = "fixed"
    dynamics = element.find("dynamics")
    return Joint(
        name=name,
        type=kind,
        parent=_link_of(element, "parent", report),
        child=_link_of(element, "child", report),
        T_parent_joint=read_origin(element, report),
        axis=_read_axis(element, kind, report),
        limit=_read_limit(element, kind, report),
        damping=_read_dynamics(dynamics, "damping", report),
        friction=_read_dynamics(dynamics, "friction", report),
        mimic=_read_mimic(element, report),
        line=report.line(element),
    )


def _link_of(element: Element, role: str, report: Report) -> str:
    child = element.find(role)
    if child is None:
        report.add(element, f"{describe(element)} has no <{role} link='...'/>", code="missing-link")
        return ""
    return report.required(child, "link")


def _read_axis(element: Element, kind: str, report: Report) -> tuple[float, float, float]:
    axis = element.find("axis")
    if axis is None:
        return (1.0, 0.0, 0.0)
    known = len(report.problems)
    x, y, z = report.numbers(axis, "xyz", 3)
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-9:
        if kind not in ("fixed", "floating") and len(report.problems) == known:
            message = f"{describe(element)} has a zero axis; give a direction such as xyz='0 0 1'"
            report.add(axis, message, code="zero-axis")
        return (1.0, 0.0, 0.0)
    return (x / length, y / length, z / length)


def _read_limit(element: Element, kind: str, report: Report) -> Limit:
    limit = element.find("limit")
    if limit is None:
        if kind in BOUNDED:
            needed = "<limit lower='' upper='' effort='' velocity=''/>"
            report.add(element, f"{describe(element)} is {kind} and has no {needed}", code="missing-limit")
        return Limit()
    effort, velocity = report.optional_number(limit, "effort"), report.optional_number(limit, "velocity")
    for what, value in (("effort", effort), ("velocity", velocity)):
        if value is not None and value < 0.0:
            message = f"{describe(element)}: {what} limit {value:g} is negative"
            report.add(limit, message, code="negative-limit")
    if kind not in BOUNDED:
        return Limit(effort=effort, velocity=velocity)
    lower, upper = report.number(limit, "lower", 0.0), report.number(limit, "upper", 0.0)
    if lower > upper:
        message = f"{describe(element)}: lower limit {lower:g} is above the upper limit {upper:g}"
        report.add(limit, message, code="swapped-limits")
        lower, upper = upper, lower
    return Limit(lower=lower, upper=upper, effort=effort, velocity=velocity)


def _read_dynamics(dynamics: Element | None, what: str, report: Report) -> float:
    value = 0.0 if dynamics is None else report.number(dynamics, what, 0.0)
    if value < 0.0:
        report.add(dynamics, f"{describe(dynamics)}: {what} {value:g} is negative", code="negative-limit")
    return value


def _read_mimic(element: Element, report: Report) -> Mimic | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    return Mimic(
        joint=report.required(mimic, "joint"),
        multiplier=report.number(mimic, "multiplier", 1.0),
        offset=report.number(mimic, "offset", 0.0),
    )


def unique(kind: str, items: Iterable[tuple[Element, _Item]], report: Report) -> dict[str, _Item]:
    """Return the items by name in file order, noting names used twice."""
    found: dict[str, _Item] = {}
    for element, item in items:
        if not item.name:
            continue
        if item.name in found:
            earlier = found[item.name].line
            where = f" (first at line {earlier})" if earlier else ""
            message = f"{kind} '{item.name}' is defined twice{where}; names are unique"
            report.add(element, message, code="duplicate-name")
        found.setdefault(item.name, item)
    return found


def check_tree(
    links: Mapping[str, Link], joints: Mapping[str, Joint], elements: Mapping[str, Element], report: Report
) -> str:
    """Return the root link, noting everything that keeps links and joints from being one tree.

    Args:
        links: By name.
        joints: By name.
        elements: XML element of each joint, for messages.
        report: Where problems go.
    """
    parent_joint = _parent_joints(links, joints, elements, report)
    _check_mimics(joints, elements, report)
    roots = [name for name in links if name not in parent_joint]
    if not links:
        report.add(None, "the robot has no links", code="no-links")
    elif not roots:
        _add_cycle(next(iter(links)), parent_joint, elements, report)
    elif len(roots) > 1:
        message = f"the robot has {len(roots)} root links ({shortened(roots)}); connect all but one by joints"
        report.add(None, message, code="several-roots")
    else:
        for loop in _loops(links, lambda link: parent_joint[link].parent if link in parent_joint else ""):
            _add_cycle(loop[0], parent_joint, elements, report)
            break
    return roots[0] if roots else ""


def _parent_joints(
    links: Mapping[str, Link], joints: Mapping[str, Joint], elements: Mapping[str, Element], report: Report
) -> dict[str, Joint]:
    """Return the joint above each link, the first one if there are more, which is noted."""
    parent_joint: dict[str, Joint] = {}
    for joint in joints.values():
        element = elements[joint.name]
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name and name not in links:
                missing = f"{role} link '{name}' of joint '{joint.name}' does not exist"
                report.add(element, f"{missing}; {nearest(name, links)}", code="unknown-link")
        if joint.child in parent_joint:
            both = f"joints '{parent_joint[joint.child].name}' and '{joint.name}'"
            message = f"link '{joint.child}' has two parents: {both}; a robot is a tree"
            report.add(element, message, code="two-parents")
        parent_joint.setdefault(joint.child, joint)
    return parent_joint


def _add_cycle(
    link: str, parent_joint: Mapping[str, Joint], elements: Mapping[str, Element], report: Report
) -> None:
    """Note the cycle that the way up from a link ends in: its links, and its joints with their lines."""
    seen: dict[str, None] = {}
    while link not in seen and link in parent_joint:
        seen[link] = None
        link = parent_joint[link].parent
    path = [*seen]
    joints = [parent_joint[child] for child in reversed(path[path.index(link) if link in seen else 0 :])]
    more = ["..."] if len(joints) > SHOWN else []
    links = " -> ".join([link, *(joint.child for joint in joints[:SHOWN]), *more, *(more and [link])])
    names = [f"'{joint.name}'" + (f" (line {joint.line})" if joint.line else "") for joint in joints]
    told = ", ".join([*names[:SHOWN], *more])
    report.add(elements[joints[0].name], f"the joints form a cycle: {links}, by {told}", code="cycle")


def without_idle_mimics(
    joints: Mapping[str, Joint], elements: Mapping[str, Element], report: Report
) -> dict[str, Joint]:
    """Return the joints without those `<mimic>` that cannot have an effect, which are noted as warnings."""
    moving = dict(joints)
    for name, joint in joints.items():
        if joint.mimic is None:
            continue
        leader = joint.mimic.joint
        if joint.type in ONE_DOF and leader in joints:
            continue
        moving[name] = replace(joint, mimic=None)
        if leader:  # else it was noted before
            why = f"joint '{name}' is {joint.type} and cannot mimic another; remove <mimic>"
            if joint.type in ONE_DOF:
                alone = f"joint '{name}' mimics '{leader}', which does not exist, and moves on its own"
                why = f"{alone}; {nearest(leader, joints)}"
            report.warn(elements[name].find("mimic"), why, code="idle-mimic")
    return moving


def _check_mimics(joints: Mapping[str, Joint], elements: Mapping[str, Element], report: Report) -> None:
    def leader(name: str) -> str:
        mimic = joints[name].mimic
        return mimic.joint if mimic is not None and mimic.joint in joints else ""

    for loop in _loops(joints, leader):
        shown = " -> ".join([*loop[:SHOWN], *["..."] * (len(loop) > SHOWN), loop[0]])
        report.add(elements[loop[0]], f"joint '{loop[0]}' mimics itself: {shown}", code="mimic-cycle")


def _loops(names: Iterable[str], following: Callable[[str], str]) -> Iterator[list[str]]:
    """Yield the loops that names lead into, each once, from where it was entered; '' follows the last one."""
    known: set[str] = set()
    for name in names:
        path: dict[str, None] = {}
        while name and name not in path and name not in known:
            path[name] = None
            name = following(name)
        if name in path:
            yield [*path][[*path].index(name) :]
        known.update(path)
