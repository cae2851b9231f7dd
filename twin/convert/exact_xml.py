"""MJCF text with every number in full: MuJoCo writes six digits, which loses a robot's exact geometry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np
from lxml import etree

SAME = 1e-5
"""Relative difference up to which a number is taken for the rounded form of another."""
WRITTEN_AS_ZERO = 2e-12
"""MuJoCo writes smaller numbers as 0 [SI]."""
POSE = {"pos": "pos", "quat": "quat"}
INERTIAL = {"pos": "ipos", "quat": "iquat", "mass": "mass", "diaginertia": "inertia"}
GEOM = {**POSE, "size": "size"}
_ALIKE = ("axis", "range", "damping", "frictionloss", "armature", "stiffness", "springref")
JOINT = {"actuatorfrcrange": "actfrcrange", **{name: name for name in _ALIKE}}
CAMERA = {**POSE, "fovy": "fovy"}
SENSOR = {"cutoff": "cutoff", "noise": "noise"}
EQUALITY = {"polycoef": "data"}
ACTUATOR = {name: name for name in ("ctrlrange", "forcerange", "gainprm", "biasprm")}


def exact_xml(spec: mujoco.MjSpec) -> str:
    """Return `spec` as MJCF in which positions, sizes, masses and limits keep all their bits.

    Args:
        spec: It is compiled in place.
    """
    model = spec.compile()
    root = etree.fromstring(spec.to_xml(), etree.XMLParser(remove_blank_text=True, huge_tree=True))
    for element, values, names in _sources(root, spec, model):
        for attribute, name in names.items():
            text = element.get(attribute)
            if text is not None:
                element.set(attribute, _exact(text, getattr(values, name)))
    etree.indent(root, "  ")
    return etree.tostring(root, encoding="unicode") + "\n"


def _sources(
    root: Any, spec: mujoco.MjSpec, model: mujoco.MjModel
) -> Iterator[tuple[Any, Any, Mapping[str, str]]]:
    """Yield each element with the object that has its numbers, and what they are called there."""
    for element in root.iterfind("worldbody//body"):
        body = spec.body(element.get("name"))
        yield element, body, POSE
        for inertial in element.iterfind("inertial"):
            yield inertial, model.body(element.get("name")), INERTIAL
        for geom, source in zip(element.findall("geom"), body.geoms, strict=True):
            yield geom, source, GEOM
    for path, named, names in (
        ("worldbody//body/joint", spec.joint, JOINT),
        ("worldbody//body/site", spec.site, POSE),
        ("worldbody//body/camera", spec.camera, CAMERA),
        ("equality/joint", spec.equality, EQUALITY),
        ("sensor/*", spec.sensor, SENSOR),
        ("actuator/general", spec.actuator, ACTUATOR),
    ):
        for element in root.iterfind(path):
            yield element, named(element.get("name")), names


def _exact(text: str, value: Any) -> str:
    rounded = np.array(text.split(), dtype=np.float64)
    exact = np.ravel(value)[: len(rounded)]
    # A component that is nearly zero beside others, or by itself, is written as zero.
    slack = max(WRITTEN_AS_ZERO, SAME * float(np.max(np.abs(rounded), initial=0.0)))
    if len(exact) != len(rounded) or not np.allclose(rounded, exact, rtol=SAME, atol=slack):
        return text
    return " ".join(repr(number).removesuffix(".0") for number in exact.tolist())
