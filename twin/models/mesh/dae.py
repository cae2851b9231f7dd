"""COLLADA (.dae) meshes: all triangles of the scene in metres, and their colour.

An own reader (of https://www.khronos.org/files/collada_spec_1_4.pdf): pycollada leaves out a geometry whose
material is broken, allocates what a file claims, and follows instances of instances without an end.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from xml.parsers import expat

import numpy as np
from lxml import etree

from twin.geometry import Array
from twin.models.mesh.dae_geometry import Part, read_geometry
from twin.models.mesh.mesh_formats import Faces
from twin.models.urdf.document import Element

MOST_NODES = 10_000
"""Nodes and instances that a scene may have once instances of instances are followed."""
DEEPEST = 200
UP_AXES = {
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z_UP": np.eye(3),
}
"""Rotations to z up, by the specification's table of right, up and inward axes."""
_INSTANCES = ("instance_geometry", "instance_controller", "instance_node")

Rgb = tuple[float, float, float]
NO_COLOUR = (math.nan, math.nan, math.nan)


@dataclass(frozen=True, kw_only=True)
class Collada:
    """The triangles of a COLLADA file."""

    points: Array
    """Shape (n, 3) [m]."""
    faces: Faces
    """Shape (m, 3)."""
    colour: Rgb | None
    """The diffuse colour of most of the triangles."""
    face_colours: Array | None
    """The diffuse colour of each triangle, shape (m, 3), not a number where it has none."""
    up_axis: str
    """`X_UP`, `Y_UP` or `Z_UP`."""


def read_dae(data: bytes, *, apply_up_axis: bool, most_faces: int) -> Collada:
    """Return what a COLLADA file shows.

    `<unit meter>` and the nodes' transforms are applied, and `<up_axis>` if it is there and wanted. RViz,
    Gazebo, MoveIt and pinocchio ignore it (rviz_rendering's assimp_loader sets
    IMPORT_COLLADA_IGNORE_UP_DIRECTION, gz-common's ColladaLoader does not read the tag), and some robots
    rely on that: TIAGo's and Baxter's meshes that say Y_UP fit their STL twins only unturned.

    Args:
        data: The file.
        apply_up_axis: Turn the mesh so that what it calls up becomes z.
        most_faces: More triangles are an error.

    Raises:
        ValueError: The file is broken, or has no triangles.
    """
    root = _parse(data)
    by_id = {element.get("id"): element for element in root.iter("{*}*") if element.get("id")}
    parts: list[tuple[Part, Array]] = []
    colours: list[Rgb | None] = []
    count = 0
    for instance, transform in _instances(root, by_id):
        geometry, bind = _geometry(instance, by_id)
        for part in read_geometry(geometry, by_id):
            count += len(part.faces)
            if count > most_faces:
                raise ValueError(f"has more than {most_faces} triangles")
            parts.append((part, transform @ bind))
            colours += [_colour(instance, part.material, by_id)] * len(part.faces)
    if not count:
        raise ValueError("has no triangles in its scene")
    points, faces = _joined(parts)
    points *= _unit(root)
    up_axis = _up_axis(root)
    if apply_up_axis:
        points = points @ UP_AXES[up_axis].T
    known = Counter(colour for colour in colours if colour is not None)
    return Collada(
        points=points,
        faces=faces,
        colour=known.most_common(1)[0][0] if known else None,
        face_colours=np.array([colour or NO_COLOUR for colour in colours]) if known else None,
        up_axis=up_axis,
    )


def _parse(data: bytes) -> Element:
    _refuse_doctype(data)
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True, huge_tree=True
    )
    try:
        root = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        raise ValueError(f"is not well-formed XML: {error.msg}") from None
    if etree.QName(root).localname != "COLLADA":
        raise ValueError(f"is no COLLADA file: its root element is <{etree.QName(root).localname}>")
    return root


def _refuse_doctype(data: bytes) -> None:
    """Entities could read files and exhaust memory. A DOCTYPE stands before the root element."""
    found: list[str] = []

    def stop(name: str, *_: object) -> None:
        found.append(name)
        raise StopIteration

    def refuse(*_: object) -> None:
        raise ValueError("has a DOCTYPE; a mesh needs none")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.StartDoctypeDeclHandler = stop, refuse
    try:
        parser.Parse(data, True)
    except StopIteration:
        return
    except (expat.ExpatError, LookupError) as error:
        raise ValueError(f"is not well-formed XML: {error}") from None


def _unit(root: Element) -> float:
    unit = root.find("{*}asset/{*}unit")
    metres = float(unit.get("meter", "1")) if unit is not None else 1.0
    if not 0.0 < metres < math.inf:
        raise ValueError(f"has a unit of {metres:g} m")
    return metres


