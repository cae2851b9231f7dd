"""What a user can get wrong, and a robot cannot do: a clear sentence, an exit code, nothing half-written."""

from __future__ import annotations

import json
import math
import re
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from twin import runtime
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.cli.run.once import run_once
from twin.cli.run.options import RunOptions
from twin.errors import BridgeError, MapError, ModelError, SimulationError, TwinError
from twin.geometry import Pose2
from twin.models import load as load_robot
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.recording import read_back
from twin.runtime.run import Run
from twin.scenario.schema import Scenario
from twin.warehouse import arena as arenas
from twin.warehouse.map_files import map_of_arena

MakeScenario = Callable[[str], Scenario]
MakeRun = Callable[..., Run]

NAVIGATE = """
name: navigate
seed: 1
duration: 120 s
world: {arena: warehouse}
robots:
  - model: warehouse_bot
    start: start
    localisation: {type: amcl}
    navigation: {}
mission: {type: behaviors, robot: warehouse_bot, steps: [{navigate_to_pose: GOAL}]}
checks: [{mission_succeeded: }]
"""
IDLE = """
name: idle
duration: 2 s
robots: [{model: MODEL}]
checks: [{odometry_drift: {max: 1 m}}]
"""


# What the robot cannot do


@pytest.mark.parametrize(
    ("goal", "reason"),
    [
        ("{x: -10.0 m, y: 0 m}", r"nothing is free within 0.1 m of the goal \(-10.00, 0.00\)"),
        ("{x: 40 m, y: 0 m}", r"\(40.00, 0.00\) is outside the costmap"),
        ("{x: 6.0 m, y: 1.2 m}", r"nothing is free within 0.1 m of the goal \(6.00, 1.20\)"),
    ],
    ids=["in a wall", "outside the map", "in a pillar"],
)
def test_an_unreachable_goal_fails_the_mission_with_its_reason(
    goal: str, reason: str, scenario: MakeScenario
) -> None:
    verdict = runtime.run(scenario(NAVIGATE.replace("GOAL", goal)), record=False)
    (check,) = verdict.checks
    assert not check.passed
    assert re.search(reason, check.reason)
    assert "navigate" in check.reason
    assert verdict.exit_code == 1
    assert verdict.metrics["sim_time_s"] < 119.0, "it gives up by itself"


def test_nan_on_cmd_vel_while_navigating_changes_nothing(scenario: MakeScenario, make_run: MakeRun) -> None:
    run = make_run(scenario(NAVIGATE.replace("GOAL", "{x: -4.0 m, y: -5.4 m}")))
    said: list[str] = []
    run.bus.tap(lambda sample: said.append(sample.message.msg) if sample.topic == "/rosout" else None)
    publisher = run.bus.create_node("broken_script").create_publisher(Twist, "/cmd_vel", 1)
    while not run.over:
        publisher.publish(twist_from_planar(math.nan, math.inf))
        run.tick()
    assert run.parts.mission.succeeded, run.parts.mission.reason
    assert np.isfinite(run.world.data.qvel).all()
    assert any(re.search(r"cmd_vel refused: linear.x nan, angular.z inf must be finite", s) for s in said)


# Files


def twin(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "twin.cli", *words]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=120, check=False)


