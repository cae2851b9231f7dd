"""Plugins in a scenario: run by `twin run` alone; whatever they do wrong ends the run in one sentence."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from twin import runtime
from twin.errors import PluginError, ScenarioError
from twin.plugins import execution
from twin.scenario import schema
from twin.scenario.verdict import Verdict

CHECK = """
from dataclasses import dataclass
from typing import Annotated
from twin.parameters import Metres, Positive
from twin.scenario.checks import Check, CheckResult

class Mine(Check):
    @dataclass(frozen=True, kw_only=True)
    class Config:
        size: Annotated[Metres, Positive]
        count: int = 2

    def observe(self, observation):
        pass

    def result(self):
        return CheckResult(name=self.name, passed=self.config.size == 0.03, value=self.config.size)
"""
MISSION = """
from twin.nodes.missions.mission_node import MissionNode

class Mine(MissionNode):
    def __init__(self, context, config):
        super().__init__(context.bus, namespace=context.namespace)
        self.node.create_timer(100_000_000, self.tick)

    def tick(self):
        self.finish(succeeded=True)
"""
SENSOR = """
from twin.bridge.msgs import Bool
from twin.sensors import Sensor, SensorSpec

class Mine(Sensor):
    types = ("warmth",)
    topic, rate_hz, message = "warm", 50.0, Bool

    @classmethod
    def read(cls, element, common, report):
        return SensorSpec(**common)

    def sample(self, time_ns):
        return True

    @classmethod
    def to_message(cls, spec, header, reading):
        return Bool(data=reading)
"""
ROBOT = """<robot name="stone"><link name="base_link"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
<collision><geometry><sphere radius="0.2"/></geometry></collision></link>
<gazebo reference="base_link"><sensor name="skin" type="warmth"/></gazebo></robot>
"""
SCENARIO = """name: tiny
duration: 0.3 s
robots:
  - model: ./stone.urdf
"""
Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a scenario and the plugin that it names: `mine.py`."""

    def write(code: str, named: str, checks: str = "  - final_pose: {x: 0, y: 0}\n") -> Path:
        (tmp_path / "mine.py").write_text(code)
        (tmp_path / "stone.urdf").write_text(ROBOT)
        file = tmp_path / "tiny.yaml"
        file.write_text(f"{SCENARIO}{named}checks:\n{checks}")
        return file

    return write


def run(file: Path) -> Verdict:
    return runtime.run(schema.load(file, execute=True), record=False)


AS_CHECK = "  - mine.py:Mine: {size: 3 cm}\n"
AS_MISSION = "mission: {type: 'mine.py:Mine'}\n"
AS_SENSOR = "sensors: ['mine.py:Mine']\n"
NAMED = {"check": ("", AS_CHECK), "mission": (AS_MISSION,), "sensor": (AS_SENSOR,)}
CODE = {"check": CHECK, "mission": MISSION, "sensor": SENSOR}


@pytest.mark.parametrize("kind", NAMED)
def test_a_file_of_each_kind_is_used_and_its_hash_kept(kind: str, write: Write) -> None:
    verdict = run(write(CODE[kind], *NAMED[kind]))
    assert verdict.verdict == "pass"
    assert list(verdict.plugins) == ["mine.py:Mine"]
    assert verdict.plugins["mine.py:Mine"].startswith("sha256:")


