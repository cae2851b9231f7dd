"""Writes SQLite bags (.db3); what was flushed survives a crash.

Source of the tables: rosbag2_storage_sqlite3, sqlite_storage.cpp, schema version 4.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path

from zstandard import ZstdCompressor

from twin.bridge.bags import metadata
from twin.bridge.bags.compression import Compression
from twin.bridge.bags.metadata import BagInfo, BagMessage, BagTopic
from twin.bridge.bags.offered_qos import to_yaml
from twin.errors import RecordingError

_TABLES = """
PRAGMA journal_mode = WAL;
PRAGMA synchronous = NORMAL;
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
  serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL,
  type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
  encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
  data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""
_SCHEMA_VERSION = 4
_FLUSH_NS = 500_000_000


class SqliteWriter:
    """The database of a bag."""

    def __init__(self, folder: Path, how: Compression, ros_distro: str) -> None:
        """Create it.

        Raises:
            RecordingError: it cannot be written, or not compressed like that.
        """
        if how not in ("none", "zstd"):
            raise RecordingError(f"a bag of sqlite3 cannot be compressed with {how}; valid: none, zstd")
        self.file = f"{folder.resolve().name}_0.db3"
        self.compression_mode = "" if how == "none" else "MESSAGE"
        self._path = folder / self.file
        self._compress = ZstdCompressor().compress if how == "zstd" else bytes
        self._ids: dict[str, int] = {}
        self._types: set[str] = set()
        self._flushed_ns: int | None = None
        try:
            self._db = sqlite3.connect(self._path)
            self._db.executescript(_TABLES)
        except sqlite3.Error as fault:
            raise RecordingError(f"{self._path}: cannot be written: {fault}") from fault
        self._insert("schema", _SCHEMA_VERSION, ros_distro)

    def add_topic(self, topic: BagTopic) -> None:
        """Make a topic known."""
        if topic.type not in self._types and topic.definition:
            self._types.add(topic.type)
            self._insert(
                "message_definitions",
                None,
                topic.type,
                topic.definition_format,
                topic.definition,
                topic.type_hash,
            )
        self._ids[topic.name] = number = len(self._ids) + 1
        qos = to_yaml(topic.qos)
        self._insert(
            "topics", number, topic.name, topic.type, topic.serialization_format, qos, topic.type_hash
        )

    def write(self, message: BagMessage) -> None:
        """Append a message; its time of publishing has no place here."""
        if self._flushed_ns is None:
            self._flushed_ns = message.log_ns
        if message.log_ns - self._flushed_ns >= _FLUSH_NS:
            self.flush()
            self._flushed_ns = message.log_ns
        data = self._compress(message.data)
        self._insert("messages", None, self._ids[message.topic], message.log_ns, data)

    def attach(self, log_ns: int, name: str, media_type: str, data: bytes) -> None:
        """Do nothing: there is no place for it."""

    def flush(self) -> None:
        """Commit."""
        try:
            self._db.commit()
        except sqlite3.Error as fault:
            raise RecordingError(f"{self._path}: cannot be written: {fault}") from fault

    def close(self, info: BagInfo) -> None:
        """Write the metadata and close the database."""
        self._insert("metadata", 1, metadata.VERSION, metadata.to_yaml(info))
        self.flush()
        self._db.close()

    def leave(self) -> None:
        """Close the database without the metadata; what was not flushed is lost."""
        self._db.close()

    def _insert(self, table: str, *values: object) -> None:
        marks = ", ".join("?" * len(values))
        try:
            self._db.execute(f"INSERT INTO {table} VALUES ({marks})", values)
        except sqlite3.Error as fault:
            raise RecordingError(f"{self._path}: cannot be written: {fault}") from fault
