"""Parts that weigh nothing, and inertias that no body of the link's size has, or that were never computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.geometry import Array, matrix_from_quat_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import WORLD, Inertial, RobotDescription
from twin.models.kinematics import rigid_groups
from twin.models.mass_properties import LEAST, describe_repair, inertia_as_urdf, inertia_fault
from twin.models.shapes import Mesh
from twin.models.solids import Shape, all_solid, bounds, homogeneous_inertia

ATTAINABLE = 3.0
"""A box with all its mass in the corners has three times the homogeneous moment; no shape reaches more."""
MESH_SLACK = 1.5
"""A mesh may leave out covers, motors and cables that weigh something outside of it."""
TINY = 0.1
ALIKE = 1.2
"""Up to this ratio of its moments, a shape counts as the same about every axis."""


@dataclass(frozen=True, kw_only=True)
class _Fit:
    """How an inertia compares with shapes."""

    expected: Array
    """Of a homogeneous body [kg m²], shape (3, 3), in link axes."""
    low: float
    high: float
    """Least and largest ratio of the moments about any one axis, the inertia's to `expected`."""
    share: float
    """Of the largest inertia that mass inside the shapes can have."""


def impossible_inertia(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield inertias that no body has: of links lumped into another one, and of bodies to be repaired."""
    settlement = description.settlement
    for name, head in settlement.lumped.items():
        inertial = description.links[name].inertial
        fault = None if inertial is None else inertia_fault(inertial.inertia)
        if inertial is not None and fault is not None and name not in settlement.repaired:
            message = f"no body has this inertia: {fault}; it counts as part of '{head}'"
            fix = "take it from CAD, or give it that of its shape"
            yield finding(description, "lumped-inertia", f"link '{name}'", inertial.line, message, fix)
    for head, repair in settlement.repaired.items():
        inertials = [description.links[name].inertial for name in (head, *repair.parts)]
        line = next(inertial.line for inertial in inertials if inertial is not None)
        message, nearest = describe_repair(head, repair, settlement.bodies[head])
        fix = f"{nearest}, and is taken"
        yield finding(description, "repaired-inertia", f"link '{head}'", line, message, fix)


def inertia(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield inertias that do not fit the link's shapes."""
    for link in description.links.values():
        if link.inertial is None or inertia_fault(link.inertial.inertia) or link.inertial.mass <= LEAST:
            continue
        R = matrix_from_quat_wxyz(link.inertial.T_link_com.quat_wxyz)
        actual = R @ link.inertial.inertia @ R.T
        fits = [
            _fit(actual, shapes, link.inertial)
            for shapes in (link.collisions, link.visuals)
            if shapes and all_solid(shapes)
        ]
        if fits:
            # Of visual and collision, the one that speaks for the file.
            best = min(fits, key=lambda fit: max(fit.high, 1 / fit.low))
            found = _compare(link.inertial, actual, replace(best, share=min(fit.share for fit in fits)))
            if found is not None:
                fix = f"a homogeneous body has {inertia_as_urdf(R.T @ best.expected @ R)}"
                code, message = found
                yield finding(description, code, f"link '{link.name}'", link.inertial.line, message, fix)


def _fit(actual: Array, shapes: Sequence[Shape], inertial: Inertial) -> _Fit:
    expected = homogeneous_inertia(shapes, inertial.mass, inertial.T_link_com.xyz)
    low, high = _ratios(actual, expected)
    share = high / ATTAINABLE
    if any(isinstance(shape.geometry, Mesh) for shape in shapes):
        # Hulls come in all forms. In a box, the variance of mass along an edge is at most edge²/4.
        lower, upper = bounds(shapes)
        variance = (upper - lower) ** 2 / 4.0
        most = MESH_SLACK * inertial.mass * (variance.sum() - variance)
        share = float(np.max(np.diag(actual) / most))
    return _Fit(expected=expected, low=low, high=high, share=share)


def _compare(inertial: Inertial, actual: Array, fit: _Fit) -> tuple[str, str] | None:
    """Return code and message of what is wrong with the `actual` inertia."""
    largest = float(np.linalg.eigvalsh(actual)[2])
    if fit.share > 1.0:
        radius = np.sqrt(largest / inertial.mass)
        return "inertia-too-large", (
            f"moment {largest:.4g} kg m² at {inertial.mass:g} kg needs mass {radius:.3g} m from the axis: "
            f"{fit.share:.3g} times the most that mass inside the shapes can have"
        )
    if fit.low < TINY:
        return "inertia-too-small", f"a moment of the inertia is {fit.low:.2g} times what the shapes give"
    if _is_placeholder(actual, fit.expected):
        return "inertia-placeholder", (
            f"the same moment {largest:.4g} kg m² about every axis is a placeholder: "
            f"it is {fit.low:.2f} to {fit.high:.2f} times what the shapes give"
        )
    return None


def _ratios(actual: Array, expected: Array) -> tuple[float, float]:
    """Return the smallest and largest ratio of the two moments about any one axis."""
    inverse = np.linalg.inv(np.linalg.cholesky(expected))
    ratios = np.linalg.eigvalsh(inverse @ actual @ inverse.T)
    return float(ratios[0]), float(ratios[2])


def _is_placeholder(actual: Array, expected: Array) -> bool:
    isotropic = np.allclose(actual, actual[0, 0] * np.eye(3), rtol=0.0, atol=1e-6 * actual[0, 0])
    moments = np.linalg.eigvalsh(expected)
    return bool(isotropic and moments[2] > ALIKE * moments[0])


def masses(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield rigid parts (links on fixed joints) without mass, and visible ones without collision shape."""
    heads = rigid_groups(description)
    heavy = description.settlement.bodies
    for head in dict.fromkeys(heads.values()):
        links = [description.links[name] for name in heads if heads[name] == head]
        fixed = ", ".join(link.name for link in links if link.name != head)
        others = f" (nor do the links fixed to it: {fixed})" if fixed else ""
        line = description.links[head].line
        if not any(link.name in heavy for link in links) and head != WORLD:
            code, message = "massless", f"moves and weighs nothing{others}"
            if head == description.root:
                code = "massless-base"
                message = f"the base '{head}' weighs nothing{others}; it can only be fixed to the ground"
            fix = "give it <inertial> with <mass value='…'/> and <inertia ixx='…' iyy='…' izz='…'/>"
            yield finding(description, code, f"link '{head}'", line, message, fix)
        visible = [link.name for link in links if link.visuals]
        also = f" (also of {', '.join(visible[1:])})" if visible[1:] else ""
        if visible and not any(link.collisions for link in links):
            first, line = f"link '{visible[0]}'", description.links[visible[0]].line
            message = f"seen, not touched: there is no collision shape{also}"
            fix = "add <collision> with the same <origin> and a simple <geometry>"
            yield finding(description, "no-collision", first, line, message, fix)
