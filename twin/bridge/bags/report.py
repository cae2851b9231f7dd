"""What `ros2 bag info` prints.

Source: rosbag2_py/src/rosbag2_py/format_bag_metadata.cpp.
"""

from __future__ import annotations

import time
from dataclasses import replace

from twin.bridge.bags.metadata import BagTopic
from twin.bridge.bags.reader import BagReader

_NS = 1_000_000_000
_INDENT = " " * 19


def report(bag: BagReader) -> str:
    """Return the report, times in the local time zone."""
    info = bag.info
    named = sorted(info.topics, key=lambda topic: topic.name)
    topics = [topic for topic in named if not _is_service(topic)]
    services = [
        replace(each, name=each.name.removesuffix("/_service_event"), type=each.type.removesuffix("_Event"))
        for each in named
        if _is_service(each)
    ]
    lines = [
        "",
        f"Files:             {_below(list(info.files))}",
        f"Bag size:          {_size(bag.size)}",
        f"Storage id:        {info.storage}",
        f"ROS Distro:        {info.ros_distro or 'unknown'}",
        f"Duration:          {_seconds(info.duration_ns)}s",
        f"Start:             {_time(info.start_ns)}",
        f"End:               {_time(info.end_ns)}",
        f"Messages:          {sum(topic.count for topic in topics)}",
        f"Topic information: {_below([_entry('Topic', 'Count', topic) for topic in topics])}",
        f"Service:           {len(services)}",
        f"Service information: {_below([_entry('Service', 'Event Count', each) for each in services], '  ')}",
    ]
    return "\n".join(lines).rstrip() + "\n"


def _is_service(topic: BagTopic) -> bool:
    return topic.name.endswith("/_service_event") and topic.type.endswith("_Event")


def _entry(what: str, count: str, topic: BagTopic) -> str:
    return (
        f"{what}: {topic.name} | Type: {topic.type} | {count}: {topic.count} | "
        f"Serialization Format: {topic.serialization_format}"
    )


def _below(items: list[str], more: str = "") -> str:
    return f"\n{_INDENT}{more}".join(items)


def _size(size: float) -> str:
    for unit in ("B", "KiB", "MiB", "GiB"):
        if size < 1024:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1024
    return f"{size:.1f} TiB"


def _seconds(time_ns: int) -> str:
    return f"{time_ns // _NS}.{time_ns % _NS:09d}"


def _time(time_ns: int) -> str:
    local = time.localtime(time_ns // _NS)
    words = (
        f"{time.strftime('%b', local)} {local.tm_mday:2d} {local.tm_year} {time.strftime('%H:%M:%S', local)}"
    )
    return f"{words}.{time_ns % _NS:09d} ({_seconds(time_ns)})"
