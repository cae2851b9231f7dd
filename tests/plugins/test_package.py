"""A user's package with one plugin of each kind, installed with pip, is used by a scenario."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

CODE = {
    "checks": """
from twin.scenario.checks import Check, CheckResult

class Calm(Check):
    def observe(self, observation):
        pass

    def result(self):
        return CheckResult(name=self.name, passed=True)
""",
    "missions": """
from dataclasses import dataclass
from twin.nodes.missions.mission_node import MissionNode

class Nap(MissionNode):
    @dataclass(frozen=True, kw_only=True)
    class Config:
        ticks: int = 1

    def __init__(self, context, config):
        super().__init__(context.bus, namespace=context.namespace)
        self.left = config.ticks
        self.node.create_timer(100_000_000, self.tick)

    def tick(self):
        self.left -= 1
        if self.left == 0:
            self.finish(succeeded=True)
""",
    "sensors": """
from twin.bridge.msgs import Bool
from twin.sensors import Sensor, SensorSpec

class Warmth(Sensor):
    topic, rate_hz, message = "warm", 50.0, Bool

    @classmethod
    def read(cls, element, common, report):
        return SensorSpec(**common)

    def sample(self, time_ns):
        return True

    @classmethod
    def to_message(cls, spec, header, reading):
        return Bool(data=reading)
""",
    "detectors": """
from twin.navigation.docking.detectors import Detector

class Blind(Detector):
    def detect(self, points):
        return []
""",
}
ROBOT = """<robot name="stone"><link name="base_link"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
<collision><geometry><sphere radius="0.2"/></geometry></collision></link>
<gazebo reference="base_link"><sensor name="skin" type="warmth"/></gazebo></robot>
"""
ARENA = "name: yard\nhall: {x: [-5, 5], y: [-5, 5]}\nposes: {gate: [3, 3, 0]}\n"
POINTS = """
[twin.checks]
calm = their_pack.checks:Calm
[twin.missions]
nap = their_pack.missions:Nap
[twin.sensors]
warmth = their_pack.sensors:Warmth
[twin.detectors]
blind = their_pack.detectors:Blind
[twin.robots]
stone = their_pack.robots
[twin.arenas]
yard = their_pack
"""
SCENARIO = """name: theirs
duration: 2 s
world: {arena: yard}
robots:
  - {model: stone, start: gate}
  - model: warehouse_bot
    detector: {BLIND: {}}
mission: {type: NAP, robot: stone, ticks: 2}
checks:
  - mission_succeeded:
  - CALM:
"""
NAMES = {"checks": ("CALM", "Calm"), "missions": ("NAP", "Nap"), "detectors": ("BLIND", "Blind")}


def wheel(folder: Path) -> Path:
    """Write the wheel of a package `their_pack`, version 2.1."""
    info = "their_pack-2.1.dist-info"
    files = {f"their_pack/{name}.py": text for name, text in CODE.items()} | {
        "their_pack/__init__.py": "",
        "their_pack/robots/stone.urdf": ROBOT,
        "their_pack/yard.yaml": ARENA,
        f"{info}/METADATA": "Metadata-Version: 2.1\nName: their-pack\nVersion: 2.1\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: tests\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": POINTS,
    }
    files[f"{info}/RECORD"] = "".join(f"{name},,\n" for name in [*files, f"{info}/RECORD"])
    path = folder / "their_pack-2.1-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


def twin(*arguments: str, folder: Path, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "twin.cli", *arguments]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [str(path or ""), os.getcwd()]))}
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment, check=False)


@pytest.mark.long
def test_a_package_installed_with_pip_is_used(tmp_path: Path) -> None:
    site = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target"]
    subprocess.run([*install, str(site), str(wheel(tmp_path))], check=True)
    text = SCENARIO
    for name, _ in NAMES.values():
        text = text.replace(name, name.lower())
    (tmp_path / "theirs.yaml").write_text(text)

    listed = twin("robots", folder=tmp_path, path=site)
    assert "stone" in listed.stdout
    done = twin("run", "theirs.yaml", "--no-record", "--out", "out", folder=tmp_path, path=site)
    assert done.returncode == 0, done.stdout + done.stderr
    told = [line.partition("executes ")[2] for line in done.stderr.splitlines() if "executes" in line]
    assert {Path(file).name for file in told} == {f"{name}.py" for name in CODE}
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert verdict["plugins"] == dict.fromkeys(["calm", "nap", "warmth", "blind"], "their-pack 2.1")


@pytest.mark.long
def test_the_same_from_plain_files(tmp_path: Path) -> None:
    text = SCENARIO.replace("yard", "./yard.yaml").replace("model: stone", "model: ./stone.urdf")
    for module, (name, attribute) in NAMES.items():
        text = text.replace(name, f"'{module}.py:{attribute}'")
    text += "sensors: ['sensors.py:Warmth']\n"
    for name, code in CODE.items():
        code = code.replace("topic, rate", "types = ('warmth',)\n    topic, rate")
        (tmp_path / f"{name}.py").write_text(code)
    (tmp_path / "stone.urdf").write_text(ROBOT)
    (tmp_path / "yard.yaml").write_text(ARENA)
    (tmp_path / "theirs.yaml").write_text(text)
    done = twin("run", "theirs.yaml", "--no-record", "--out", "out", folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr.count("executes") == len(CODE)
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert len(verdict["plugins"]) == len(CODE)
    assert all(version.startswith("sha256:") for version in verdict["plugins"].values())

    (tmp_path / "missions.py").write_text(CODE["missions"].replace("self.left -= 1", "self.left -= 1 / 0"))
    done = twin("run", "theirs.yaml", "--no-record", "--out", "out", folder=tmp_path)
    assert done.returncode == 2
    assert "missions.py:16: mission 'missions.py:Nap' fails: ZeroDivisionError" in done.stderr
    assert "Traceback" not in done.stderr
