"""What somebody has who installs the wheel: all that ships, and a project that passes, without a checkout."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import venv
from importlib import metadata
from pathlib import Path
from zipfile import ZipFile

import pytest
import typer

from twin.models.catalogue import catalogue as robots

ROOT = Path(__file__).parents[1]

pytestmark = [pytest.mark.long, pytest.mark.timeout(900), pytest.mark.xdist_group("wheel")]


def build(source: Path, place: Path) -> Path:
    """Make a wheel without a network."""
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(place)]
    command = [sys.executable, "-m", "pip", "wheel", *options, str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=source)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = place.iterdir()
    return wheel


def install(wheel: Path, home: Path) -> None:
    # Whatever else is in the path of the tests, such as this checkout, is no reason to install nothing.
    options = ["--quiet", "--no-deps", "--no-index", "--ignore-installed", str(wheel)]
    pip = [sys.executable, "-m", "pip", "--python", str(home / "bin" / "python"), "install", *options]
    subprocess.run(pip, check=True, cwd=home)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build it from what is tracked, and from nothing that lies about."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    source = tmp_path_factory.mktemp("source")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in filter(None, listed.stdout.split("\0")):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    return build(source, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install it into an environment of its own, and return the folder of its programs.

    What it depends on comes from the environment of the tests. Neither this checkout nor what says that it is
    installed there is in the path of the new one.
    """
    home = tmp_path_factory.mktemp("environment")
    venv.create(home)
    install(wheel, home)
    (site,) = home.glob("lib/python*/site-packages")
    (site / "dependencies.pth").write_text(f"{Path(typer.__file__).parents[1]}\n", encoding="utf-8")
    return home / "bin"


def outside(installed: Path, folder: Path, *command: str) -> str:
    """Run a command as somebody does who has only the wheel; return what it prints."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    words = [str(installed / command[0]), *command[1:]]
    done = subprocess.run(
        words, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def test_everything_that_ships_is_in_it_and_nothing_else(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    tracked = listed.stdout.splitlines()
    ship = {name for name in tracked if name.startswith("twin/")}
    ship |= {f"twin/{name}" for name in tracked if name.startswith(("scenarios/", "examples/"))}
    assert held == ship
    tests = {name for name in held if re.search(r"(^|/)(tests|docs|benchmarks)/", name)}
    assert all(name.startswith("twin/project/template/tests/") for name in tests)


def test_it_runs_in_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    where = outside(installed, tmp_path, "python", "-c", "import twin; print(twin.__file__)").strip()
    assert Path(where).is_relative_to(installed.parent)
    version = metadata.version("twin")
    assert outside(installed, tmp_path, "twin", "--version") == f"twin {version}\n"
    assert "warehouse_slam" in outside(installed, tmp_path, "twin", "scenarios")
    assert "charger" in outside(installed, tmp_path, "twin", "arenas")
    assert set(robots()) <= set(outside(installed, tmp_path, "twin", "robots").split())
    assert "PASS" in outside(installed, tmp_path, "twin", "run", "diff_bot_figure8", "--no-record")
    assert "1 of 1 passed" in outside(installed, tmp_path, "twin", "test", "r2d2_circle")
    program = outside(installed, tmp_path, "twin", "examples", "gps_publisher").strip()
    assert "--connect" in outside(installed, tmp_path, "python", program, "--help")


def test_a_new_project_passes_as_it_is(installed: Path, tmp_path: Path) -> None:
    outside(installed, tmp_path, "twin", "new", "rover")
    project = tmp_path / "rover"
    checked = outside(installed, project, "twin", "check", "--strict", "rover/rover.urdf.xacro")
    assert "no faults found" in checked
    assert "rover drives around the wall" in outside(installed, project, "twin", "scenarios")
    assert "PASS" in outside(installed, project, "twin", "run", "rover")
    (recording,) = project.glob("runs/rover/*/rover.rrd")
    assert recording.stat().st_size > 10_000
    assert "1 of 1 passed" in outside(installed, project, "twin", "test", "--junit", "results.xml")
    assert "1 passed" in outside(installed, project, "python", "-m", "pytest", "-q")


OTHER = """\
name: other
duration: 1 s
world: {arena: rover_hall}
robots: [{model: rover, start: start}]
checks: [{rover_visits: {points: [[-3, -2]]}}]
"""


def test_an_installed_project_has_names_everywhere(installed: Path, tmp_path: Path) -> None:
    outside(installed, tmp_path, "twin", "new", "rover")
    install(build(tmp_path / "rover", tmp_path / "wheels"), installed.parent)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    assert "rover" in outside(installed, elsewhere, "twin", "robots").split()
    assert "rover_hall" in outside(installed, elsewhere, "twin", "arenas").split()
    (elsewhere / "other.yaml").write_text(OTHER, encoding="utf-8")
    assert "PASS" in outside(installed, elsewhere, "twin", "run", "other.yaml", "--no-record")
