"""Batteries of simulated robots: what drains and fills them, and who notices."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.runtime.conftest import MakeRun
from twin.bridge.msgs import BatteryState, Twist, new
from twin.errors import ScenarioError
from twin.live.futures import Futures, WhatIf
from twin.live.futures.inputs import Inputs
from twin.live.futures.snapshot import Snapshot
from twin.models.catalogue import resolve
from twin.runtime.open_run import OpenRun
from twin.runtime.open_run import run as run_whole
from twin.runtime.run import Run
from twin.runtime.stacks.context import Layout
from twin.scenario.schema import Scenario, load

MakeScenario = Callable[[str], Scenario]
DRIVE = """
name: drive
seed: 1
duration: {duration}
robots: [{{model: diff_bot, battery: {battery}}}]
mission: {{type: velocity_profile, robot: diff_bot, steps: [{{duration: 9 s, linear: {speed}}}]}}
checks: {checks}
"""
DOCK = """
name: dock
seed: 1
duration: 40 s
world: {{obstacles: [{{name: charger, pose: {{x: 1.55}}, size: [0.2, 0.6, 0.4]}}]}}
robots:
  - model: diff_bot
    pose: {{x: 0.1}}
    battery: {{initial_charge: 10 Ah, enable_recharge: {charges}}}
    localisation: {{type: odometry}}
    navigation:
      docking:
        max_retries: 0
        docks: {{home: {{type: charger, pose: {{x: 0.9}}}}}}
        types: {{charger: {{use_battery_status: true}}}}
mission: {{type: behaviors, robot: diff_bot, steps: [{{dock_robot: {{dock: home}}}}]}}
checks: [mission_succeeded: ]
early_stop: decided
"""
PAIR = """
name: pair
seed: 1
duration: 1.5 s
robots:
  - {model: diff_bot, name: a, pose: {y: 1}, battery: {capacity: 1 Ah}}
  - {model: diff_bot, name: b, pose: {y: -1}}
  - {model: diff_bot, name: c, pose: {y: -3}, battery: {initial_charge: 0 Ah}}
missions:
  - {type: behaviors, robot: a, steps: [drive_on_heading: {distance: 0.2}]}
  - {type: velocity_profile, robot: c, steps: [{duration: 2 s, linear: 0.3 m/s}]}
checks:
  - always: /a/battery_state.percentage > 0.99
  - always: /a/battery_state.header.frame_id == 'base_footprint'
  - finally: /c/battery_state.percentage == 0
  - always: norm(/c/odom.twist.twist.linear) < 0.05
