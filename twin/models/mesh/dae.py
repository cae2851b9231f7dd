"""COLLADA (.dae) meshes: all triangles of the scene in metres, and their colour.

An own reader (of https://www.khronos.org/files/collada_spec_1_4.pdf): pycollada leaves out a geometry whose
material is broken, allocates what a file claims, and follows instances of instances without an end.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.parsers import expat

import numpy as np
from lxml import etree

from twin.geometry import Array
from twin.models.mesh.dae_geometry import Allowance, GeometryReader, Part
from twin.models.mesh.mesh_formats import MOST_FACES, Faces, Rgb, TriangleMesh, too_many
from twin.models.urdf.document import Element, safe_parser

MOST_TAGS = 300_000
"""Start and end tags, comments and the like; as many attributes."""
UP_AXES = {
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z_UP": np.eye(3),
}
"""Rotations to z up, by the specification's table of right, up and inward axes."""
_INSTANCES = ("instance_geometry", "instance_controller", "instance_node")

NO_COLOUR = (math.nan, math.nan, math.nan)


def read_dae(data: bytes, *, apply_up_axis: bool) -> TriangleMesh:
    """Return what a COLLADA file shows.

    `<unit meter>` and the nodes' transforms are applied, and `<up_axis>` if it is there and wanted. RViz,
    Gazebo, MoveIt and pinocchio ignore it (rviz_rendering's assimp_loader sets
    IMPORT_COLLADA_IGNORE_UP_DIRECTION, gz-common's ColladaLoader does not read the tag), and some robots
    rely on that: TIAGo's and Baxter's meshes that say Y_UP fit their STL twins only unturned.

    Args:
        data: The file, in UTF-8.
        apply_up_axis: Turn the mesh so that what it calls up becomes z.

    Raises:
        ValueError: The file is broken, has no triangles, or has more of something than is read.
    """
    root = _parse(data)
    # Not by XPath, which sorts what it finds in a time that grows with the square of what one element holds.
    by_id = {element.get("id"): element for element in root.iter("*") if element.get("id")}
    scene, colours = _Scene(by_id), _Colours(by_id)
    placed: list[tuple[Part, Array]] = []
    shades: list[Rgb | None] = []
    count = 0
    for instance, transform in scene.instances(root):
        geometry, bind = scene.geometry(instance)
        for part in scene.reader.parts(geometry):
            scene.allowance.take_piece()
            count += len(part.faces)
            if count > MOST_FACES:
                raise too_many()
            placed.append((part, transform @ bind))
            shades.append(colours.of(instance, part.material))
    if not count:
        raise ValueError("has no triangles in its scene")
    points, faces = _joined(placed)
    points *= _unit(root)
    up_axis = _up_axis(root)
    if apply_up_axis:
        points = points @ UP_AXES[up_axis].T
    sizes = [len(part.faces) for part, _ in placed]
    known: Counter[Rgb] = Counter()
    for shade, size in zip(shades, sizes, strict=True):
        if shade is not None:
            known[shade] += size
    return TriangleMesh(
        points=points,
        faces=faces,
        format="dae",
        colour=known.most_common(1)[0][0] if known else None,
        face_colours=np.repeat([shade or NO_COLOUR for shade in shades], sizes, axis=0) if known else None,
        up_axis=up_axis,
    )


def _parse(data: bytes) -> Element:
    _refuse_doctype(data)
    for sign, noun in ((b"<", "tags"), (b"=", "attributes")):
        if data.count(sign) > MOST_TAGS:
            raise ValueError(f"has more than {MOST_TAGS} {noun}")
    try:
        root = etree.fromstring(data, safe_parser(huge_tree=True))
    except etree.XMLSyntaxError as error:
        raise ValueError(f"is not well-formed XML: {error.msg}") from None
    if etree.QName(root).localname != "COLLADA":
        raise ValueError(f"is no COLLADA file: its root element is <{etree.QName(root).localname}>")
    return root


def _refuse_doctype(data: bytes) -> None:
    """Entities could read files and exhaust memory. A DOCTYPE stands before the root element."""

    def stop(*_: object) -> None:
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


