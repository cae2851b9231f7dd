"""A number in a topic of a bag, over time."""

from __future__ import annotations

import math
from typing import Any

from twin.bridge import types
from twin.bridge.bags.reader import BagReader
from twin.bridge.cdr.codec import Codec, codec
from twin.errors import BridgeError

_MOST = 5000
"""Messages that are looked into at once: others wait so long."""
_NS = 1_000_000_000


def past_values(
    bag: BagReader, topic: str, typename: str, field: str, seconds: float, every: float, until_ns: int
) -> tuple[list[float], list[float]]:
    """Return when a topic told a number and what it was, up to a time of the bag.

    Args:
        bag: It.
        topic: Of it.
        typename: Of the topic.
        field: Path of the number, such as pose.pose.position.x or ranges.0.
        seconds: How far back [s].
        every: Least time between two values [s]; longer where there are too many.
        until_ns: The last time [ns].

    Raises:
        BridgeError: times that are none.
        RecordingError: the bag is damaged.
    """
    if not (math.isfinite(seconds) and seconds > 0.0 and math.isfinite(every) and every >= 0.0):
        raise BridgeError(f"seconds {seconds:g} and every {every:g} are no times; valid: 30 and 0.05")
    form = codec(types.get(typename))
    start_ns = max(bag.info.start_ns, until_ns - round(min(seconds * _NS, 2.0**63)))
    gap_ns = max(round(min(every, 1e9) * _NS), (until_ns - start_ns) // _MOST)
    times, values, next_ns = [], [], start_ns
    for message in bag.messages([topic], start_ns, until_ns):
        if message.log_ns >= next_ns:
            next_ns = message.log_ns + gap_ns
            times.append(message.log_ns / _NS)
            values.append(_number(form, message.data, field))
    return times, values


def _number(form: Codec[Any], data: bytes, path: str) -> float:
    try:
        value = form.decode(data)
    except Exception:  # bytes that are none: who hears them is told by itself
        return math.nan
    try:
        for key in path.split("."):
            value = value[int(key)] if key.isdigit() else getattr(value, key)
        return float(value)
    except (AttributeError, IndexError, TypeError, ValueError):
        return math.nan