def test_what_a_file_imports_from_its_folder_is_its_own_afresh_and_in_the_verdict(write: Write) -> None:
    file = write(f"from parts.of_it import SPEED\n{CHECK.replace('0.03', 'SPEED')}", *NAMED["check"])
    told, verdicts = list[str](), []
    for speed in ("0.03", "0.025"):
        helper = file.with_name("parts") / "of_it.py"
        helper.parent.mkdir(exist_ok=True)
        helper.write_text(f"SPEED = {speed}\n")
        with execution(lambda file: told.append(Path(file).name)):
            verdicts.append(run(file))
    assert [verdict.verdict for verdict in verdicts] == ["pass", "fail"]
    first, second = (verdict.plugins for verdict in verdicts)
    assert first["mine.py:Mine"] == second["mine.py:Mine"]
    assert first["parts/of_it.py"] != second["parts/of_it.py"]
    assert told == ["mine.py", "of_it.py"] * 2

    # Of another folder, at the same time: it has a helper of the same name, and does not see this one.
    other = file.with_name("other")
    (other / "parts").mkdir(parents=True)
    (other / "yours.py").write_text((file.with_name("mine.py")).read_text())
    (other / "parts" / "of_it.py").write_text("SPEED = 7.0\n")
    file.write_text(file.read_text() + "  - other/yours.py:Mine: {size: 7 m}\n")
    helper.write_text("SPEED = 0.03\n# again\n")
    verdict = run(file)
    assert [check.passed for check in verdict.checks] == [True, True]
    assert len(verdict.plugins) == 4


