"""`<link>` and `<material>` elements as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.errors import ModelError, nearest
from twin.geometry import Array, Pose3
from twin.models.description import Inertial, Link, Surface
from twin.models.mass_properties import LEAST
from twin.models.mesh.meshes import read_mesh
from twin.models.options import ReadOptions
from twin.models.shapes import Box, Capsule, Collision, Cylinder, Geometry, Mesh, SkippedMesh, Sphere, Visual
from twin.models.urdf.document import Element, Report, describe, owner
from twin.models.urdf.packages import Packages, locate

Rgba = tuple[float, float, float, float]

DEFAULT_RGBA: Rgba = (0.7, 0.7, 0.7, 1.0)
GEOMETRIES = ("box", "cylinder", "sphere", "capsule", "mesh")
THINNEST = 1e-9
"""Least dimension of a shape [m]."""


@dataclass(frozen=True, kw_only=True)
class LinkContext:
    """What the links of one file share."""

    report: Report
    packages: Packages
    options: ReadOptions
    materials: Mapping[str, Rgba]
    surfaces: Mapping[str, Surface]


def read_materials(root: Element, report: Report) -> dict[str, Rgba]:
    """Return the colours of all named materials, wherever in the file they are defined."""
    materials: dict[str, Rgba] = {}
    for element in root.iter("material"):
        color = element.find("color")
        if color is None or not element.get("name"):
            continue
        materials.setdefault(element.get("name"), _rgba(color, report))
    return materials


def read_link(element: Element, context: LinkContext) -> Link:
    """Return a `<link>`; faults are noted in the report."""
    report = context.report
    name = report.required(element, "name")
    inertials = element.findall("inertial")
    if len(inertials) > 1:
        message = f"link '{name}' has {len(inertials)} <inertial>; one is allowed"
        report.add(inertials[1], message, code="bad-inertial")
    return Link(
        name=name,
        inertial=_read_inertial(inertials[0], name, report) if inertials else None,
        visuals=tuple(
            Visual(
                **common,
                rgba=_read_material(child, context),
                has_material=child.find("material") is not None,
            )
            for child, common in _shapes(element, "visual", context)
        ),
        collisions=tuple(Collision(**common) for _, common in _shapes(element, "collision", context)),
        surface=context.surfaces.get(name, Surface()),
        line=report.line(element),
    )


def read_origin(element: Element, report: Report) -> Pose3:
    """Return the `<origin>` of an element; without one, the identity."""
    origin = element.find("origin")
    if origin is None:
        return Pose3.from_xyz_rpy()
    zero = (0.0, 0.0, 0.0)
    return Pose3.from_xyz_rpy(*(report.numbers(origin, name, 3, zero) for name in ("xyz", "rpy")))


def _read_inertial(element: Element, link: str, report: Report) -> Inertial | None:
    mass_element, inertia_element = element.find("mass"), element.find("inertia")
    if mass_element is None or inertia_element is None:
        message = f"<inertial> of link '{link}' needs <mass value=''/> and <inertia ixx='' .../>"
        report.add(element, message, code="bad-inertial")
        return None
    mass = report.number(mass_element, "value", 1.0 if mass_element.get("value") else None)
    inertia, centre = _read_inertia(inertia_element, report), read_origin(element, report)
    if mass < 0.0 or 0.0 < mass <= LEAST:
        valid = f"a mass is more than {LEAST:g} kg, or zero for a mere frame"
        report.add(mass_element, f"link '{link}' has mass {mass:g} kg; {valid}", code="bad-mass")
        return None
    if mass <= LEAST and np.max(np.abs(inertia)) <= LEAST:
        return None  # written for a mere frame
    return Inertial(T_link_com=centre, mass=mass, inertia=inertia, line=report.line(element))


def _read_inertia(element: Element, report: Report) -> Array:
    xx, yy, zz = (report.number(element, name) for name in ("ixx", "iyy", "izz"))
    xy, xz, yz = (report.number(element, name, 0.0) for name in ("ixy", "ixz", "iyz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _shapes(link: Element, role: str, context: LinkContext) -> Iterator[tuple[Element, dict[str, Any]]]:
    """Yield the `<visual>` or `<collision>` elements that are not left out, with the values of a `Shape`."""
    for element in link.findall(role):
        geometry = _read_geometry(element, context)
        if geometry is not None:
            yield (
                element,
                {
                    "T_link_geometry": read_origin(element, context.report),
                    "geometry": geometry,
                    "name": element.get("name", ""),
                    "line": context.report.line(element),
                },
            )


def _read_material(element: Element, context: LinkContext) -> Rgba:
    material = element.find("material")
    if material is None:
        return DEFAULT_RGBA
    color = material.find("color")
    if color is not None:
        return _rgba(color, context.report)
    name = material.get("name", "")
    if name in context.materials:
        return context.materials[name]
    if material.find("texture") is None:
        valid = nearest(name, context.materials) if context.materials else "the file defines none"
        message = f"material '{name}' of {owner(element)} is not defined and shown gray; {valid}"
        context.report.warn(material, message, code="undefined-material")
    return DEFAULT_RGBA


def _rgba(color: Element, report: Report) -> Rgba:
    r, g, b, a = report.numbers(color, "rgba", 4, DEFAULT_RGBA)
    return (r, g, b, a)


def _read_geometry(element: Element, context: LinkContext) -> Geometry | None:
    """Return a shape: None is one to leave out, and one with a fault becomes a placeholder."""
    report = context.report
    placeholder = Sphere(radius=1.0)
    geometry = element.find("geometry")
    if geometry is None or len(geometry) != 1:
        message = f"{describe(element)} needs one <geometry> with one shape: {', '.join(GEOMETRIES)}"
        report.add(element, message, code="bad-geometry")
        return placeholder
    shape = geometry[0]
    if shape.tag == "mesh":
        mesh = _read_mesh(shape, context)
        return placeholder if mesh is None and context.options.missing_mesh == "error" else mesh
    if shape.tag not in GEOMETRIES:
        message = f"unknown geometry <{shape.tag}> in {describe(element)}; {nearest(shape.tag, GEOMETRIES)}"
        report.add(shape, message, code="bad-geometry")
        return placeholder
    known = len(report.problems)
    read, dimensions = _read_primitive(shape, report)
    if len(report.problems) == known and min(dimensions) < THINNEST:
        report.add(shape, f"{describe(shape)} has a dimension that is not positive", code="bad-geometry")
    return read


def _read_primitive(shape: Element, report: Report) -> tuple[Geometry, tuple[float, ...]]:
    """Return the shape and its dimensions [m]."""
    if shape.tag == "box":
        x, y, z = report.numbers(shape, "size", 3)
        return Box(size=(x, y, z)), (x, y, z)
    radius = report.number(shape, "radius")
    if shape.tag == "sphere":
        return Sphere(radius=radius), (radius,)
    kind, length = Cylinder if shape.tag == "cylinder" else Capsule, report.number(shape, "length")
    return kind(radius=radius, length=length), (radius, length)


def _read_mesh(shape: Element, context: LinkContext) -> Mesh | None:
    """Return the mesh; None if it is missing or, where the options allow that, unreadable."""
    report, options = context.report, context.options
    reference = report.required(shape, "filename")
    x, y, z = report.numbers(shape, "scale", 3, (1.0, 1.0, 1.0))
    if min(abs(x), abs(y), abs(z)) < THINNEST:
        report.add(shape, f"mesh '{reference}' of {owner(shape)} has a scale of zero", code="bad-geometry")
    if not reference:
        return None
    found = locate(reference, report.source, context.packages)
    reason = found.reason
    if found.path is not None:
        mesh = Mesh(path=found.path, scale=(x, y, z), apply_up_axis=options.apply_up_axis)
        try:
            if options.missing_mesh == "skip":
                read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis)
            return mesh
        except ModelError as error:
            reason = error.problems[0].message
    if options.missing_mesh == "skip":
        _skip(shape, reference, reason, report)
    else:
        report.add(shape, f"mesh '{reference}' of {owner(shape)} {reason}", code=found.code)
    return None


def _skip(shape: Element, reference: str, reason: str, report: Report) -> None:
    link = next(shape.iterancestors("link")).get("name", "")
    element = next(shape.iterancestors("visual", "collision"))
    report.skipped_meshes.append(
        SkippedMesh(
            link=link, role=element.tag, reference=reference, reason=reason, line=report.line(element)
        )
    )
