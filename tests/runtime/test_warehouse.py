"""The capstone through the command line: verdicts, files, exit codes and what the recording holds."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.savings import OFF
from twin import runtime
from twin.geometry import Pose3, wxyz_from_xyzw
from twin.recording import read_back
from twin.scenario.schema import load

SCENARIOS = Path(__file__).parents[2] / "scenarios"
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("warehouse")]


class Outcome:
    """A run that `twin run` made."""

    def __init__(self, scenario: str, out: Path, *words: str) -> None:
        command = [
            sys.executable,
            "-m",
            "twin.cli",
            "run",
            str(SCENARIOS / scenario),
            "--out",
            str(out),
            *words,
        ]
        self.done = subprocess.run(command, capture_output=True, text=True, timeout=250, check=False)
        self.out = out
        assert "Traceback" not in self.done.stderr, self.done.stderr

    @property
    def verdict(self) -> dict[str, Any]:
        verdict: dict[str, Any] = json.loads((self.out / "verdict.json").read_text(encoding="utf-8"))
        return verdict

    def check(self, name: str) -> dict[str, Any]:
        return next(check for check in self.verdict["checks"] if check["name"].startswith(name))

    def why(self) -> str:
        return self.done.stdout + self.done.stderr


@pytest.fixture(scope="module")
def warehouse(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    return Outcome("warehouse.yaml", tmp_path_factory.mktemp("warehouse"))


@cache
def recording_of(path: Path) -> read_back.Recording:
    return read_back.read(path)


@pytest.fixture
def recording(warehouse: Outcome) -> read_back.Recording:
    return recording_of(warehouse.out / "warehouse.rrd")


def test_it_delivers_and_says_so(warehouse: Outcome) -> None:
    assert warehouse.done.returncode == 0, warehouse.why()
    assert "PASS" in warehouse.done.stdout
    verdict = warehouse.verdict
    assert verdict["verdict"] == "pass"
    assert verdict["deterministic"] is True
    assert len(verdict["digest"]) >= 32
    names = {check["name"].partition("(")[0] for check in verdict["checks"]}
    assert {"delivered", "no_collision", "tote_slip", "localisation_error", "time_limit"} <= names
    assert all(check["passed"] for check in verdict["checks"])
    assert verdict["metrics"]["recoveries"] == 0, "nothing was in its way"


def test_its_numbers_are_those_of_a_real_drive(warehouse: Outcome) -> None:
    """A grasp by friction creeps a little, a particle filter is off a little; zero would be a cheat."""
    assert 1e-5 < warehouse.check("tote_slip")["value"] < 2e-3
    assert 1e-3 < warehouse.check("localisation_error")["value"] < 0.05
    assert 18.0 < warehouse.check("driven_distance")["value"] < 30.0
    assert 100.0 < warehouse.check("energy")["value"] < 1000.0


def test_junit_lists_every_check(warehouse: Outcome) -> None:
    cases = list(ElementTree.parse(warehouse.out / "junit.xml").iter("testcase"))
    assert [case.get("name") for case in cases] == ["run", *(c["name"] for c in warehouse.verdict["checks"])]
    assert {child.tag for case in cases for child in case} == {"system-out"}


@pytest.mark.parametrize(
    ("entity", "component", "rows"),
    [
        ("/tf", "Transform3D:translation", 5000),
        ("/ros/scan", "Points3D:positions", 500),
        ("/ros/palm_scan", "Points3D:positions", 500),
        ("/ros/map", "GridMap:data", 1),
        ("/ros/global_costmap/costmap", "GridMap:data", 30),
        ("/ros/plan", "LineStrips3D:strips", 2),
        ("/ros/particle_cloud", "Arrows3D:origins", 30),
        ("/mission/state", "StateChange:state", 10),
        ("/log", "TextLog:text", 10),
        ("/velocity/warehouse_bot/linear/commanded", "Scalars:scalars", 500),
        ("/velocity/warehouse_bot/linear/measured", "Scalars:scalars", 1000),
        ("/localisation/warehouse_bot/position_error", "Scalars:scalars", 500),
    ],
)
def test_the_recording_holds_over_time(
    recording: read_back.Recording, entity: str, component: str, rows: int
) -> None:
    assert len(recording.column(entity, component).times_ns) >= rows
    assert "sim_time" in recording.timelines


def test_the_recording_tells_the_missions_story(recording: read_back.Recording) -> None:
    states = [row[0] for row in recording.column("/mission/state", "StateChange:state").values]
    story = ["drive to", "dock at", "look", "reach", "grasp", "retract", "carry to", "set down", "release"]
    position = -1
    for step in story:
        later = [i for i, state in enumerate(states) if i > position and step in state]
        assert later, f"{step} does not follow in {states}"
        position = later[0]
    assert states[-1] == "done"


def test_the_recorded_scans_lie_within_the_walls(recording: read_back.Recording) -> None:
    """Drawn from where the lidar was at their stamp they do, however fast the robot turns."""
    names = ("translation", "quaternion")
    xyz, quat = (recording.column("/tf_topics/scan", f"Transform3D:{name}").numpy()[:, 0] for name in names)
    scans = recording.column("/ros/scan", "Points3D:positions").values
    farthest = [
        np.abs(Pose3(p, wxyz_from_xyzw(q)).apply(np.array(scan))).max(axis=0)
        for p, q, scan in zip(xyz, quat, scans, strict=True)
    ]
    assert (np.max(farthest, axis=0)[:2] < np.array((10.0, 7.0)) + 0.1).all()


def test_the_recording_shows_robot_and_tote_where_they_went(recording: read_back.Recording) -> None:
    column = recording.column("/tf", "Transform3D:translation")
    children = [row[0] for row in recording.column("/tf", "Transform3D:child_frame").values]
    xyz = column.numpy()[:, 0]
    tracks = {
        name: xyz[[i for i, child in enumerate(children) if child.endswith(name)]]
        for name in ("tote_a", "base_footprint")
    }
    assert np.ptp(tracks["tote_a"][:, 0]) > 5.0, "the tote was carried through the hall"
    assert tracks["tote_a"][-1, 2] == pytest.approx(0.49, abs=0.02), "and stands on the table of 0.4 m"
    steps = np.linalg.norm(np.diff(tracks["tote_a"], axis=0), axis=1)
    assert steps.max() < 0.1, "it never jumped"
    assert np.linalg.norm(tracks["base_footprint"][0, :2] - (-8.5, -5.4)) < 0.05


def test_the_recording_ends_with_the_verdict(warehouse: Outcome, recording: read_back.Recording) -> None:
    (text,) = recording.column("/verdict", "TextDocument:text").values[-1]
    assert "delivered" in text
    told = recording.column("/__properties/verdict", "json").values[-1][0]
    assert json.loads(told)["digest"] == warehouse.verdict["digest"]


def test_a_scenario_that_is_meant_to_fail_exits_1_and_names_the_check(tmp_path: Path) -> None:
    dropped = Outcome("failing/warehouse_dropped_tote.yaml", tmp_path, "--no-record")
    assert dropped.done.returncode == 1, dropped.why()
    assert dropped.verdict["verdict"] == "fail"
    failed = [check["name"] for check in dropped.verdict["checks"] if not check["passed"]]
    assert "delivered(tote_a)" in failed
    assert "tote_a" in dropped.check("delivered")["reason"]
    assert not list(tmp_path.glob("*.rrd"))
    assert "FAIL" in dropped.done.stdout
    assert "delivered(tote_a): tote_a" in " ".join(dropped.done.stdout.split())
    failures = list(ElementTree.parse(tmp_path / "junit.xml").iter("failure"))
    assert len(failures) == len(failed)


def test_repeated_runs_have_one_hash(tmp_path: Path) -> None:
    words = ("--set", "duration=4 s", "--repeat", "5", "--expect-one-hash")
    runs = Outcome("warehouse.yaml", tmp_path, *words)
    assert runs.done.returncode == 1, "four seconds are too short to deliver anything"
    assert "one digest" in runs.done.stdout
    digests = {json.loads(p.read_text(encoding="utf-8"))["digest"] for p in tmp_path.glob("*/verdict.json")}
    assert len(list(tmp_path.glob("*/verdict.json"))) == 5
    scenario = load(SCENARIOS / "warehouse.yaml", {"duration": "4 s"})
    assert digests == {runtime.run(scenario, record=False, savings=OFF).digest}, "whatever is saved"
