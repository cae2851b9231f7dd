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
BODY = {"pos": "pos", "quat": "quat"}
INERTIAL = {"pos": "ipos", "quat": "iquat", "mass": "mass", "diaginertia": "inertia"}
GEOM = {"pos": "pos", "quat": "quat", "size": "size"}
JOINT = {
    "axis": "axis",
    "range": "range",
    "actuatorfrcrange": "actfrcrange",
    "damping": "damping",
    "frictionloss": "frictionloss",
    "armature": "armature",
    "stiffness": "stiffness",
    "springref": "springref",
}
SITE = {"pos": "pos", "quat": "quat"}
CAMERA = {"pos": "pos", "quat": "quat", "fovy": "fovy"}
SENSOR = {"cutoff": "cutoff", "noise": "noise"}
EQUALITY = {"polycoef": "data"}
ACTUATOR = {
    "ctrlrange": "ctrlrange",
    "forcerange": "forcerange",
    "gainprm": "gainprm",
    "biasprm": "biasprm",
}


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
        yield element, body, BODY
        for inertial in element.iterfind("inertial"):
            yield inertial, model.body(element.get("name")), INERTIAL
        for geom, source in zip(element.findall("geom"), body.geoms, strict=True):
            yield geom, source, GEOM
        for joint in element.iterfind("joint"):
            yield joint, spec.joint(joint.get("name")), JOINT
        for site in element.iterfind("site"):
            yield site, spec.site(site.get("name")), SITE
        for camera in element.iterfind("camera"):
            yield camera, spec.camera(camera.get("name")), CAMERA
    for element in root.iterfind("equality/joint"):
        yield element, spec.equality(element.get("name")), EQUALITY
    for element in root.iterfind("sensor/*"):
        yield element, spec.sensor(element.get("name")), SENSOR
    for element in root.iterfind("actuator/general"):
        yield element, spec.actuator(element.get("name")), ACTUATOR


def _exact(text: str, value: Any) -> str:
    rounded = np.array(text.split(), dtype=np.float64)
    exact = np.ravel(value)[: len(rounded)]
    # A component that is nearly zero beside others, or by itself, is written as zero.
    slack = max(WRITTEN_AS_ZERO, SAME * float(np.max(np.abs(rounded), initial=0.0)))
    if len(exact) != len(rounded) or not np.allclose(rounded, exact, rtol=SAME, atol=slack):
        return text
    return " ".join(_shortest(number) for number in exact.tolist())


def _shortest(number: float) -> str:
    return repr(number).removesuffix(".0")
