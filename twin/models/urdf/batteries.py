"""The battery of a robot, from the LinearBatteryPlugin of new Gazebo.

Element names and units: gz-sim's LinearBatteryPlugin system; charges are in Ah there, times of charging in h.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from twin.models.specs import BatterySpec
from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.drives import library_of
from twin.models.urdf.gazebo import flag_in, value_of

LIBRARIES = ("gz-sim-linearbatteryplugin-system", "ignition-gazebo-linearbatteryplugin-system")
CLASS = "::systems::LinearBatteryPlugin"
HOUR = 3600.0
"""[s]; and an Ah in [C]"""
RANGES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "voltage": (0.1, 1e4),
        "open_circuit_voltage_constant_coef": (0.1, 1e4),
        "open_circuit_voltage_linear_coef": (-1e4, 1e4),
        "capacity": (0.001, 1e6),
        "initial_charge": (0.0, 1e6),
        "resistance": (0.0, 1e6),
        "smooth_current_tau": (1e-9, 1e5),
        "power_load": (0.0, 1e9),
        "charging_time": (0.001, 1e5),
    }
)
"""Numbers that have an effect, with the least and the largest, in the file's units."""
FLAGS = ("enable_recharge", "start_draining")
ELEMENTS = ("battery_name", *RANGES, *FLAGS)
"""What has an effect, and what does not is told by `twin check`."""
IN_ANY_CASE = ("fix_issue_225",)
"""What asks for what is done anyway."""


def read_battery(root: Element, report: Report) -> BatterySpec | None:
    """Return the battery of the robot, or None if no plugin describes one; the first counts."""
    plugin = next(batteries(root), None)
    if plugin is None:
        return None
    known = len(report.problems)
    values = {name: _number(plugin, name, report) for name in RANGES}
    flags = {name: _flag(plugin, name, report) for name in FLAGS}
    needed = ["voltage", "capacity", *(["charging_time"] if flags["enable_recharge"] else [])]
    for name in needed:
        if plugin.find(name) is None:
            _wrong(plugin, f"needs <{name}>", report)
    voltage, capacity = values["voltage"], values["capacity"]
    charge, hours = values["initial_charge"], values["charging_time"]
    constant = values["open_circuit_voltage_constant_coef"]
    linear = values["open_circuit_voltage_linear_coef"]
    if charge is not None and capacity is not None and charge > capacity:
        message = f"has initial_charge {charge:g} Ah; valid: 0 to its capacity, {capacity:g} Ah"
        _wrong(plugin.find("initial_charge"), message, report)
    full = voltage if constant is None else constant
    if full is not None and (empty := full + (linear or 0.0)) < RANGES["voltage"][0]:
        _wrong(
            plugin, f"leaves an empty battery {empty:g} V; valid: {RANGES['voltage'][0]:g} V or more", report
        )
    if len(report.problems) > known or voltage is None or capacity is None:
        return None
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
    return library_of(plugin) in LIBRARIES or str(plugin.get("name", "")).endswith(CLASS)


def _number(plugin: Element, name: str, report: Report) -> float | None:
    value = report.child_number(plugin, name)
    low, high = RANGES[name]
    if value is not None and not low <= value <= high:
        _wrong(plugin.find(name), f"has {name} {value:g}; valid: {low:g} to {high:g}", report)
        return None
    return value


def _flag(plugin: Element, name: str, report: Report) -> bool | None:
    element = plugin.find(name)
    flag = flag_in(element)
    if element is not None and flag is None:
        _wrong(element, f"has {name} '{value_of(element)}'; valid: true, false", report)
    return flag


def _wrong(element: Element, what: str, report: Report) -> None:
    report.add(element, f"the battery plugin {what}", code="bad-battery")
