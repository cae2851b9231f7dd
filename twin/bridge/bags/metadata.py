"""`metadata.yaml` of a bag, version 9 as rosbag2 of Jazzy writes it.

Source: rosbag2_storage/include/rosbag2_storage/yaml.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from twin.bridge.bags import offered_qos
from twin.bridge.bags.offered_qos import OfferedQoS
from twin.errors import RecordingError
from twin.files.reading import read_text

FILE = "metadata.yaml"
VERSION = 9
ROS_DISTRO = "jazzy"
"""The distribution whose message types and files these are."""
_ROOT = "rosbag2_bagfile_information"


@dataclass(frozen=True, kw_only=True)
class BagTopic:
    """A topic of a bag."""

    name: str
    type: str
    """package/msg/Name."""
    type_hash: str = ""
    """RIHS01, empty if the bag does not tell."""
    definition: str = ""
    """The type's full definition, empty if the bag does not tell."""
    definition_format: str = "ros2msg"
    """Or ros2idl."""
    qos: tuple[OfferedQoS, ...] = ()
    """One per publisher."""
    count: int = 0
    """Messages."""
    serialization_format: str = "cdr"

    @property
    def latched(self) -> bool:
        """Whether late subscribers got the last samples."""
        return any(profile.latched for profile in self.qos)


class BagMessage(NamedTuple):
    """A message of a bag."""

    topic: str
    data: bytes
    """CDR."""
    log_ns: int
    """When it was received [ns]."""
    publish_ns: int
    """When it was published [ns]; `log_ns` if the bag does not tell."""
    sequence: int = 0
    """The publisher's count from 1; 0 if the bag does not tell."""


@dataclass(frozen=True, kw_only=True)
class BagInfo:
    """What there is to know of a bag without reading its messages."""

    storage: str
    """mcap, sqlite3 or rosbag1."""
    files: tuple[str, ...]
    """Relative to the bag."""
    start_ns: int = 0
    end_ns: int = 0
    """Log time of the first and the last message [ns]; equal if there is none."""
    topics: tuple[BagTopic, ...] = ()
    file_ranges: tuple[tuple[int, int, int], ...] = ()
    """Per file: first and last log time [ns], messages; empty if not known."""
    compression_format: str = ""
    compression_mode: str = ""
    custom_data: dict[str, str] = field(default_factory=dict)
    ros_distro: str = ""
    version: int = VERSION

    @property
    def count(self) -> int:
        """Messages in all topics."""
        return sum(topic.count for topic in self.topics)

    @property
    def duration_ns(self) -> int:
        """From the first to the last message."""
        return self.end_ns - self.start_ns


def to_data(info: BagInfo) -> dict[str, Any]:
    """Return the tree under `rosbag2_bagfile_information`."""
    ranges = info.file_ranges or tuple((info.start_ns, info.end_ns, info.count) for _ in info.files)
    return {
        "version": VERSION,
        "storage_identifier": info.storage,
        "duration": {"nanoseconds": info.duration_ns},
        "starting_time": {"nanoseconds_since_epoch": info.start_ns},
        "message_count": info.count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type,
                    "serialization_format": topic.serialization_format,
                    "offered_qos_profiles": offered_qos.to_data(topic.qos),
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.count,
            }
            for topic in info.topics
        ],
        "compression_format": info.compression_format,
        "compression_mode": info.compression_mode,
        "relative_file_paths": list(info.files),
        "files": [
            {
                "path": name,
                "starting_time": {"nanoseconds_since_epoch": start},
                "duration": {"nanoseconds": end - start},
                "message_count": count,
            }
            for name, (start, end, count) in zip(info.files, ranges, strict=True)
        ],
        "custom_data": dict(info.custom_data) or None,
        "ros_distro": info.ros_distro,
    }


def to_yaml(info: BagInfo) -> str:
    """Return what MCAP files hold as `serialized_metadata`."""
    return _dump(to_data(info)).strip()


def parse(text: str) -> BagInfo | None:
    """Read what an MCAP file holds as `serialized_metadata`; None if it cannot be read."""
    try:
        return _info(yaml.load(text, Loader=_LOADER))
    except (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError):
        return None


def write(folder: Path, info: BagInfo) -> None:
    """Write `metadata.yaml`; a reader sees the old one or the whole new one.

    Raises:
        RecordingError: it cannot be written.
    """
    new = folder / f".{FILE}"
    try:
        new.write_text(_dump({_ROOT: to_data(info)}), encoding="utf-8")
        new.replace(folder / FILE)
    except OSError as fault:
        raise RecordingError(f"{folder / FILE}: cannot be written: {fault.strerror}") from fault


def read(folder: Path) -> BagInfo:
    """Read `metadata.yaml` of any version.

    Raises:
        RecordingError: it is not one.
    """
    path = folder / FILE
    try:
        root = yaml.load(read_text(path), Loader=_LOADER)[_ROOT]
        return _info(root)
    except OSError as fault:
        raise RecordingError(f"{path}: cannot be read: {fault.strerror}") from fault
    except (yaml.YAMLError, UnicodeDecodeError) as fault:
        raise RecordingError(f"{path}: is not YAML: {' '.join(str(fault).split())}") from fault
    except (KeyError, TypeError, ValueError, AttributeError) as fault:
        what = f"{fault} is missing" if isinstance(fault, KeyError) else "a value is of another kind"
        raise RecordingError(f"{path}: is not the metadata of a ROS 2 bag: {what}") from fault


_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def _info(root: dict[str, Any]) -> BagInfo:
    start = int(root["starting_time"]["nanoseconds_since_epoch"])
    files = tuple(Path(name).name for name in root["relative_file_paths"])
    ranges = tuple(_range(item) for item in root.get("files") or ())
    mode = str(root.get("compression_mode") or "").lower()
    return BagInfo(
        storage=str(root["storage_identifier"]),
        files=files,
        start_ns=start,
        end_ns=start + int(root["duration"]["nanoseconds"]),
        topics=tuple(map(_topic, root["topics_with_message_count"])),
        file_ranges=ranges if len(ranges) == len(files) else (),
        compression_format=str(root.get("compression_format") or ""),
        compression_mode="" if mode == "none" else mode,
        custom_data={str(k): str(v) for k, v in (root.get("custom_data") or {}).items()},
        ros_distro=str(root.get("ros_distro") or ""),
        version=int(root["version"]),
    )


def _range(item: dict[str, Any]) -> tuple[int, int, int]:
    start = int(item["starting_time"]["nanoseconds_since_epoch"])
    return start, start + int(item["duration"]["nanoseconds"]), int(item["message_count"])


def _topic(item: dict[str, Any]) -> BagTopic:
    topic = item["topic_metadata"]
    return BagTopic(
        name=str(topic["name"]),
        type=str(topic["type"]),
        serialization_format=str(topic["serialization_format"]),
        qos=offered_qos.parse(topic.get("offered_qos_profiles")),
        type_hash=str(topic.get("type_description_hash") or ""),
        count=int(item["message_count"]),
    )


def _dump(data: Any) -> str:
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=False)
