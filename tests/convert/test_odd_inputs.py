"""Odd, bad and hostile inputs, each with its outcome; the tables are in `tests/oracles/odd`."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import pytest

from tests.oracles.odd.case import Case, accepted, link, robot
from tests.oracles.odd.extensions import EXTENSIONS
from tests.oracles.odd.meshes import MESHES
from tests.oracles.odd.names import NAMES
from tests.oracles.odd.run import snapshot, twin, write
from tests.oracles.odd.trees import TREES
from tests.oracles.odd.values import VALUES
from tests.oracles.odd.xml import XML
from twin.models.checks.codes import ERRORS, WARNINGS

CASES = XML | NAMES | VALUES | TREES | MESHES | EXTENSIONS
SLOWEST_S = 15.0
"""Of this process; what others do on the machine does not count."""
CHECK_URDF = shutil.which("check_urdf", path="/usr/bin:/usr/local/bin")
_NO_MOTOR = "a limit without effort or velocity is a warning, as a simulation needs neither"
ONLY_CHECK_URDF_REFUSES = {
    "lower is upper": _NO_MOTOR,
    "limits for none": _NO_MOTOR,
    "hardly a range": _NO_MOTOR,
    "hardly an effort": _NO_MOTOR,
    "huge effort": _NO_MOTOR,
}
"""Cases that twin accepts and check_urdf does not, and why that is right."""
GOOD = accepted(robot(link()), lambda m: m.nbody == 2)


def test_the_tables_are_large_and_share_no_name() -> None:
    assert len(CASES) == sum(map(len, (XML, NAMES, VALUES, TREES, MESHES, EXTENSIONS))) >= 70


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", CASES)
def test_outcome(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    file = write(case, folder)
    before = snapshot(tmp_path)
    start = time.process_time()
    convert = twin("convert", file, "-o", out, *case.options)
    assert time.process_time() - start < SLOWEST_S
    everything = {path: seen for path, seen in snapshot(tmp_path).items() if path.partition("/")[0] != "out"}
    assert everything == before
    if case.model is None:
        assert (convert.code, out.exists()) == (2, False), convert
        assert convert.err.startswith("error: ")
        for fragment in case.says:
            assert fragment in convert.err
        assert twin("tree", file, *_reading(case)).code in (0, 255)
        return
    assert (convert.code, convert.err) == (0, "")
    assert case.model(mujoco.MjModel.from_xml_path(str(out / "robot.xml")))
    report = json.loads((out / "report.json").read_text("utf-8"))
    assert report["self_check"]["passed"]
    assert set(case.says) <= {diagnostic["code"] for diagnostic in report["diagnostics"]}


@pytest.mark.parametrize("name", [name for name in CASES if CASES[name].model is None])
def test_check_says_the_same(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    check = twin("check", write(case, tmp_path), "--json", *_reading(case))
    document = json.loads(check.out)
    by_mass_alone = {diagnostic["code"] for diagnostic in document["diagnostics"]} >= {"massless-base"}
    assert check.code == (0 if by_mass_alone else 2)  # a base without mass can still be fixed
    assert all(diagnostic["code"] in {*ERRORS, *WARNINGS} for diagnostic in document["diagnostics"])


def _reading(case: Case) -> tuple[str, ...]:
    return () if "--base" in case.options else case.options


@pytest.mark.skipif(
    CHECK_URDF is None, reason="check_urdf is not installed (apt-get install liburdfdom-tools)"
)
@pytest.mark.parametrize("name", [name for name in CASES if CASES[name].model is not None])
def test_check_urdf_refuses_no_more(name: str, tmp_path: Path) -> None:
    file = write(CASES[name], tmp_path)
    done = subprocess.run([str(CHECK_URDF), str(file)], capture_output=True, check=False, timeout=120)
    assert (done.returncode != 0) == (name in ONLY_CHECK_URDF_REFUSES)


def test_folders_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(GOOD, tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("mine")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    (tmp_path / "sub").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    before = snapshot(tmp_path)
    for folder in (
        "file",
        "file/below",
        "full",
        ".",
        "sub/..",
        "/",
        "/proc/x",
        "/dev/null",
        "loop",
        "x" * 300,
    ):
        outcome = twin("convert", "r.urdf", "-o", folder)
        assert outcome.code == 2, folder
        assert outcome.err.startswith("error: "), folder
        assert snapshot(tmp_path) == before, folder


def test_folders_that_can(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(GOOD, tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    (tmp_path / "inner").mkdir()
    (tmp_path / "way").symlink_to("inner")
    (tmp_path / "empty").mkdir()
    for folder in ("new/deep/er", "way/out", "empty", "empty", "link", "../odd out", "[bold]x"):
        outcome = twin("convert", "r.urdf", "-o", folder)
        assert (outcome.code, outcome.err) == (0, ""), folder
        assert (Path(folder) / "robot.xml").is_file()
        assert str(Path(folder) / "robot.xml") in outcome.out
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real" / "robot.xml").is_file()


def test_the_name_of_a_robot_is_no_path(tmp_path: Path) -> None:
    file = write(accepted(robot(link(), head="name='../../evil'"), lambda m: True), tmp_path)
    assert twin("convert", file, "-o", tmp_path / "out").code == 0
    assert sorted(item.name for item in tmp_path.iterdir()) == ["out", "r.urdf"]


def test_an_interrupted_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = write(GOOD, tmp_path)
    assert twin("convert", file, "-o", tmp_path / "out").code == 0
    before = snapshot(tmp_path)

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("twin.convert.export.self_check", interrupt)
    assert twin("convert", file, "-o", tmp_path / "out").code == 130
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize(
    "name", ["an endless device", "a root named world and a world_link", "1000 links in a row"]
)
def test_as_a_process_of_its_own(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    command = [
        sys.executable,
        "-m",
        "twin.cli",
        "convert",
        str(write(case, tmp_path)),
        "-o",
        str(tmp_path / "out"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=4 * SLOWEST_S)
    assert done.returncode == (2 if case.model is None else 0)
    assert "Traceback" not in done.stderr