"""


def drive(
    battery: str, duration: str = "2 s", speed: str = "0.3 m/s", checks: str = "[no_collision: ]"
) -> str:
    return DRIVE.format(battery=battery, duration=duration, speed=speed, checks=checks)


def states(run: Run, topic: str = "battery_state") -> list[BatteryState]:
    found: list[BatteryState] = []
    run.bus.create_node("ear").create_subscription(BatteryState, topic, found.append, 1)
    return found


def finish(run: Run) -> Run:
    while not run.over:
        run.tick()
    return run


def charge(run: Run) -> float:
    return run.batteries["diff_bot"].battery.charge


def test_it_tells_its_state_once_a_second(scenario: MakeScenario, make_run: MakeRun) -> None:
    run = make_run(scenario(drive("{battery_name: pack, capacity: 2 mAh, initial_charge: 1.5 mAh}", "2.1 s")))
    told = states(run)
    finish(run)
    times = [message.header.stamp.sec + message.header.stamp.nanosec * 1e-9 for message in told]
    assert times == [0.02, 1.0, 2.0]
    last = told[-1]
    assert (last.header.frame_id, last.location, last.present) == ("base_footprint", "pack", True)
    assert last.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    assert -1.0 < last.current < -0.5, "out of it; smoothed, 20 W are on their way to 0.8 A"
    assert last.capacity == last.design_capacity == pytest.approx(0.002)
    assert last.percentage == pytest.approx(last.charge / last.capacity)
    assert 0.4 < last.percentage < 0.75
    assert last.voltage == pytest.approx(20.4 + 3.6 * last.percentage + 0.05 * last.current, abs=1e-3)
    assert math.isnan(last.temperature)
    assert len(last.cell_voltage) == 0


def test_driving_costs_more_than_standing(scenario: MakeScenario, make_run: MakeRun) -> None:
    stood, drove = (finish(make_run(scenario(drive("{}", speed=v)))) for v in ("0 m/s", "0.3 m/s"))
    lag = math.exp(-2.0)  # of what is drawn since the start with tau 1 s
    assert 72_000.0 - charge(stood) == pytest.approx(20.0 / 24.0 * (2.0 - (1.0 - lag)), rel=0.02)
    work_J = drove.world.work("diff_bot")
    assert work_J > 0.05
    more = charge(stood) - charge(drove)
    assert 0.5 * work_J / 26.0 < more < work_J / 26.0, "the rest is still to be drawn"


def test_it_drains_from_the_first_command_if_it_is_told_so(scenario: MakeScenario, make_run: MakeRun) -> None:
    stood, drove = (
        finish(make_run(scenario(drive("{start_draining: false}", speed=v)))) for v in ("0 m/s", "0.3 m/s")
    )
    assert charge(stood) == 72_000.0
    assert charge(drove) < 72_000.0


def test_an_empty_battery_gives_motors_nothing_and_says_so(scenario: MakeScenario, make_run: MakeRun) -> None:
    text = drive("{capacity: 1 mAh, initial_charge: 0.3 mAh, update_rate: 10 Hz}", "6 s", speed="0.1 m/s")
    faster = "{duration: 3 s, linear: 0.1 m/s}, {duration: 9 s, linear: 0.3 m/s}"
    run = make_run(scenario(text.replace("{duration: 9 s, linear: 0.1 m/s}", faster)))
    told = states(run)
    places = []
    while not run.over:
        run.tick()
        places.append(run.world.pose("diff_bot/base_footprint").xyz[0])
    hardware = run.world.robots["diff_bot"].hardware
    assert hardware.ordered("wheel_left_joint") > 5.0
    assert hardware.strongest("wheel_left_joint") == 0.0
    assert 0.0 <= (places[-1] - places[-51]) < 0.12, "it can but roll on: 0.3 m/s is not for it any more"
    empty = told[-1]
    assert (empty.percentage, empty.charge, empty.current) == (0.0, 0.0, 0.0)
    assert empty.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING


@pytest.mark.parametrize("charges", [True, False])
def test_docking_by_the_batterys_status_succeeds_because_it_charges(
    scenario: MakeScenario, make_run: MakeRun, charges: bool
) -> None:
    run = make_run(scenario(DOCK.format(charges=str(charges).lower())))
    told = states(run)
    finish(run)
    (result,) = (check.result() for check in run.checks)
    assert result.passed is charges, result.reason
    assert charges or "the battery is not charged" in result.reason
    charging = [m for m in told if m.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING]
    assert bool(charging) is charges
    assert not charges or charging[-1].current > 0.5


def test_an_empty_robot_whose_autonomy_is_elsewhere_is_charged_and_has_power_from_one_percent_on(
    scenario: MakeScenario, make_run: MakeRun
) -> None:
    text = DOCK.format(charges="true").replace("duration: 40", "duration: 3").replace("x: 0.1", "x: 0.9")
    text = text.replace("initial_charge: 10 Ah", "initial_charge: 0 Ah, charging_time: 36 s, power_load: 0 W")
    run = make_run(scenario(text), layout=Layout(autonomy="none"))
    hardware, battery = run.world.robots["diff_bot"].hardware, run.batteries["diff_bot"].battery
    told = states(run)
    off: list[float] = []
    while not run.over:
        run.tick()
        if hardware.strongest("wheel_left_joint") == 0.0:
            off.append(battery.share)
    assert 0.005 < max(off) < 0.01 < battery.share
    assert off == sorted(off), "once it is on it stays on"
    assert told[-1].power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING


def test_who_only_passes_a_charger_is_not_charged(scenario: MakeScenario, make_run: MakeRun) -> None:
    text = DOCK.format(charges="true").replace("{dock_robot: {dock: home}}", "{wait: {duration: 9 s}}")
    run = make_run(
        scenario(text.replace("pose: {x: 0.1}", "pose: {x: 0.75}").replace("duration: 40", "duration: 6"))
    )
    pilot = run.bus.create_node("pilot").create_publisher(Twist, "cmd_vel", 1)
    stands, places = run.batteries["diff_bot"], []
    message = new(Twist)
    message.linear.x = 0.2
    while not run.over:
        pilot.publish(message)
        run.tick()
        places.append(run.world.pose("diff_bot/base_footprint").xyz[0])
    assert min(places) < 0.8
    assert max(places) > 1.0
    assert stands.battery.current > 0.0


def test_several_robots_have_their_own_and_workers_change_nothing(scenario: MakeScenario) -> None:
    alone, shared = (run_whole(scenario(PAIR), record=False, workers=n) for n in (0, 2))
    assert [check.reason for check in alone.checks] == [""] * 4
    assert shared.digest == alone.digest


def test_snapshot_and_fork_go_on_with_the_same_charge(scenario: MakeScenario) -> None:
    run = OpenRun(scenario(drive("{capacity: 5 mAh}", "2 s")), record=False)
    again = None
    try:
        inputs = Inputs(run)
        run.advance(lambda: run.run.world.time_ns >= 1_000_000_000)
        again = Snapshot.of(run, inputs).restore()
        assert charge(again.run) == charge(run.run) < 18.0
        with Futures(run, WhatIf(n=1, horizon=0.5)) as futures:
            (future,) = futures.wait().outcomes
        for each in (run, again):
            each.advance(lambda each=each: each.run.world.time_ns >= 1_500_000_000)
        digests = [each.digest.finish(each.run.world.state_digest()) for each in (run, again)]
        assert [future.digest, *digests] == [digests[0]] * 3, "battery_state is in it"
        assert charge(again.run) == charge(run.run)
    finally:
        run.close()
        if again is not None:
            again.close()


@pytest.mark.parametrize(
    ("battery", "message"),
    [
        ("{capacity: 0 Ah}", "scenario.yaml:5: robots.0.battery.capacity"),
        ("{resistance: 5 V}", "scenario.yaml:5: robots.0.battery.resistance"),
        ("{capacitance: 5}", "scenario.yaml:5: unknown key 'capacitance' in robots.0.battery"),
        (
            "{initial_charge: 30 Ah}",
            "scenario.yaml:5: battery of robot 'diff_bot': initial_charge must be at most",
        ),
    ],
)
def test_a_wrong_value_is_one_sentence_with_its_line(
    scenario: MakeScenario, make_run: MakeRun, battery: str, message: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        make_run(scenario(drive(battery)))
    assert message in str(caught.value)
    assert len(caught.value.problems) == 1


def test_a_file_with_gazebos_plugin_brings_one_and_the_scenario_may_change_it(
    tmp_path: Path, make_run: MakeRun
) -> None:
    plugin = """<gazebo><plugin filename="gz-sim-linearbatteryplugin-system"
      name="gz::sim::systems::LinearBatteryPlugin"><battery_name>pack</battery_name><voltage>12</voltage>
      <capacity>2</capacity><power_load>6</power_load></plugin></gazebo></robot>"""
    source = resolve("diff_bot")
    text = source.read_text("utf-8").replace("</robot>", plugin).replace("../", f"{source.parents[1]}/")
    (tmp_path / "mine.urdf.xacro").write_text(text, encoding="utf-8")
    file = tmp_path / "scenario.yaml"
    for battery, load_W in (("", 6.0), ("battery: {power_load: 9 W},", 9.0)):
        robots = f"robots: [{{model: ./mine.urdf.xacro, {battery} name: diff_bot}}]"
        lines = drive("{}").splitlines()
        lines[4] = robots
        file.write_text("\n".join(lines), encoding="utf-8")
        config = make_run(load(file)).batteries["diff_bot"].battery.config
        assert (config.battery_name, config.capacity, config.power_load) == ("pack", 7200.0, load_W)
        assert (config.resistance, config.enable_recharge) == (0.0, False)


def test_without_one_nothing_is_there(scenario: MakeScenario, make_run: MakeRun) -> None:
    run = make_run(scenario(drive("{}").replace(", battery: {}", "")))
    assert run.batteries == {}
    assert not [node for node in run.bus.nodes if "battery" in node.name]
    assert run.world.work("diff_bot") == 0.0, "nor is work measured"
