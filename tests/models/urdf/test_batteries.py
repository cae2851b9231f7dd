"""The LinearBatteryPlugin of new Gazebo: read, told of, or refused in a sentence with its line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from twin.convert.export import export
from twin.errors import ModelError
from twin.models.checks import check
from twin.models.loader import load, parse_urdf
from twin.models.specs import BatterySpec

NEW = "filename='gz-sim-linearbatteryplugin-system' name='gz::sim::systems::LinearBatteryPlugin'"
"""As in gz-sim's tutorial on batteries."""
GIVEN = """<battery_name>pack</battery_name><voltage>12.592</voltage>
<open_circuit_voltage_constant_coef>12.694</open_circuit_voltage_constant_coef>
<open_circuit_voltage_linear_coef>-3.1424</open_circuit_voltage_linear_coef>
<initial_charge>1.0</initial_charge><capacity>1.2</capacity><resistance>0.06</resistance>
<smooth_current_tau>1.9</smooth_current_tau><power_load>2.1</power_load><enable_recharge>true</enable_recharge>
<charging_time>3</charging_time><start_draining>false</start_draining><fix_issue_225>1</fix_issue_225>"""
BODY = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"


def robot(inside: str, kind: str = NEW, more: str = "") -> str:
    plugin = f"<gazebo>\n<plugin {kind}>\n{inside}\n</plugin>{more}</gazebo>"
    return f"<robot name='r'><link name='base'>{BODY}</link>\n{plugin}</robot>"


def test_all_that_it_says_is_read_in_si() -> None:
    assert parse_urdf(robot(GIVEN), Path("r.urdf")).battery == BatterySpec(
        battery_name="pack",
        voltage=12.592,
        capacity=pytest.approx(4320.0),
        initial_charge=pytest.approx(3600.0),
        open_circuit_voltage_constant_coef=12.694,
        open_circuit_voltage_linear_coef=-3.1424,
        resistance=0.06,
        smooth_current_tau=1.9,
        power_load=2.1,
        enable_recharge=True,
        charging_time=pytest.approx(10800.0),
        start_draining=False,
        line=3,
    )


@pytest.mark.parametrize(
    "kind",
    [
        "filename='libignition-gazebo-linearbatteryplugin-system.so' name='x'",
        "filename='y' name='ignition::gazebo::systems::LinearBatteryPlugin'",
    ],
)
def test_every_spelling(kind: str) -> None:
    few = parse_urdf(robot("<voltage>24</voltage><capacity>10</capacity>", kind), Path("r.urdf")).battery
    assert few is not None
    assert (few.battery_name, few.enable_recharge, few.power_load) == ("battery", False, None)


def test_a_whole_plugin_is_no_news_to_check() -> None:
    description = parse_urdf(robot(GIVEN), Path("r.urdf"))
    assert "not-simulated" not in [found.code for found in check(description)]


def test_all_that_is_wrong_is_told_at_once() -> None:
    wrong = "<voltage>12</voltage><capacity>2</capacity><initial_charge>5</initial_charge>"
    wrong += "<resistance>-1</resistance><enable_recharge>true</enable_recharge>"
    with pytest.raises(ModelError) as told:
        parse_urdf(robot(wrong), Path("r.urdf"))
    for words in ("initial_charge 5 Ah", "resistance -1", "needs <charging_time>"):
        assert words in str(told.value)


def test_no_other_plugin_is_a_battery() -> None:
    assert parse_urdf(robot("", "filename='libwind.so' name='wind'"), Path("r.urdf")).battery is None


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("<voltage>12.592</voltage>", "", 3, "the battery plugin needs <voltage>"),
        ("<capacity>1.2</capacity>", "<capacity>0</capacity>", 7, "capacity 0; valid: 0.001 to 1e+06"),
        ("<capacity>1.2</capacity>", "<capacity>much</capacity>", 7, "<capacity>much</capacity> is not a"),
        (">1.0<", ">1.5<", 7, "has initial_charge 1.5 Ah; valid: 0 to its capacity, 1.2 Ah"),
        ("<charging_time>3</charging_time>", "", 3, "the battery plugin needs <charging_time>"),
        (">true<", ">maybe<", 8, "enable_recharge 'maybe'; valid: true, false"),
        ("-3.1424", "-12.694", 3, "leaves an empty battery 0 V; valid: 0.1 V or more"),
    ],
)
def test_a_wrong_value_is_one_sentence_with_its_line(old: str, new: str, line: int, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        parse_urdf(robot(GIVEN.replace(old, new)), Path("r.urdf"))
    (problem,) = caught.value.problems
    assert message in problem.message
    assert (problem.line, problem.code) == (line, "bad-battery" if "much" not in new else "bad-number")


def test_report_and_check_know_it(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    more = f"<plugin {NEW}><voltage>1</voltage><capacity>1</capacity></plugin>"
    file.write_text(robot(GIVEN + "<soc_threshold>0.5</soc_threshold>", more=more), encoding="utf-8")
    description = load(file)
    assert [found.message for found in check(description) if found.code == "not-simulated"] == [
        "<soc_threshold> of the battery plugin has no effect",
        "another battery plugin stands before; the first counts",
    ]
    report = export(description, tmp_path / "out")
    assert json.loads((tmp_path / "out/report.json").read_text("utf-8")) == json.loads(json.dumps(report))
    assert report["battery"]["capacity"] == pytest.approx(4320.0)
    told = [(entry["element"].rpartition("/")[2], entry["note"]) for entry in report["ledger"]]
    assert ("plugin", "MuJoCo has no batteries; twin run drains it, and publishes battery_state") in told
    assert ("capacity", "the battery's; not in robot.xml; report.json has it") in told
    assert ("soc_threshold", "the plugin's own business") in told
    assert ("plugin", "the first battery of the robot counts") in told
