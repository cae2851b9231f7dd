"""Bags read back as numpy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.bridge.bags.definitions import learn
from twin.bridge.bags.reader import BagReader
from twin.bridge.cdr.codec import codec
from twin.bridge.types import get
from twin.errors import BridgeError, RecordingError

if TYPE_CHECKING:
    import pyarrow as pa  # type: ignore[import-untyped]


class Message(NamedTuple):
    """A message of a bag."""

    topic: str
    time_ns: int
    """When it was received [ns]."""
    message: Any
    """Of the class in `twin.msgs`; arrays are numpy's and read-only."""


class Bag(Mapping[str, Mapping[str, NDArray[Any]]]):
    """A bag: `bag["/odom"]["pose.pose.position.x"]` is an array, `bag.messages()` yields the messages."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with BagReader(path) as reader:
            self._topics = reader.topics
            self.types: Mapping[str, str] = {name: topic.type for name, topic in reader.topics.items()}
            """Type of each topic."""
            self.notices = reader.notices
            """What is not as it should be, such as an end that is cut off; one sentence each."""

    def __getitem__(self, topic: str) -> Mapping[str, NDArray[Any]]:
        """Return a topic's columns, each with a row per message.

        `time_ns` is when it was received [ns], int64; all others are named after fields, as
        `header.stamp`, which is in [ns] as all times are. Arrays of equal length are one array, shape
        (n, length); of others, of texts and of nested messages each row is an object.

        Raises:
            RecordingError: The bag has no such topic, or its type cannot be told.
        """
        messages = list(self.messages(topic))
        from twin.api.bag_tables import leaves

        found = {"time_ns": np.array([message.time_ns for message in messages], dtype=np.int64)}
        for leaf in leaves(self.types[topic]):
            found[leaf.name] = _array([leaf.read(each.message) for each in messages])
        return found

    def table(self, topic: str, fields: Iterable[str] | None = None) -> pa.Table:
        """Return a topic as an Arrow table, of which `to_pandas()` and `polars.from_arrow` make frames.

        Columns are `time`, when each message was received [s], and its fields, by names such as
        `twist.twist.linear.x`, times in [ns]. Arrays of a fixed length are fixed-size lists, others lists.
        Each field's unit, where it is known, is `table.schema.field(name).metadata[b"unit"]`.

        Args:
            topic: Of the bag.
            fields: Which to read, `twist.twist` with all in it; None: all.

        Raises:
            RecordingError: As of `bag[topic]`; or the type has no such field.
        """
        from twin.api.bag_tables import table

        messages = list(self.messages(topic))
        times = [message.time_ns for message in messages]
        return table(self.types[topic], times, [message.message for message in messages], fields)

    def __iter__(self) -> Iterator[str]:
        return iter(self.types)

    def __len__(self) -> int:
        return len(self.types)

    def messages(self, *topics: str) -> Iterator[Message]:
        """Yield messages in the order of their times; without topics those of all.

        Raises:
            RecordingError: The bag has no such topic, its type cannot be told, or it is damaged.
        """
        with BagReader(self.path) as reader:
            decoders: dict[str, Callable[[bytes], Any]] = {}
            for topic, payload, log_ns, *_ in reader.messages(topics or None):
                if topic not in decoders:
                    decoders[topic] = self._decoder(topic)
                try:
                    message = decoders[topic](payload)
                except Exception as fault:  # rosbags raises many kinds on damaged payloads
                    words = f"at {log_ns} ns is no {self.types[topic]}: {fault}"
                    raise RecordingError(f"{self.path}: the message on {topic} {words}") from fault
                yield Message(topic, log_ns, message)

    def _decoder(self, topic: str) -> Callable[[bytes], Any]:
        known = self._topics[topic]
        try:
            if known.definition and known.definition_format == "ros2msg":
                learn(known.type, known.definition)
            return codec(get(known.type)).decode
        except BridgeError as fault:
            raise RecordingError(f"{self.path}: {topic} cannot be decoded: {fault}") from fault


def read_bag(path: str | Path) -> Bag:
    """Open a bag: ROS 2's (MCAP, SQLite, split, compressed, cut off by a crash) and ROS 1's.

    Args:
        path: A bag's folder, or a file (.mcap, .db3, .bag).

    Raises:
        RecordingError: It is no bag.
    """
    return Bag(Path(path))


def _array(rows: list[Any]) -> NDArray[Any]:
    is_regular = all(isinstance(row, np.ndarray | int | float | bool) for row in rows)
    if is_regular and len({np.shape(row) for row in rows}) <= 1:
        return np.array(rows)
    found = np.empty(len(rows), dtype=object)
    found[:] = rows
    return found
