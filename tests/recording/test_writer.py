"""The writer's thread: the run goes on meanwhile, waits if it must, and hears what went wrong."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from twin.errors import RecordingError
from twin.recording.writer import Rows, Writer


class Numbers(Rows[int]):
    """Each block becomes one chunk."""

    def chunks(self, rows: list[int]) -> list[Any]:
        return [("/numbers", [], rows)]


class Disk:
    """Stands in for a recording on a disk that takes a block only when told to."""

    def __init__(self) -> None:
        self.blocks: list[list[int]] = []
        self.flushed = 0
        self.ready = threading.Semaphore(0)
        self.fault: Exception | None = None

    def send_columns(self, entity: str, index: list[Any], rows: list[int]) -> None:
        self.blocks.append(rows)

    def flush(self) -> None:
        self.ready.acquire()
        self.flushed += 1
        if self.fault is not None:
            raise self.fault


@pytest.fixture
def disk() -> Iterator[Disk]:
    disk = Disk()
    yield disk
    disk.ready.release(100)  # whatever waits


def test_a_run_goes_on_while_a_block_is_written(disk: Disk) -> None:
    numbers, writer = Numbers(), Writer(disk, disk.flush)  # type: ignore[arg-type]
    numbers.rows.append(1)
    writer.write([numbers])  # the disk has not even begun
    numbers.rows.append(2)
    disk.ready.release()
    writer.wait()
    assert (disk.blocks, numbers.rows) == ([[1]], [2])
    disk.ready.release()
    writer.write([numbers])
    writer.close()
    assert disk.blocks == [[1], [2]]


def test_a_run_waits_for_a_slow_disk_and_loses_nothing(disk: Disk) -> None:
    numbers, writer = Numbers(), Writer(disk, disk.flush)  # type: ignore[arg-type]
    waiting = threading.Semaphore(0)

    def spin() -> None:
        for _ in range(3):
            waiting.acquire()
            disk.ready.release()

    threading.Thread(target=spin).start()
    for number in range(3):
        numbers.rows.append(number)
        if number:
            waiting.release()  # only now the disk takes the block before
        writer.write([numbers])
        assert disk.flushed >= number
    waiting.release(2)
    writer.wait()
    assert disk.flushed == 3
    assert disk.blocks == [[0], [1], [2]]


def test_what_went_wrong_is_told_to_the_run_once(disk: Disk) -> None:
    numbers, writer = Numbers(), Writer(disk, disk.flush)  # type: ignore[arg-type]
    disk.fault = RecordingError("a.rrd: the recording could not be written to its end; is the disk full?")
    disk.ready.release()
    writer.write([numbers])
    with pytest.raises(RecordingError, match="is the disk full"):
        writer.write([numbers])
    writer.wait()
    writer.close()
