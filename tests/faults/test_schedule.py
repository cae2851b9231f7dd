"""What faults have in common: begin, end, reports, errors with their lines, and that all runs are alike."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.faults.conftest import ROUND, Drive
from twin.errors import PluginError, ScenarioError
from twin.recording.read_back import read
from twin.runtime import run
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.schema import load

FAULTS = """
faults:
  - noise: {sensor: scan, stddev: 0.05, at: 0.2 s, duration: 0.4 s}
  - freeze: {sensor: imu, when: {driven: 9 m}}
  - loss:
      share: 1
      topic: /scan
      at: 1 s
  - loss: 10 %
"""


def test_each_run_reports_what_became_of_each_fault(tmp_path: Path) -> None:
    (tmp_path / "faulty.yaml").write_text(ROUND + FAULTS, encoding="utf-8")
    verdict = run(load(tmp_path / "faulty.yaml"), out=tmp_path / "out", record=True)
    verdict.write(tmp_path / "out")
    told = json.loads((tmp_path / "out" / "verdict.json").read_text("utf-8"))["faults"]
    keys = ("name", "kind", "outcome", "at_s", "end_s")
    assert [tuple(fault[key] for key in keys) for fault in told] == [
        ("noise", "noise", "landed", 0.2, 0.6),
        ("freeze", "freeze", "not_reached", None, None),
        ("loss", "loss", "no_effect", 1.0, None),
        ("loss_2", "loss", "landed", 0.0, None),
    ]
    suite = ElementTree.parse(tmp_path / "out" / "junit.xml").getroot()[0]
    properties = {item.get("name"): item.get("value") for item in suite.iter("property")}
    assert properties["fault.noise"] == "landed: 4 of 4 readings of scan altered"
    assert properties["fault.freeze"] == "not_reached"
    recording = read(tmp_path / "out" / "round.rrd")
    log = recording.column("/log", "TextLog:text")
    marks = {text[0]: time / 1e9 for time, text in zip(log.times_ns, log.values, strict=True)}
    assert marks["[faults] noise of diff_bot's scan"] == 0.2
    assert marks["[faults] noise of diff_bot's scan is over"] == 0.6
    assert "| loss_2 | landed | 0.00 s |" in recording.column("/verdict", "TextDocument:text").values[0][0]


def test_another_fault_or_none_changes_no_run(drive: Drive) -> None:
    def digest(faults: str) -> bytes:
        return drive(faults).run.world.state_digest()

    assert digest("") == digest("[loss: {share: 1, topic: /imu, when: {driven: 9 m}}]")
    assert digest("[friction: 0.1]") == digest("[friction: 0.1]") != digest("")


def test_a_run_without_faults_imports_and_does_nothing_for_them(drive: Drive) -> None:
    ended = drive()
    assert ended.run.faults is None
    assert ended.run.bus.link is None
    assert "alterations" not in vars(ended.run.world)
    script = "import sys; from twin import Simulation; Simulation('diff_bot_figure8', out=None).start()"
    script += "; print([name for name in sys.modules if name.startswith('twin.faults')])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_errors_have_their_lines_all_at_once(tmp_path: Path) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text(
        f"{ROUND}faults:\n"
        "  - noise:\n      stddev: 1\n      sensor: skan\n"
        "  - wheel_slip: {joint: wheel_lefft_joint}\n"
        "  - loss:\n      share: 1\n      topic: /imo\n",
        encoding="utf-8",
    )
    first = ROUND.count("\n") + 1
    with pytest.raises(ScenarioError) as refused:
        run(load(file), record=False)
    lines = str(refused.value).splitlines()
    assert [line.partition(": ")[0] for line in lines] == [f"{file}:{first + n}" for n in (3, 4, 7)]
    assert "'skan'" in lines[0]
    assert "'wheel_lefft_joint'" in lines[1]
    assert "'/imo'" in lines[2]


def test_several_robots_have_faults_of_their_own(tmp_path: Path) -> None:
    file = tmp_path / "two.yaml"
    text = ROUND.replace(
        "[{model: diff_bot}]", "[{model: diff_bot, name: a}, {model: diff_bot, name: b, pose: {y: 1}}]"
    )
    text = text.replace("robot: diff_bot", "robot: a")
    file.write_text(f"{text}faults: [flat_battery: {{robot: a}}, loss: 10 %]\n", encoding="utf-8")
    scenario = load(file)
    two = Run(scenario, build(scenario))
    try:
        while not two.over:
            two.tick()
        assert two.faults is not None
        assert two.faults.robots == {"a", "b"}
        assert abs(two.world.pose("a/base_link").xyz[0]) < 1e-3
    finally:
        two.bus.close()
    file.write_text(f"{text}faults: [flat_battery: ]\n", encoding="utf-8")
    with pytest.raises(
        ScenarioError, match="flat_battery must name its robot, there are several; valid: a, b"
    ):
        load(file)


OWN = """
from dataclasses import dataclass
from twin.faults import Effect, Fault, FaultConfig, LastingFault

class Push(Fault):
    @dataclass(frozen=True, kw_only=True)
    class Config(LastingFault):
        speed: float

    def begin(self):
        self.context.world.data.qvel[0] = self.config.speed

    @property
    def effect(self):
        return Effect(True, "pushed")

class Crashes(Push):
    def update(self):
        raise KeyError("gain")

class Silent(Push):
    effect = None

class Lacks(Fault):
    Config = FaultConfig

    def begin(self):
        pass

class NoConfig(Fault):
    def begin(self):
        pass
    effect = None
"""


def test_a_users_fault(drive: Drive, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN, encoding="utf-8")
    text = ROUND.replace("linear: 0.3, angular: 0.5", "linear: 0")
    ended = drive(f"[{tmp_path}/own.py:Push: {{speed: 1.5, at: 0.5 s, label: shove}}]", text)
    assert ended.pose.x > 0.01
    report = ended.reports["shove"]
    assert (report.kind, report.outcome, report.effect, report.at_s) == (
        "own.py:Push",
        "landed",
        "pushed",
        0.5,
    )
    for name, message in (
        ("Crashes: {speed: 1}", r"own\.py:19: fault 'own\.py:Crashes' fails: KeyError: 'gain'"),
        ("Silent: {speed: 1}", "tells NoneType as its effect; it must be an Effect"),
        ("Lacks: ", r"lacks effect"),
        ("NoConfig: ", "has no Config that derives from twin.faults.FaultConfig"),
        ("Push: {sped: 1}", "unknown key 'sped'.*did you mean 'speed'"),
        ("Bush: ", "there is no 'Bush' in it; did you mean 'Push'"),
    ):
        with pytest.raises((PluginError, ScenarioError), match=message):
            drive(f"[{tmp_path}/own.py:{name}]", text).reports  # noqa: B018
