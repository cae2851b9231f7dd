"""What a run puts aside for its recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from twin.recording.columns import Chunk

Row = TypeVar("Row")


class Rows(ABC, Generic[Row]):
    """Collects rows, and makes columns of a block of them at once."""

    def __init__(self) -> None:
        self.rows: list[Row] = []

    @abstractmethod
    def chunks(self, rows: list[Row]) -> Iterable[Chunk]:
        """Return a block of rows, in the order of time, as columns; there is at least one row."""

    def take_chunks(self) -> Iterable[Chunk]:
        """Return the rows as columns, and begin anew."""
        rows, self.rows = self.rows, []
        return self.chunks(rows) if rows else ()