def test_a_malformed_scenario_is_answered_with_every_fault_and_its_line(tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text(
        "name: bad\n"
        "duration: soon\n"
        "robots:\n"
        "  - modle: diff_bot\n"
        "mission: {type: velocity_profile, robot: diff_bot, steps: []}\n"
        "checks:\n"
        "  - odometry_drift: {max: 1 parsec}\n",
        encoding="utf-8",
    )
    done = twin("run", "bad.yaml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    text = " ".join(done.stderr.split())
    for line, words in ((2, "duration"), (4, "modle"), (5, "steps"), (7, "max")):
        assert re.search(rf"bad\.yaml:{line}: [^:]*{words}", text), (line, done.stderr)
    assert "model" in text, "the nearest valid key"
    assert [path.name for path in tmp_path.iterdir()] == ["bad.yaml"], "no folder for a run that was none"


@pytest.mark.parametrize("content", [None, "\x00\xff"], ids=["missing", "binary"])
def test_a_file_that_is_no_scenario_at_all(content: str | None, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "bad.yaml").write_bytes(content.encode("latin-1"))
    done = twin("run", "bad.yaml", cwd=tmp_path)
    assert done.returncode == 2
    assert "bad.yaml" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "runs").exists()


def test_an_unknown_robot_through_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(IDLE.replace("MODEL", "difbot"), encoding="utf-8")
    done = twin("run", "s.yaml", "--out", "out", "--json", cwd=tmp_path)
    assert done.returncode == 2
    assert "diff_bot" in done.stderr
    assert "Traceback" not in done.stderr
    verdict = json.loads(done.stdout)
    assert verdict["verdict"] == "error"
    assert "difbot" in verdict["error"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["junit.xml", "verdict.json"]


def test_a_missing_mesh_is_named(scenario: MakeScenario, tmp_path: Path) -> None:
    urdf = load_robot("diff_bot").urdf
    box = re.search(r'<link name="base_link">.*?(<geometry>.*?</geometry>)', urdf, flags=re.DOTALL)
    assert box is not None
    path = tmp_path / "meshless.urdf"
    mesh = '<geometry><mesh filename="meshes/body.stl"/></geometry>'
    path.write_text(urdf.replace(box.group(1), mesh, 1), encoding="utf-8")
    with pytest.raises(ModelError, match=r"meshless\.urdf.*body\.stl"):
        runtime.run(scenario(IDLE.replace("MODEL", str(path))), record=False)


def test_a_map_of_the_wrong_size_is_refused_with_both_extents(scenario: MakeScenario, tmp_path: Path) -> None:
    small = OccupancyMap(data=np.zeros((100, 200), np.int8), resolution=0.05, origin=Pose2(-5.0, -2.5, 0.0))
    small.save(tmp_path / "small.yaml")
    text = NAVIGATE.replace("{type: amcl}", f"{{type: amcl, map: {tmp_path / 'small.yaml'}}}")
    with pytest.raises(MapError) as caught:
        runtime.run(scenario(text.replace("GOAL", "{x: 0 m, y: 0 m}")), record=False)
    message = str(caught.value)
    assert "small.yaml" in message
    assert "x -5.00 … 5.00, y -2.50 … 2.50 m" in message
    assert "x -10 … 10, y -7 … 7 m" in message


@pytest.mark.parametrize("side", ["west", "east", "south", "north"])
def test_a_map_that_lacks_one_side_is_refused(side: str, scenario: MakeScenario, tmp_path: Path) -> None:
    whole = map_of_arena(arenas.load("warehouse"))
    cut = round(3.0 / whole.resolution)
    x, y = whole.origin[:2]
    data, origin = {
        "west": (whole.data[:, cut:], Pose2(x + 3.0, y, 0.0)),
        "east": (whole.data[:, :-cut], whole.origin),
        "south": (whole.data[cut:], Pose2(x, y + 3.0, 0.0)),
        "north": (whole.data[:-cut], whole.origin),
    }[side]
    path = tmp_path / "cut.yaml"
    OccupancyMap(data=data, resolution=whole.resolution, origin=origin).save(path)
    text = NAVIGATE.replace("{type: amcl}", f"{{type: amcl, map: {path}}}")
    with pytest.raises(MapError, match="covers"):
        runtime.run(scenario(text.replace("GOAL", "{x: 0 m, y: 0 m}")), record=False)


def test_a_map_of_the_arenas_size_is_taken(scenario: MakeScenario, make_run: MakeRun, tmp_path: Path) -> None:
    grid = map_of_arena(arenas.load("warehouse"))
    grid.save(tmp_path / "copy.yaml")
    text = NAVIGATE.replace("{type: amcl}", f"{{type: amcl, map: {tmp_path / 'copy.yaml'}}}")
    make_run(scenario(text.replace("GOAL", "{x: 0 m, y: 0 m}"))).tick()


# The port


def test_a_port_in_use_is_named(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(IDLE.replace("MODEL", "diff_bot"), encoding="utf-8")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        endpoint = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        done = twin("run", "s.yaml", "--out", "out", "--listen", endpoint, cwd=tmp_path)
    assert done.returncode == 2
    assert endpoint in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert not list((tmp_path / "out").glob("*.rrd*")), "no recording of a run that never was"


def test_a_port_in_use_is_a_bridge_error(scenario: MakeScenario) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        endpoint = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        with pytest.raises(BridgeError, match=endpoint):
            runtime.run(scenario(IDLE.replace("MODEL", "diff_bot")), record=False, listen=[endpoint])


# Physics that diverges


@pytest.mark.parametrize("kick", [1e12, math.nan])
def test_diverging_physics_stops_the_run_and_keeps_the_last_states(
    kick: float, scenario: MakeScenario, make_run: MakeRun, tmp_path: Path
) -> None:
    run = make_run(scenario(IDLE.replace("MODEL", "diff_bot")), crash_folder=tmp_path / "crash")
    for _ in range(10):
        run.tick()
    run.world.data.qvel[run.world.model.joint("diff_bot/wheel_left_joint").dofadr[0]] = kick
    with pytest.raises(SimulationError, match=r"diverged at t = 0\.2\d\d s: .*diff_bot/") as caught:
        run.tick()
    message = str(caught.value)
    file = tmp_path / "crash" / "diverged.npz"
    assert str(file) in message
    assert "smaller physics step" in message, "what to do about it"
    with np.load(file) as saved:
        assert len(saved["states"]) == len(saved["times"]) >= 10
        assert np.isfinite(saved["states"][0]).all()


def test_a_diverging_run_is_exit_2_and_leaves_a_readable_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    actuate = Run.actuate

    def kick(self: Run) -> None:
        actuate(self)
        if self.world.time_ns == 1_000_000_000:
            self.world.data.qfrc_applied[self.world.model.joint("diff_bot/wheel_left_joint").dofadr[0]] = 1e12

    monkeypatch.setattr(Run, "actuate", kick)
    (tmp_path / "s.yaml").write_text(IDLE.replace("MODEL", "diff_bot"), encoding="utf-8")
    out = tmp_path / "out"
    assert run_once(RunOptions(scenario=tmp_path / "s.yaml", out=out)) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "diverged at t = 1.00" in said
    assert json.loads((out / "verdict.json").read_text(encoding="utf-8"))["verdict"] == "error"
    with np.load(out / "diverged.npz") as saved:
        assert len(saved["states"]) >= 50
    recording = read_back.read(out / "idle.rrd")
    times, _ = max((recording.scalars(e) for e in recording.entities if _is_scalar(recording, e)), key=_last)
    assert times[-1] == pytest.approx(1_000_000_000, abs=40_000_000), "up to the last good moment"


def _is_scalar(recording: read_back.Recording, entity: str) -> bool:
    return "Scalars:scalars" in recording.columns[entity] and not entity.startswith("/__")


def _last(series: tuple[np.ndarray, np.ndarray]) -> int:
    return int(series[0][-1]) if len(series[0]) else 0


def test_every_one_of_these_is_a_twin_error() -> None:
    """So the command line prints it as one sentence and exits with 2."""
    assert all(issubclass(kind, TwinError) for kind in (BridgeError, MapError, ModelError, SimulationError))
