"""Robots, arenas and sensors of installed packages are known by name; reading runs nothing of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twin.errors import PluginError, ScenarioError
from twin.models import ReadOptions, load
from twin.models.catalogue import catalogue
from twin.models.checks import check
from twin.scenario import schema
from twin.scenario.detectors import DetectorEntry

URDF = """<robot name="stone"><link name="base_link"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial></link>
<gazebo reference="base_link"><sensor name="skin" type="warmth"/></gazebo></robot>
"""


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder of installed packages."""
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def install(site: Path, package: str, points: str, files: dict[str, str]) -> None:
    info = site / f"{package}-3.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 3.0\n")
    (info / "entry_points.txt").write_text(points)
    for name, text in files.items():
        file = site / package / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)


def test_a_robot_of_a_package_has_a_name_and_its_sensors_are_not_run(site: Path) -> None:
    points = "[twin.robots]\nstone = their_robots.models\n[twin.sensors]\nwarmth = their_robots.skin:Warmth\n"
    files = {
        "__init__.py": "1 / 0",
        "models/stone/stone.urdf": URDF,
        "skin.py": "1 / 0\nclass Warmth: pass",
    }
    install(site, "their_robots", points, files)
    assert catalogue()["stone"] == site / "their_robots/models/stone/stone.urdf"
    description = load("stone")
    assert description.sensors == ()
    assert [finding for finding in check(description) if finding.code == "not-simulated"] == []
    with pytest.raises(PluginError, match=r"__init__.py:1: sensor 'warmth' fails: ZeroDivisionError"):
        load("stone", ReadOptions(execute=True))


def test_two_robots_of_one_name_are_told_to_who_asks_for_them_only(site: Path, tmp_path: Path) -> None:
    install(site, "theirs", "[twin.robots]\njackal = theirs\n", {"jackal.urdf": URDF})
    install(site, "lost", "[twin.robots]\nstone = lost\npebble = nowhere\n", {"__init__.py": ""})
    message = r"two robots are called 'jackal': of twin and theirs 3.0; remove one, or give a path"
    with pytest.raises(PluginError, match=message):
        load("jackal")
    with pytest.raises(
        PluginError, match=r"robot 'stone' of lost 3.0: there is no stone.urdf.xacro or stone.xacro"
    ):
        load("stone")
    with pytest.raises(PluginError, match=r"robot 'pebble' of lost 3.0: there is no package 'nowhere'"):
        load("pebble")
    assert load("diff_bot").name == "diff_bot"


def test_an_arena_of_a_package_is_found_by_a_scenario(site: Path) -> None:
    install(
        site,
        "yards",
        "[twin.arenas]\nyard = yards\n",
        {"yard.yaml": "name: yard\nhall: {x: [0, 5], y: [0, 5]}\n"},
    )
    file = site / "s.yaml"
    text = "name: s\nduration: 1\nworld: {arena: yard}\n"
    text += "robots: [{model: diff_bot}]\nchecks: [{final_pose: {x: 0, y: 0}}]\n"
    file.write_text(text)
    assert schema.load(file).world.arena == "yard"
    file.write_text(text.replace("arena: yard", "arena: yrad"))
    with pytest.raises(ScenarioError, match=r"s.yaml:3: no arena 'yrad': .*did you mean 'yard'"):
        schema.load(file)


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        ("points", r"detector 'eye.py:Eye' must return a list of Pose2 from detect\(points\)"),
        (
            "[Pose2(1.0, float('inf'), 0.0)]",
            r"detector 'eye.py:Eye' returns a pose of \(1, inf, 0\); it must be finite",
        ),
        ("points[99]", r"eye.py:6: detector 'eye.py:Eye' fails: IndexError"),
    ],
)
def test_what_a_detector_finds_is_looked_at(returned: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "eye.py").write_text(
        "from twin.geometry import Pose2\nfrom twin.navigation.docking.faces import Detector\n\n"
        f"class Eye(Detector):\n    def detect(self, points):\n        return {returned}\n"
    )
    entry = DetectorEntry.model_validate({f"{tmp_path}/eye.py:Eye": None})
    with pytest.raises(PluginError, match=message):
        entry.build().detect(np.zeros((3, 2)))


def test_the_detector_that_ships_takes_parameters() -> None:
    assert DetectorEntry.model_validate({"box_faces": {"width": "40 cm"}}).build().config.width == 0.4
