"""A user's package with one plugin of each kind, installed with pip, is used by a run; its files likewise."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent / "their_pack"
CLASSES = {
    "checks": "checks:Thorough",
    "missions": "missions:Errand",
    "sensors": "sensors:Warmth",
    "detectors": "detectors:Sure",
    "controllers": "control:Ahead",
    "critics": "control:Calm",
    "goal_checkers": "control:Near",
    "progress_checkers": "control:Patient",
    "planners": "planning:Straight",
    "smoothers": "planning:Every",
    "layers": "planning:Pit",
    "bt_nodes": "trees:Say",
}
"""By the group of their entry points. A name in lists of navigation is the class's own, as in Nav2."""
LISTED = ("critics", "layers", "bt_nodes")
SCENARIO = """name: theirs
duration: 20 s
world: {arena: <yard>}
robots:
  - {model: <stone>, start: gate}
  - model: warehouse_bot
    start: yard
    localisation: {type: amcl}
    detector: {<detectors>: {}}
    navigation:
      planner: {plugin: <planners>}
      smoother: {plugin: <smoothers>}
      global_costmap: {plugins: [static_layer, <layers>, inflation_layer], Pit: {x: -3.0, y: -3.0}}
      controller:
        plugin: <controllers>
        speed: 30 cm/s
        goal_checker: {plugin: <goal_checkers>, xy_goal_tolerance: 90 cm}
        progress_checker: <progress_checkers>
      controllers:
        Rollouts:
          plugin: mppi
          critics: [GoalCritic, <critics>]
          Calm: {weight: 0.5}
          goal_checker: position
          xy_goal_tolerance: 60 cm
        Windows:
          plugin: dwb
          critics: [PathAlign, PathDist, <critics>]
          goal_checker: position
          xy_goal_tolerance: 30 cm
      navigator: {plugins: [<bt_nodes>], default_nav_to_pose_bt_xml: tree.xml}
mission: {type: <missions>, robot: warehouse_bot, distance: 1.5 m}
checks:
  - mission_succeeded:
  - no_collision:
  - <checks>: {at_least: 13}
"""
TREE = """<root BTCPP_format="4"><BehaviorTree ID="Go"><Sequence>
  <Say text="go"/>
  <ComputePathToPose goal="{goal}" path="{path}"/>
  <SmoothPath unsmoothed_path="{path}" smoothed_path="{path}"/>
  <FollowPath path="{path}" controller_id="FollowPath" goal_checker_id="general_goal_checker"/>
  <FollowPath path="{path}" controller_id="Rollouts" goal_checker_id="Rollouts"/>
  <FollowPath path="{path}" controller_id="Windows" goal_checker_id="Windows"/>
</Sequence></BehaviorTree></root>
"""


def written(folder: Path, names: dict[str, str]) -> None:
    text = SCENARIO
    for place, name in names.items():
        text = text.replace(f"<{place}>", name)
    (folder / "theirs.yaml").write_text(text)
    (folder / "tree.xml").write_text(TREE)


def wheel(folder: Path) -> Path:
    """Write the wheel of the package, version 2.1."""
    info = "their_pack-2.1.dist-info"
    points = [
        f"[twin.{group}]\n{place.rpartition(':')[2]} = their_pack.{place}\n"
        for group, place in CLASSES.items()
    ]
    points += ["[twin.robots]\nstone = their_pack.robots\n[twin.arenas]\nyard = their_pack\n"]
    sources = [path for path in PACKAGE.rglob("*.*") if path.suffix != ".pyc"]
    files = {str(path.relative_to(PACKAGE.parent)): path.read_text() for path in sources} | {
        f"{info}/METADATA": "Metadata-Version: 2.1\nName: their-pack\nVersion: 2.1\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: tests\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": "".join(points),
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


def ran(folder: Path, path: Path | None = None) -> tuple[dict[str, str], list[str]]:
    """Run the scenario; return the plugins of the verdict, and the files that were executed."""
    done = twin("run", "theirs.yaml", "--no-record", "--out", "out", folder=folder, path=path)
    assert done.returncode == 0, done.stdout + done.stderr
    verdict = json.loads((folder / "out" / "verdict.json").read_text())
    (thorough,) = [check for check in verdict["checks"] if "horough" in check["name"]]
    parts = "Ahead|Calm of DWB|Calm of MPPI|Errand|Every|Near|Patient|Pit|Pit, as the planner sees it"
    assert thorough["reason"] == f"{parts}|Say go|Straight|Sure|Warmth"
    told = [line.partition("executes ")[2] for line in done.stderr.splitlines() if "executes" in line]
    return verdict["plugins"], [Path(file).name for file in told]


@pytest.mark.long
def test_a_package_installed_with_pip_is_used(tmp_path: Path) -> None:
    site = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target"]
    subprocess.run([*install, str(site), str(wheel(tmp_path))], check=True)
    names = {group: place.rpartition(":")[2] for group, place in CLASSES.items()}
    written(tmp_path, {**names, "stone": "stone", "yard": "yard"})

    assert "stone" in twin("robots", folder=tmp_path, path=site).stdout
    twin("convert", "stone", "-o", "model", folder=tmp_path, path=site)
    tags = json.loads((tmp_path / "model" / "report.json").read_text())["ledger"]
    (skin,) = [tag for tag in tags if tag["element"] == "sensor 'skin'"]
    assert skin["note"] == "left out: only runs execute a package's sensor: a sensor of type Warmth"
    plugins, executed = ran(tmp_path, site)
    assert plugins == dict.fromkeys(names.values(), "their-pack 2.1")
    assert set(executed) == {f"{place.partition(':')[0]}.py" for place in CLASSES.values()}


@pytest.mark.long
def test_the_same_from_plain_files(tmp_path: Path) -> None:
    shutil.copytree(PACKAGE, tmp_path, dirs_exist_ok=True)
    for file in tmp_path.glob("*.py"):
        file.write_text(file.read_text().replace("their_pack.used", "used"))
    names = {group: place.replace(":", ".py:") for group, place in CLASSES.items()}
    quoted = {group: f"'{name}'" for group, name in names.items()}
    written(tmp_path, {**quoted, "stone": "./robots/stone.urdf", "yard": "./yard.yaml"})
    with (tmp_path / "theirs.yaml").open("a") as scenario:
        scenario.write(f"sensors: [{quoted['sensors']}]\n")
    plugins, executed = ran(tmp_path)
    assert set(plugins) == {*names.values(), "used.py"}
    assert all(version.startswith("sha256:") for version in plugins.values())
    assert set(executed) == {*(name.partition(":")[0] for name in names.values()), "used.py"}
