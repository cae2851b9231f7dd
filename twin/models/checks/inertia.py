"""Inertias that no body of the link's size has, or that were never computed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.geometry import Array, matrix_from_quat_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import Inertial, Link, RobotDescription
from twin.models.mass_properties import LEAST, describe_repair, inertia_as_urdf, inertia_fault
from twin.models.solids import homogeneous_inertia, only_primitives

ATTAINABLE = 3.0
"""A box with all its mass in the corners has three times the homogeneous moment; no shape reaches more."""
TINY = 0.1
ALIKE = 1.2
"""Up to this ratio of its moments, a shape counts as the same about every axis."""


def impossible_inertia(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield inertias that no body has: of links lumped into another one, and of bodies to be repaired."""
    settlement = description.settlement
    for name, head in settlement.lumped.items():
        inertial = description.links[name].inertial
        fault = None if inertial is None else inertia_fault(inertial.inertia)
        if inertial is not None and fault is not None and name not in settlement.repaired:
            yield finding(
                description,
                "lumped-inertia",
                f"link '{name}'",
                inertial.line,
                message=f"no body has this inertia: {fault}; it counts as part of '{head}'",
                fix="take it from CAD, or give it that of its shape",
            )
    for head, repair in settlement.repaired.items():
        inertials = [description.links[name].inertial for name in (head, *repair.parts)]
        line = next(inertial.line for inertial in inertials if inertial is not None)
        message, nearest = describe_repair(head, repair, settlement.bodies[head])
        yield finding(
            description,
            "repaired-inertia",
            f"link '{head}'",
            line,
            message=message,
            fix=f"{nearest}, and is taken",
        )


def inertia(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield inertias that do not fit the link's shapes; links with meshes are left alone."""
    for link in description.links.values():
        if link.inertial is None or inertia_fault(link.inertial.inertia) or link.inertial.mass <= LEAST:
            continue
        expected = [
            homogeneous_inertia(shapes, link.inertial.mass, link.inertial.T_link_com.xyz)
            for shapes in (link.collisions, link.visuals)
            if shapes and only_primitives(shapes)
        ]
        if expected:
            yield from _compare(description, link, link.inertial, expected)


def _compare(
    description: RobotDescription, link: Link, inertial: Inertial, expected: list[Array]
) -> Iterator[Diagnostic]:
    R = matrix_from_quat_wxyz(inertial.T_link_com.quat_wxyz)
    actual = R @ inertial.inertia @ R.T
    # Of visual and collision, the one that speaks for the file.
    low, high, nearest = min(
        ((*_ratios(actual, matrix), matrix) for matrix in expected),
        key=lambda item: max(item[1], 1 / item[0]),
    )
    moments = np.linalg.eigvalsh(actual)
    largest = float(moments[2])
    if high > ATTAINABLE:
        radius = np.sqrt(largest / inertial.mass)
        code = "inertia-too-large"
        message = (
            f"moment {largest:.4g} kg m² at {inertial.mass:g} kg needs mass {radius:.3g} m from the axis: "
            f"{high:.3g} times what the shapes give, and {ATTAINABLE:g} times is the most they can hold"
        )
    elif low < TINY:
        code = "inertia-too-small"
        message = f"a moment of the inertia is {low:.2g} times what the shapes give"
    elif _is_placeholder(actual, nearest):
        code = "inertia-placeholder"
        message = (
            f"the same moment {largest:.4g} kg m² about every axis is a placeholder: "
            f"it is {low:.2f} to {high:.2f} times what the shapes give"
        )
    else:
        return
    yield finding(
        description,
        code,
        f"link '{link.name}'",
        inertial.line,
        message=message,
        fix=f"a homogeneous body has {inertia_as_urdf(R.T @ nearest @ R)}",
    )


def _ratios(actual: Array, expected: Array) -> tuple[float, float]:
    """Return the smallest and largest ratio of the two moments about any one axis."""
    inverse = np.linalg.inv(np.linalg.cholesky(expected))
    ratios = np.linalg.eigvalsh(inverse @ actual @ inverse.T)
    return float(ratios[0]), float(ratios[2])


def _is_placeholder(actual: Array, expected: Array) -> bool:
    isotropic = np.allclose(actual, actual[0, 0] * np.eye(3), rtol=0.0, atol=1e-6 * actual[0, 0])
    moments = np.linalg.eigvalsh(expected)
    return bool(isotropic and moments[2] > ALIKE * moments[0])
