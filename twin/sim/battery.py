"""A battery that powers a robot.

Open-circuit voltage, inner resistance, smoothing of the current and all names but `charger_reach` and
`update_rate` are those of gz-sim's LinearBatteryPlugin, with its `fix_issue_225`. Different: the motors' work
counts beside the constant load; a battery is charged until it is full (there: 90 %); a load that it cannot
deliver is not delivered, so that its voltage stays between half and one and a half of the open-circuit one.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from twin.parameters import Coulombs, Hertz, Interval, Metres, NotNegative, Ohms, Seconds, Volts, Watts

_NOTHING = 1e-6
"""A current that is less [A] and only lags behind none is none."""
_FALLS = -0.15
"""Of the open-circuit voltage until a battery is empty, if nobody says how much."""
_LEAST = 0.1
"""Open-circuit voltage of any battery [V], empty ones too: nothing is divided by less."""


@dataclass(frozen=True, kw_only=True)
class BatteryConfig:
    """A battery; defaults are of a 24 V pack for a robot of some 50 kg."""

    battery_name: str = "battery"
    """What `battery_state` tells as its location."""
    voltage: Annotated[Volts, Interval(ge=0.1, le=1e4)] = 24.0
    """At the start, before any current flows."""
    open_circuit_voltage_constant_coef: Annotated[Volts, Interval(ge=0.1, le=1e4)] | None = None
    """Without load when it is full; absent: `voltage`."""
    open_circuit_voltage_linear_coef: Annotated[Volts, Interval(ge=-1e4, le=1e4)] | None = None
    """By how much more when it is empty, usually negative; absent: 15 % of the former less."""
    capacity: Annotated[Coulombs, Interval(ge=3.6, le=3.6e9)] = 72_000.0
    """Charge when it is full, such as `20 Ah`."""
    initial_charge: Annotated[Coulombs, NotNegative] | None = None
    """Charge at the start, such as `5 Ah`; absent: full."""
    resistance: Annotated[Ohms, Interval(ge=0.0, le=1e6)] = 0.05
    """Its inner one."""
    smooth_current_tau: Annotated[Seconds, Interval(gt=0.0, le=1e5)] = 1.0
    """Time constant with which the current follows the load."""
    power_load: Annotated[Watts, Interval(ge=0.0, le=1e9)] = 20.0
    """Of computers and sensors, all the time; what motors really do comes on top."""
    enable_recharge: bool = True
    """Whether chargers charge it."""
    charging_time: Annotated[Seconds, Interval(ge=3.6, le=3.6e8)] = 7200.0
    """In which a charger fills an empty battery that has no load."""
    start_draining: bool = True
    """Whether it drains from the start, else from the first command to a motor."""
    charger_reach: Annotated[Metres, Interval(gt=0.0, le=10.0)] = 0.1
    """How far from the pose of a dock that is a charger the base may stand."""
    update_rate: Annotated[Hertz, Interval(ge=0.001, le=1000.0)] = 1.0
    """Of `battery_state`; no more than one a control period."""

    def __post_init__(self) -> None:
        if self.initial_charge is not None and self.initial_charge > self.capacity:
            most, given = self.capacity / 3600.0, self.initial_charge / 3600.0
            raise ValueError(f"initial_charge must be at most the capacity, {most:g} Ah, not {given:g} Ah")
        empty = self.open_circuit(0.0)
        if empty < _LEAST:
            raise ValueError(
                f"open_circuit_voltage_linear_coef must leave an empty battery {_LEAST:g} V or more, not "
                f"{empty:g} V"
            )

    def open_circuit(self, share: float) -> float:
        """Return the voltage without load [V] when so much of the capacity is left, 0 to 1."""
        constant, linear = self.open_circuit_voltage_constant_coef, self.open_circuit_voltage_linear_coef
        full = self.voltage if constant is None else constant
        return full + (_FALLS * full if linear is None else linear) * (1.0 - share)


class Supply(Enum):
    """What a battery does."""

    DISCHARGING = "discharging"
    CHARGING = "charging"
    FULL = "full"
    IDLE = "idle"
    """Neither: empty, or nothing has drained it yet."""


class Battery:
    """What is left in a battery; currents are positive out of it, unlike in ROS."""

    def __init__(self, config: BatteryConfig) -> None:
        self.config = config
        self.charge = config.capacity if config.initial_charge is None else config.initial_charge
        """[C]"""
        self.voltage = config.voltage
        """At its poles [V]."""
        self.current = 0.0
        """Out of it, smoothed [A]; negative while it is charged."""

    @property
    def share(self) -> float:
        """What is left of its capacity, 0 to 1."""
        return self.charge / self.config.capacity

    @property
    def is_empty(self) -> bool:
        """Whether nothing is left."""
        return self.charge <= 0.0

    @property
    def supply(self) -> Supply:
        """What it does."""
        if self.charge >= self.config.capacity and self.current <= 0.0:
            return Supply.FULL
        if self.current == 0.0:
            return Supply.IDLE
        return Supply.DISCHARGING if self.current > 0.0 else Supply.CHARGING

    def advance(self, step_ns: int, load: float, *, charges: bool) -> None:
        """Let it give a power for a while.

        Args:
            step_ns: How long [ns]; short against `smooth_current_tau`.
            load: Mean power [W], not negative.
            charges: Whether a charger is connected.
        """
        config, seconds = self.config, step_ns * 1e-9
        drawn = self._drawn(load, charges=charges)
        self.current += min(seconds / config.smooth_current_tau, 1.0) * (drawn - self.current)
        if drawn == 0.0 and abs(self.current) < _NOTHING:
            self.current = 0.0
        left = self.charge - seconds * self.current
        self.charge = min(max(left, 0.0), config.capacity)
        if self.charge != left:  # it gives no more, or takes no more
            self.current = 0.0
        without_load = self._open_circuit
        sags = without_load - config.resistance * self.current
        self.voltage = min(max(sags, 0.5 * without_load), 1.5 * without_load)

    def _drawn(self, load: float, *, charges: bool) -> float:
        """Return the current that load and charger ask for [A]."""
        config = self.config
        current = load / self.voltage
        if config.resistance > 0.0:
            current = min(current, self._open_circuit / (2.0 * config.resistance))
        if charges and config.enable_recharge:
            current -= config.capacity / config.charging_time
            # A charger that stays connected carries the load of a full battery.
            return max(current, 0.0) if self.charge >= config.capacity else current
        return 0.0 if self.is_empty else current

    @property
    def _open_circuit(self) -> float:
        """Its voltage without load [V]."""
        return self.config.open_circuit(self.share)
