"""Messages as Arrow tables: a column for each field, with its unit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]

from twin.bridge import types
from twin.bridge.messages.units import unit_of
from twin.bridge.msgs import ns
from twin.bridge.types.fields import Field, fields_of
from twin.errors import RecordingError, nearest

TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""Types that are one number [ns] wherever messages are read back."""


class Leaf(NamedTuple):
    """A field that is no message, or several."""

    name: str
    """With its path, such as `twist.twist.linear.x`."""
    attribute: str
    """The same in Python."""
    field: Field
    unit: str

    def read(self, message: Any) -> Any:
        """Return its value; a time in [ns]."""
        value = attrgetter(self.attribute)(message)
        return ns(value) if self.field.message in TIMES and not self.field.many else value


def leaves(typename: str, places: Sequence[Leaf] = (), above: Sequence[str] = ()) -> Iterator[Leaf]:
    """Yield the fields of a message type, those of the messages in it included.

    Args:
        typename: `package/msg/Name`.
        places: Of the messages around it, outermost first.
        above: Their types.
    """
    around = [*above, typename]
    for field in fields_of(typename):
        path = [*(place.field.name for place in places), field.name]
        name = ".".join(path)
        attribute = ".".join([*(place.field.attribute for place in places), field.attribute])
        seen = [(each, ".".join(path[i:])) for i, each in enumerate(around)]
        if field.message and not field.many and field.message not in TIMES:
            yield from leaves(field.message, [*places, Leaf(name, attribute, field, "")], around)
        else:
            inner = [(field.message, "")] if field.message else []
            yield Leaf(name, attribute, field, unit_of([*seen, *inner]))


def table(
    typename: str, times_ns: Sequence[int], messages: Sequence[Any], fields: Iterable[str] | None
) -> pa.Table:
    """Return messages as a table: `time` [s] when they were received, then their fields.

    Args:
        typename: Of the messages.
        times_ns: When each was received [ns].
        messages: As many.
        fields: Which fields, `twist.twist.linear` with all in it; None: all.

    Raises:
        RecordingError: The type has no such field.
    """
    known = list(leaves(typename))
    chosen = known
    if fields is not None:
        chosen = [leaf for wanted in fields for leaf in _within(wanted, known, typename)]
    columns = [pa.array(np.asarray(times_ns, dtype=np.int64) * 1e-9)]
    schema = [pa.field("time", pa.float64(), metadata={"unit": "s"})]
    for leaf in chosen:
        column = _column(leaf.field, [leaf.read(message) for message in messages])
        columns.append(column)
        schema.append(pa.field(leaf.name, column.type, metadata={"unit": leaf.unit} if leaf.unit else None))
    return pa.Table.from_arrays(columns, schema=pa.schema(schema, metadata={"type": typename}))


def _within(wanted: str, known: list[Leaf], typename: str) -> list[Leaf]:
    found = [leaf for leaf in known if leaf.name == wanted or leaf.name.startswith(f"{wanted}.")]
    if not found:
        raise RecordingError(
            f"{typename} has no field '{wanted}'; {nearest(wanted, [leaf.name for leaf in known])}"
        )
    return found


def _column(field: Field, rows: list[Any]) -> pa.Array:
    if field.message in TIMES and not field.many:
        return pa.array(rows, pa.int64())
    item = _item_type(field)
    if field.message:  # several messages in each
        return pa.array([[_plain(each) for each in row] for row in rows], pa.list_(item))
    if field.many == "array" and not pa.types.is_string(item):
        flat = np.concatenate([np.asarray(row) for row in rows]) if rows else np.zeros(0)
        return pa.FixedSizeListArray.from_arrays(pa.array(flat, item), field.size)
    if field.many:
        return pa.array(rows, pa.list_(item))
    return pa.array(rows, item)


def _plain(message: Any) -> dict[str, Any]:
    """Return a message as Arrow takes it."""

    def value(field: Field) -> Any:
        given = getattr(message, field.attribute)
        if not field.message:
            return given
        return [_plain(each) for each in given] if field.many else _plain(given)

    return {field.name: value(field) for field in fields_of(message.__msgtype__)}


def _item_type(field: Field) -> pa.DataType:
    """Return the Arrow type of one value."""
    if field.message:
        return pa.struct([(each.name, _type(each)) for each in fields_of(field.message)])
    if field.base in ("string", "wstring"):
        return pa.string()
    return pa.from_numpy_dtype(types.dtype_of(field.base))


def _type(field: Field) -> pa.DataType:
    return pa.list_(_item_type(field)) if field.many else _item_type(field)
