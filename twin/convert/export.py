"""Writing a robot as a folder that plain MuJoCo loads: `robot.xml`, `assets/`, `report.json`.

The MJCF has every number in full: MuJoCo writes six digits, which loses a robot's exact geometry.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from lxml import etree

from twin.convert.bodies import Base, natural_base
from twin.convert.contact_roles import roles_of
from twin.convert.conversion import Conversion, Guess
from twin.convert.convert import convert
from twin.convert.inspection import inspect_robot
from twin.convert.ledger.tags import counts, tag_ledger
from twin.convert.mujoco_log import without_warnings
from twin.convert.self_check import SelfCheck, self_check
from twin.convert.sensors import add_sensors
from twin.errors import ConversionError, Problem
from twin.files.reading import read_bytes
from twin.models.checks import Diagnostic
from twin.models.description import WORLD, RobotDescription

MODEL, REPORT, ASSETS = "robot.xml", "report.json", "assets"

SetOptions = Callable[[mujoco.MjSpec], None]
DriveCheck = Callable[[RobotDescription], "dict[str, Any] | None"]


def export(
    description: RobotDescription,
    folder: Path,
    *,
    base: Base | None = None,
    set_options: SetOptions | None = None,
    drive_check: DriveCheck | None = None,
) -> dict[str, Any]:
    """Write a robot as MJCF with its meshes and a report, and return the report; on an error, write nothing.

    The same robot gives the same bytes. The robot stands on z = 0 if its base is free.

    Args:
        description: The robot.
        folder: Is created; an earlier conversion in it is replaced.
        base: As for `convert`; None: free, unless the base weighs nothing, which the report calls a guess.
        set_options: Sets the physics options that the model is meant for; else MuJoCo's defaults hold.
        drive_check: Drives a robot with a free base and returns what becomes `drive` in the report's
            `self_check`; None for a robot that does not drive.

    Raises:
        ConversionError: As by `convert`; or the folder holds other files; or the model that was written is
            not what the description says.
    """
    folder = _checked(folder)
    conversion = convert(description, base=base or natural_base(description))
    said = description.static or description.root == WORLD
    if base is None and conversion.root_joint is None and not said:
        guess = Guess(element=f"base '{description.root}'", note="bolted down, as it weighs nothing")
        conversion = replace(conversion, guesses=(*conversion.guesses, guess))
    spec = conversion.spec.copy()
    if set_options is not None:
        set_options(spec)
    if conversion.root_joint is not None:
        spec.body(conversion.description.root).pos = [0.0, 0.0, conversion.spawn_height]
    sensors = add_sensors(spec, conversion.description)
    staging = _stage(folder)
    try:
        assets = _write_assets(spec, staging)
        with without_warnings():
            model = _write_and_load(spec, staging / MODEL, description)
            checked = self_check(model, conversion.description)
        if not checked.passed:
            message = f"the model differs from the file, as its numbers are beyond MuJoCo's: {checked}"
            raise ConversionError(Problem(message, description.source, code="mujoco", element="robot"))
        report = _report(description, conversion, model, assets, checked) | {"sensors": sensors}
        if description.battery is not None:
            report["battery"] = asdict(description.battery)
        if drive_check is not None and conversion.root_joint is not None:
            report["self_check"]["drive"] = drive_check(description)
        text = json.dumps(report, indent=2, ensure_ascii=False) + "\n"
        (staging / REPORT).write_text(text, encoding="utf-8")
        staging.chmod(0o755)  # mkdtemp's 0700 would lock out other users
        _replace(staging, folder)
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return report


def _checked(folder: Path) -> Path:
    """Return the folder to write, links followed, if it is new, empty, or an earlier conversion."""
    with _writing(folder):
        target = folder.resolve()
        found = sorted(item.name for item in target.iterdir()) if target.is_dir() else None
        if found is None and target.exists():
            raise ConversionError(f"{folder}: is a file; give a new or empty folder")
    ours = {MODEL, REPORT, ASSETS} if REPORT in (found or ()) else set()
    others = [name for name in found or () if name not in ours]
    if others:
        fault = f"the folder holds other files ({', '.join(others[:3])}); give a new or empty one"
        raise ConversionError(f"{folder}: {fault}")
    return target


def _stage(folder: Path) -> Path:
    """Return a new folder beside `folder`, to be renamed when everything is in it."""
    with _writing(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
        return Path(tempfile.mkdtemp(prefix=f".{folder.name[:100]}.", dir=folder.parent))


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Turn what the system has against a folder into a sentence."""
    try:
        yield
    except (OSError, ValueError, RuntimeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise ConversionError(f"{folder}: cannot be written: {reason}; give another folder") from None


def _write_and_load(spec: mujoco.MjSpec, file: Path, description: RobotDescription) -> mujoco.MjModel:
    try:
        file.write_text(exact_xml(spec.copy()), encoding="utf-8")
        return mujoco.MjModel.from_xml_path(str(file))
    except ValueError as error:
        message = f"MuJoCo does not read what was written: {' '.join(str(error).split())}"
        raise ConversionError(Problem(message, description.source, code="mujoco", element="robot")) from error


def _write_assets(spec: mujoco.MjSpec, folder: Path) -> list[str]:
    """Write the meshes that `spec` holds in memory, each content once."""
    spec.meshdir = ASSETS
    spec.modelfiledir = str(folder)
    for name, content in spec.assets.items():
        target = folder / ASSETS / name
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(content)
    return sorted(spec.assets)


def _replace(new: Path, folder: Path) -> None:
    if not folder.exists():
        with _writing(folder):
            new.rename(folder)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{folder.name}.old.", dir=folder.parent))
    folder.rename(old / folder.name)
    new.rename(folder)
    shutil.rmtree(old)


def _report(
    description: RobotDescription,
    conversion: Conversion,
    model: mujoco.MjModel,
    assets: list[str],
    checked: SelfCheck,
) -> dict[str, Any]:
    tags = tag_ledger(description, roles_of(description))
    return {
        "robot": description.name,
        "source": description.source.name,
        "sha256": hashlib.sha256(read_bytes(description.source)).hexdigest(),
        "mujoco": mujoco.__version__,
        "base": "fixed" if conversion.root_joint is None else "free",
        "spawn_height": conversion.spawn_height,
        "mass": float(model.body_mass.sum()),
        "links": [
            {"name": name, "mass": float(model.body(name).mass[0]), "line": link.line or None}
            for name, link in conversion.description.links.items()
        ],
        "joints": [
            {"name": name, "type": joint.type, "line": joint.line or None}
            for name, joint in description.joints.items()
        ],
        "actuators": [model.actuator(index).name for index in range(model.nu)],
        "drive": None if description.drive is None else asdict(description.drive),
        "assets": assets,
        "self_check": {"passed": checked.passed, **asdict(checked)},
        "diagnostics": [diagnostic_json(item) for item in inspect_robot(description, converts=True)],
        "tags": counts(tags),
        "ledger": [asdict(entry) for entry in tags],
        "guesses": [asdict(guess) for guess in conversion.guesses],
    }


def diagnostic_json(diagnostic: Diagnostic) -> dict[str, Any]:
    """Return a diagnostic as `twin check --json` prints it, with the file's name alone."""
    return {**asdict(diagnostic), "file": diagnostic.file.name}


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
