"""Writing a robot as a folder that plain MuJoCo loads: `robot.xml`, `assets/`, `report.json`."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import mujoco

from twin.convert.bodies import Base, natural_base
from twin.convert.contact_roles import roles_of
from twin.convert.conversion import Conversion, Guess
from twin.convert.convert import convert
from twin.convert.exact_xml import exact_xml
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