def _up_axis(root: Element) -> str:
    # By the specification the default is Y_UP; robots' files without the tag mean that z is up.
    up = (root.findtext("{*}asset/{*}up_axis") or "Z_UP").strip()
    if up not in UP_AXES:
        raise ValueError(f"has the up axis '{up}'; valid: {', '.join(UP_AXES)}")
    return up


def _target(element: Element, attribute: str, by_id: dict[str, Element]) -> Element:
    url = element.get(attribute, "")
    target = by_id.get(url.removeprefix("#")) if url.startswith("#") else None
    if target is None:
        raise ValueError(f"refers to '{url}', which it does not hold")
    return target


def _instances(root: Element, by_id: dict[str, Element]) -> Iterator[tuple[Element, Array]]:
    """Yield the geometry and controller instances of the scene with their transforms."""
    scene = root.find("{*}scene/{*}instance_visual_scene")
    if scene is None:
        raise ValueError("has no scene")
    pending = [(node, np.eye(4), 0) for node in reversed(_children(_target(scene, "url", by_id), "node"))]
    visited = 0
    while pending:
        node, T_scene_parent, depth = pending.pop()
        visited += 1
        if visited > MOST_NODES or depth > DEEPEST:
            raise ValueError(f"has a scene of more than {MOST_NODES} nodes, or deeper than {DEEPEST}")
        if not any(True for _ in node.iter(*(f"{{*}}{tag}" for tag in _INSTANCES))):
            continue  # cameras and lights may have transforms that no mesh has
        T_scene_node = T_scene_parent @ _transform(node)
        below: list[Element] = []
        for child in node:
            tag = _tag(child)
            if tag in ("instance_geometry", "instance_controller"):
                yield child, T_scene_node
            elif tag == "instance_node":
                below.append(_target(child, "url", by_id))
            elif tag == "node":
                below.append(child)
        pending += [(child, T_scene_node, depth + 1) for child in reversed(below)]


def _tag(element: Element) -> str:
    return etree.QName(element).localname if isinstance(element.tag, str) else ""


def _children(element: Element, tag: str) -> list[Element]:
    return [child for child in element if _tag(child) == tag]


def _transform(node: Element) -> Array:
    matrix = np.eye(4)
    for child in node:
        tag = _tag(child)
        if tag in ("matrix", "translate", "rotate", "scale"):
            matrix = matrix @ _step(tag, np.array((child.text or "").split(), dtype=np.float64))
        elif tag in ("lookat", "skew"):
            raise ValueError(f"places a mesh by <{tag}>, which is not read; apply transforms when exporting")
    return matrix


def _step(tag: str, values: Array) -> Array:
    if tag == "matrix":
        return values.reshape(4, 4)
    matrix = np.eye(4)
    if tag == "translate":
        matrix[:3, 3] = values
    elif tag == "scale":
        matrix[:3, :3] = np.diag(values.reshape(3))
    else:
        x, y, z, degrees = values
        length = math.hypot(x, y, z) or 1.0
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / length
        angle = math.radians(degrees)
        matrix[:3, :3] += math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K
    return matrix


def _geometry(instance: Element, by_id: dict[str, Element]) -> tuple[Element, Array]:
    """Return the geometry of an instance, and for a skin the pose in which it is bound."""
    target = _target(instance, "url", by_id)
    if _tag(target) != "controller":
        return target, np.eye(4)
    skin = target.find("{*}skin")
    if skin is None:
        raise ValueError("has a controller that is no skin")
    bind = skin.findtext("{*}bind_shape_matrix")
    matrix = np.eye(4) if bind is None else np.array(bind.split(), dtype=np.float64).reshape(4, 4)
    return _target(skin, "source", by_id), matrix


def _joined(parts: list[tuple[Part, Array]]) -> tuple[Array, Faces]:
    points, faces, count = [], [], 0
    for part, transform in parts:
        points.append(part.points @ transform[:3, :3].T + transform[:3, 3])
        mirrored = np.linalg.det(transform[:3, :3]) < 0.0
        faces.append((part.faces[:, ::-1] if mirrored else part.faces) + count)
        count += len(part.points)
    return np.concatenate(points), np.concatenate(faces)


def _colour(instance: Element, symbol: str, by_id: dict[str, Element]) -> Rgb | None:
    """Return the diffuse colour of a part; None without one, with a texture, or if a reference is broken."""
    bound = [
        use.get("target", "") for use in instance.iter("{*}instance_material") if use.get("symbol") == symbol
    ]
    material = by_id.get((bound[0] if bound else symbol).removeprefix("#"))
    use = None if material is None else material.find("{*}instance_effect")
    effect = None if use is None else by_id.get(use.get("url", "").removeprefix("#"))
    text = None if effect is None else effect.findtext(".//{*}technique/*/{*}diffuse/{*}color")
    try:
        r, g, b = (min(1.0, max(0.0, float(word))) for word in (text or "").split()[:3])
    except ValueError:
        return None
    return (r, g, b)
