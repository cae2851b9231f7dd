"""The battery by itself, against gz-sim's formula written out and against what can be solved by hand."""

from __future__ import annotations

import math

import pytest

from twin.sim.battery import Battery, BatteryConfig, Supply

TICK_NS = 20_000_000
VOLTAGES = {"open_circuit_voltage_constant_coef": 26.0, "open_circuit_voltage_linear_coef": -4.0}
SHORT = BatteryConfig(capacity=360.0, resistance=0.06, smooth_current_tau=2.0, **VOLTAGES)
"""0.1 Ah"""


def run(battery: Battery, seconds: float, load: float, *, charges: bool = False) -> Battery:
    for _ in range(round(seconds * 1e9) // TICK_NS):
        battery.advance(TICK_NS, load, charges=charges)
    return battery


def test_it_falls_as_gazebos_does() -> None:
    e0, e1, c, r, tau, dt, power = 26.0, -4.0, 0.1, 0.06, 2.0, 0.02, 30.0
    q, voltage, smooth = c, 24.0, 0.0
    battery = Battery(SHORT)
    for _ in range(5000):
        smooth += dt / tau * (power / voltage - smooth)
        q -= dt * smooth / 3600.0
        voltage = e0 + e1 * (1.0 - q / c) - r * smooth
        battery.advance(TICK_NS, power, charges=False)
    assert battery.share == pytest.approx(q / c, abs=1e-12)
    assert (battery.voltage, battery.current) == pytest.approx((voltage, smooth), abs=1e-9)
    assert battery.supply is Supply.DISCHARGING
    assert battery.share == pytest.approx(0.67, abs=0.02), "far enough that all terms count"


def test_a_constant_load_takes_its_energy() -> None:
    """Without resistance and lag the energy of the charge is the integral of voltage over it."""
    battery = run(
        Battery(BatteryConfig(capacity=360.0, resistance=0.0, smooth_current_tau=0.02, **VOLTAGES)),
        100.0,
        30.0,
    )
    e0, e1, left = 26.0, -4.0, battery.share
    given = 360.0 * ((e0 + e1) * (1.0 - left) - e1 * (1.0 - left**2) / 2.0)
    assert given == pytest.approx(30.0 * 100.0, rel=1e-3)


def test_it_ends_empty_and_gives_nothing_more() -> None:
    battery = run(Battery(SHORT), 600.0, 30.0)
    assert (battery.is_empty, battery.share, battery.current) == (True, 0.0, 0.0)
    assert (battery.voltage, battery.supply) == (pytest.approx(22.0), Supply.IDLE)


def test_a_charger_fills_it_in_its_time_and_then_carries_the_load() -> None:
    config = BatteryConfig(capacity=360.0, initial_charge=0.0, charging_time=100.0, smooth_current_tau=0.02)
    battery = run(Battery(config), 50.0, 0.0, charges=True)
    assert battery.share == pytest.approx(0.5, abs=1e-3)
    assert (battery.current, battery.supply) == (pytest.approx(-3.6), Supply.CHARGING)
    run(battery, 51.0, 0.0, charges=True)
    assert (battery.share, battery.supply) == (1.0, Supply.FULL)
    run(battery, 20.0, 30.0, charges=True)
    assert battery.share == 1.0
    never = run(Battery(BatteryConfig(initial_charge=10.0, enable_recharge=False)), 1.0, 0.0, charges=True)
    assert never.charge == 10.0


def test_what_it_cannot_deliver_is_not_delivered() -> None:
    battery = run(Battery(BatteryConfig(capacity=3.6e6, resistance=1.0, **VOLTAGES)), 20.0, 1e9)
    assert battery.voltage >= 0.49 * 26.0
    assert battery.current == pytest.approx(13.0, rel=0.01), "half of the open-circuit voltage over 1 Ω"
    assert math.isfinite(battery.charge)


def test_a_charger_does_not_drive_its_voltage_anywhere() -> None:
    config = BatteryConfig(capacity=72_000.0, initial_charge=0.0, resistance=5.0, charging_time=3600.0)
    assert run(Battery(config), 10.0, 0.0, charges=True).voltage <= 1.5 * 24.0


def test_it_neither_gives_nor_takes_once_nothing_is_connected() -> None:
    config = BatteryConfig(initial_charge=36_000.0)
    battery = run(Battery(config), 5.0, 0.0, charges=True)
    assert battery.supply is Supply.CHARGING
    run(battery, 20.0, 0.0)
    assert (battery.current, battery.supply) == (0.0, Supply.IDLE)


def test_its_voltages_follow_from_the_one_that_is_given() -> None:
    config = BatteryConfig(voltage=12.0)
    assert (config.open_circuit(1.0), config.open_circuit(0.0)) == (12.0, pytest.approx(10.2))
    assert run(Battery(config), 1.0, 0.0).voltage == 12.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"capacity": 3600.0, "initial_charge": 7200.0}, "initial_charge must be at most the capacity, 1 Ah"),
        (
            {"open_circuit_voltage_linear_coef": -26.0},
            "linear_coef must leave an empty battery 0.1 V or more",
        ),
    ],
)
def test_values_that_do_not_fit_are_refused(values: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        BatteryConfig(**values)  # type: ignore[arg-type]