def test_a_neighbour_is_found_whatever_the_program_has_imported_by_its_name(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = write(f"from gear.of_it import SPEED\n{CHECK.replace('0.03', 'SPEED')}", *NAMED["check"])
    own = ModuleType("gear")
    monkeypatch.setitem(sys.modules, "gear", own)
    helper = file.with_name("gear") / "of_it.py"
    helper.parent.mkdir()
    helper.write_text("SPEED = 0.03\n")
    file.with_name("numpy").mkdir()  # nobody's folder stands in for an installed package
    assert run(file).verdict == "pass"
    assert sys.modules["gear"] is own


def test_what_fails_in_a_neighbour_has_its_line(write: Write) -> None:
    file = write("import helper\n" + CHECK.replace("pass\n", "helper.fail()\n"), *NAMED["check"])
    file.with_name("helper.py").write_text("def fail():\n    {}['gone']\n")
    with pytest.raises(PluginError, match=r"helper\.py:2: check 'mine\.py:Mine' fails: KeyError: 'gone'"):
        run(file)


@pytest.mark.parametrize("kind", NAMED)
def test_reading_a_scenario_runs_nothing_of_it(kind: str, write: Write) -> None:
    file = write(f"raise SystemExit('this was run')\n{CODE[kind]}", *NAMED[kind])
    assert schema.load(file).name == "tiny"


@pytest.mark.parametrize(
    ("kind", "old", "new", "message"),
    [
        (
            "check",
            "pass\n",
            "raise KeyError('x')\n",
            r"mine.py:14: check 'mine.py:Mine' fails: KeyError: 'x'",
        ),
        (
            "check",
            "value=self.config.size",
            "value=float('nan')",
            r"returns a value of nan; it must be a number",
        ),
        ("check", "return CheckResult", "return dict", r"mine.py:7: .* returns dict as its result"),
        (
            "check",
            "passed=self.config.size == 0.03",
            "passed=None",
            r"returns passed=None; it must be True or",
        ),
        (
            "check",
            "    def observe",
            "    def __init__(self, *_):\n        pass\n\n    def observe",
            r"mine.py:7: check 'mine.py:Mine' does not call super\(\).__init__\(name, config, context\)",
        ),
        (
            "check",
            "observe(self, observation)",
            "observe(self)",
            r"mine.py:13: .* has observe\(self\), which must",
        ),
        ("check", "    def result", "    def results", r"mine.py:7: check 'mine.py:Mine' lacks result\(\)"),
        (
            "mission",
            "self.finish(succeeded=True)",
            "1 / 0",
            r"mine.py:10: mission 'mine.py:Mine' fails: ZeroDiv",
        ),
        (
            "mission",
            "super().__init__(context.bus, namespace=context.namespace)\n        self.node",
            "self.node = context.bus.create_node('x')\n        self.node",
            r"mine.py:4: mission 'mine.py:Mine' does not call super\(\).__init__\(context.bus, namespace=",
        ),
        (
            "mission",
            "(MissionNode)",
            "",
            r"mine.py:4: mission 'mine.py:Mine' is no MissionNode; derive it from",
        ),
        ("sensor", "return True", "return [][0]", r"mine.py:14: sensor 'mine.py:Mine' fails: IndexError"),
        ("sensor", "Bool(data=reading)", "3", r"mine.py:5: sensor 'mine.py:Mine' makes a int, not a "),
        ("sensor", "data=reading", "data='yes', x=1", r"mine.py:18: sensor 'mine.py:Mine' fails: TypeError"),
        (
            "sensor",
            "return SensorSpec(**common)",
            "pass",
            r"mine.py:5: .* reads a NoneType from its <sensor>",
        ),
        ("sensor", '    types = ("warmth",)\n', "", r"mine.py:5: .* names no `types`"),
        (
            "sensor",
            "data=reading",
            "data=__import__('numpy').zeros(3)",
            r"mine.py:5: sensor 'mine.py:Mine' fails: BridgeError: .* cannot be encoded: data is a bool",
        ),
        (
            "sensor",
            "    def sample",
            "    def __init__(self, *_):\n        pass\n\n    def sample",
            r"mine.py:5: sensor 'mine.py:Mine' does not call super\(\).__init__\(spec, mount\)",
        ),
        ("sensor", "return True", "raise SystemExit(3)", r"mine.py:14: sensor .* fails: SystemExit: 3"),
        (
            "mission",
            "self.finish(succeeded=True)",
            "self.node.create_publisher(str, 'no name!', 10)",
            r"mine.py:10: mission 'mine.py:Mine' fails: BridgeError: ",
        ),
        ("sensor", "    def sample", "    def simple", r"mine.py:5: .* lacks sample\(time_ns\)"),
    ],
)
def test_what_is_wrong_names_the_plugin_and_its_line(
    kind: str, old: str, new: str, message: str, write: Write
) -> None:
    assert old in CODE[kind]
    file = write(CODE[kind].replace(old, new), *NAMED[kind])
    with pytest.raises(PluginError, match=message) as raised:
        run(file)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ("{size: -1}", r"tiny.yaml:6: size: must be greater than 0, not -1"),
        ("{size: 3 kg}", r"tiny.yaml:6: size: must have a unit of length"),
        ("{}", r"tiny.yaml:6: missing key 'size'"),
        ("{size: 1, cuont: 3}", r"tiny.yaml:6: unknown key 'cuont'; did you mean 'count'"),
        ("{size: 1, count: many}", r"tiny.yaml:6: count: must be a whole number"),
        ("3", r"tiny.yaml:6: the parameters of check 'mine.py:Mine' must be a mapping"),
    ],
)
def test_parameters_are_checked_by_what_the_plugin_declares(params: str, message: str, write: Write) -> None:
    file = write(CHECK, "", f"  - mine.py:Mine: {params}\n")
    with pytest.raises(ScenarioError, match=message):
        run(file)


@pytest.mark.parametrize(
    ("named", "checks", "message"),
    [
        (
            "",
            "  - mine.py:Mien:\n",
            r"tiny.yaml:6: .*mine.py: check 'mine.py:Mien': there is no 'Mien' in it; did",
        ),
        ("", "  - gone.py:Mine:\n", r"tiny.yaml:6: .*gone.py: check 'gone.py:Mine': there is no such file"),
        (
            "",
            "  - no_colision:\n",
            r"tiny.yaml:6: unknown key 'no_colision' in checks.0; did you mean 'no_coll",
        ),
        (
            "mission: {type: 'gone:Mine'}\n",
            AS_CHECK,
            r"tiny.yaml:5: mission 'gone:Mine': there is no module 'gone'",
        ),
        ("sensors: ['gone:Mine']\n", AS_CHECK, r"tiny.yaml:5: .*there is no module 'gone'"),
        ("sensors: [warmth]\n", AS_CHECK, r"tiny.yaml:5: .*there is no sensor 'warmth'"),
    ],
)
def test_what_cannot_be_found_is_told_with_the_scenario_s_line(
    named: str, checks: str, message: str, write: Write
) -> None:
    with pytest.raises(ScenarioError, match=message):
        schema.load(write(CHECK, named, checks))
