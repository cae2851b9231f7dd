"""Values of a verdict as people read them."""

from __future__ import annotations

import math


def quantity(value: float | bool | None, unit: str, limit: float | bool | None) -> str:
    """Format a value in the unit that suits its limit, so that the two can be compared at a glance.

    >>> quantity(0.00123, "m", 0.002), quantity(True, "", True)
    ('1.23 mm', 'yes')
    >>> quantity(-1e-9, "rad", None)
    '0 deg'
    """
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    value, unit = in_degrees(value, unit)
    if unit == "m" and limit is not None and 0.0 < limit < 0.1 and value < 1.0:
        value, unit = value * 1e3, "mm"
    return f"{round(value, 3) + 0.0:.5g} {unit}".rstrip()  # + 0.0: no sign of a zero


def in_degrees(value: float, unit: str) -> tuple[float, str]:
    """Return an angle, or a rate of one, in degrees; everything else as it is.

    >>> in_degrees(math.pi, "rad/s"), in_degrees(2.0, "m")
    ((180.0, 'deg/s'), (2.0, 'm'))
    """
    return (math.degrees(value), f"deg{unit[3:]}") if unit.split("/")[0] == "rad" else (value, unit)


def seconds(value: float | None, digits: int = 1) -> str:
    """Return a time with its unit; nothing for None.

    >>> seconds(2.25, 2), seconds(None)
    ('2.25 s', '')
    """
    return "" if value is None else f"{value:.{digits}f} s"