class _Scene:
    """Goes through the nodes of a scene; what instances repeat is read once."""

    def __init__(self, by_id: dict[str, Element]) -> None:
        self._by_id = by_id
        self._nodes: dict[Element, _Node] = {}
        self._bound: dict[Element, tuple[Element, Array]] = {}
        self.allowance = Allowance()
        self.reader = GeometryReader(by_id, self.allowance)

    def instances(self, root: Element) -> Iterator[tuple[Element, Array]]:
        """Yield the geometry and controller instances of the scene with their transforms."""
        scene = root.find("{*}scene/{*}instance_visual_scene")
        if scene is None:
            raise ValueError("has no scene")
        showing = _showing(root)
        top = _target(scene, "url", self._by_id)
        pending = [(node, np.eye(4)) for node in reversed(top) if _tag(node) == "node"]
        while pending:
            element, T_scene_parent = pending.pop()
            if element not in showing:
                continue  # cameras and lights may have transforms that no mesh has
            node = self._node(element)
            T_scene_node = T_scene_parent @ node.transform
            for instance in node.instances:
                self.allowance.take_piece()
                yield instance, T_scene_node
            for child in reversed(node.below):
                self.allowance.take_piece()
                pending.append((child, T_scene_node))

    def _node(self, element: Element) -> _Node:
        if element not in self._nodes:
            below = [
                _target(child, "url", self._by_id) if _tag(child) == "instance_node" else child
                for child in element
                if _tag(child) in ("node", "instance_node")
            ]
            instances = [child for child in element if _tag(child) in _INSTANCES[:2]]
            transform = _transform(element, self.allowance)
            self._nodes[element] = _Node(transform=transform, instances=instances, below=below)
        return self._nodes[element]

    def geometry(self, instance: Element) -> tuple[Element, Array]:
        """Return the geometry of an instance, and for a skin the pose in which it is bound."""
        target = _target(instance, "url", self._by_id)
        if _tag(target) != "controller":
            return target, np.eye(4)
        if target not in self._bound:
            skin = target.find("{*}skin")
            if skin is None:
                raise ValueError("has a controller that is no skin")
            bind = skin.findtext("{*}bind_shape_matrix")
            matrix = np.eye(4) if bind is None else self.allowance.numbers(bind, np.float64).reshape(4, 4)
            self._bound[target] = _target(skin, "source", self._by_id), matrix
        return self._bound[target]


@dataclass(frozen=True, kw_only=True)
class _Node:
    transform: Array
    instances: Sequence[Element]
    below: Sequence[Element]


def _showing(root: Element) -> set[Element]:
    """Return all elements with an instance in them."""
    showing: set[Element] = set()
    for instance in root.iter(*(f"{{*}}{tag}" for tag in _INSTANCES)):
        above = instance
        while above is not None and above not in showing:
            showing.add(above)
            above = above.getparent()
    return showing


def _tag(element: Element) -> str:
    return etree.QName(element).localname if isinstance(element.tag, str) else ""


def _transform(node: Element, allowance: Allowance) -> Array:
    matrix = np.eye(4)
    for child in node:
        tag = _tag(child)
        if tag in ("matrix", "translate", "rotate", "scale"):
            allowance.take_piece()
            matrix = matrix @ _step(tag, allowance.numbers(child.text, np.float64))
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


def _joined(parts: list[tuple[Part, Array]]) -> tuple[Array, Faces]:
    points, faces, count = [], [], 0
    for part, transform in parts:
        points.append(part.points @ transform[:3, :3].T + transform[:3, 3])
        mirrored = np.linalg.det(transform[:3, :3]) < 0.0
        faces.append((part.faces[:, ::-1] if mirrored else part.faces) + count)
        count += len(part.points)
    return np.concatenate(points), np.concatenate(faces)


class _Colours:
    """Finds the diffuse colours of materials, each once."""

    def __init__(self, by_id: dict[str, Element]) -> None:
        self._by_id = by_id
        self._targets: dict[Element, dict[str | None, str]] = {}
        self._found: dict[str, Rgb | None] = {}

    def of(self, instance: Element, symbol: str) -> Rgb | None:
        """Return a part's colour; None without one, with a texture, or if a reference is broken."""
        if instance not in self._targets:
            uses = reversed(list(instance.iter("{*}instance_material")))  # the first one of a symbol counts
            self._targets[instance] = {use.get("symbol"): use.get("target", "") for use in uses}
        material = self._targets[instance].get(symbol, symbol).removeprefix("#")
        if material not in self._found:
            self._found[material] = self._diffuse(self._by_id.get(material))
        return self._found[material]

    def _diffuse(self, material: Element | None) -> Rgb | None:
        use = None if material is None else material.find("{*}instance_effect")
        effect = None if use is None else self._by_id.get(use.get("url", "").removeprefix("#"))
        text = None if effect is None else effect.findtext(".//{*}technique/*/{*}diffuse/{*}color")
        try:
            r, g, b = (min(1.0, max(0.0, float(word))) for word in (text or "").split(None, 3)[:3])
        except ValueError:
            return None
        return (r, g, b)
