"""The battery of a robot, from the LinearBattery plugin of new Gazebo.

Element names and units: gz-sim's LinearBatteryPlugin system; charges are in Ah there, times of charging in h.
"""

from __future__ import annotations

from collections.abc import Iterator

from twin.models.specs import BatterySpec
from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.drives import library_of
from twin.models.urdf.gazebo import flag_in, value_of

LIBRARIES = ("gz-sim-linearbattery-plugin-system", "ignition-gazebo-linearbattery-plugin-system")
CLASSES = ("::systems::LinearBattery", "::systems::LinearBatteryPlugin")
HOUR = 3600.0
"""[s]; and an Ah in [C]"""
POSITIVE = ("voltage", "capacity", "smooth_current_tau", "charging_time")
NOT_NEGATIVE = ("initial_charge", "resistance", "power_load")
SIGNED = ("open_circuit_voltage_constant_coef", "open_circuit_voltage_linear_coef")
FLAGS = ("enable_recharge", "start_draining")
ELEMENTS = ("battery_name", *POSITIVE, *NOT_NEGATIVE, *SIGNED, *FLAGS)
"""What has an effect. Charge is always counted as with `fix_issue_225`."""


def read_battery(root: Element, report: Report) -> BatterySpec | None:
    """Return the battery of the robot, or None if no plugin describes one; the first counts."""
    plugin = next(batteries(root), None)
    if plugin is None:
        return None
    known = len(report.problems)
    values = {name: _number(plugin, name, report) for name in (*POSITIVE, *NOT_NEGATIVE, *SIGNED)}
    flags = {name: _flag(plugin, name, report) for name in FLAGS}
    needed = ["voltage", "capacity", *(["charging_time"] if flags["enable_recharge"] else [])]
    for name in needed:
        if plugin.find(name) is None:
            _wrong(plugin, f"needs a positive <{name}>", report)
    if len(report.problems) > known:
        return None
    voltage, capacity = values["voltage"] or 0.0, values["capacity"] or 0.0
    charge, hours = values["initial_charge"], values["charging_time"]
    constant, linear = (values[name] for name in SIGNED)
    if charge is not None and charge > capacity:
        message = f"has initial_charge {charge:g} Ah; valid: 0 to its capacity, {capacity:g} Ah"
        _wrong(plugin.find("initial_charge"), message, report)
    full = voltage if constant is None else constant
    if (least := min(full, full + (linear or 0.0))) <= 0.0:
        _wrong(
            plugin, f"has an open-circuit voltage of {least:g} V, full or empty; give a positive one", report
        )
    return BatterySpec(
        battery_name=text_of(plugin, "battery_name") or "battery",
        voltage=voltage,
        capacity=capacity * HOUR,
        initial_charge=None if charge is None else charge * HOUR,
        open_circuit_voltage_constant_coef=constant,
        open_circuit_voltage_linear_coef=linear,
        resistance=values["resistance"],
        smooth_current_tau=values["smooth_current_tau"],
        power_load=values["power_load"],
        enable_recharge=bool(flags["enable_recharge"]),
        charging_time=None if hours is None else hours * HOUR,
        start_draining=flags["start_draining"],
        line=report.line(plugin),
    )


def batteries(root: Element) -> Iterator[Element]:
    """Yield the plugins that describe a battery, in file order."""
    return (plugin for plugin in root.iterfind("gazebo/plugin") if is_battery(plugin))


def is_battery(plugin: Element) -> bool:
    """Tell whether a plugin is a battery."""
    return library_of(plugin) in LIBRARIES or str(plugin.get("name", "")).endswith(CLASSES)


def _number(plugin: Element, name: str, report: Report) -> float | None:
    value = report.child_number(plugin, name)
    if value is None or name in SIGNED:
        return value
    if value < 0.0 or (value == 0.0 and name in POSITIVE):
        valid = "more than 0" if name in POSITIVE else "0 or more"
        _wrong(plugin.find(name), f"has {name} {value:g}; valid: {valid}", report)
    return value


def _flag(plugin: Element, name: str, report: Report) -> bool | None:
    element = plugin.find(name)
    flag = flag_in(element)
    if element is not None and flag is None:
        _wrong(element, f"has {name} '{value_of(element)}'; valid: true, false", report)
    return flag


def _wrong(element: Element, what: str, report: Report) -> None:
    report.add(element, f"the battery plugin {what}", code="bad-battery")
