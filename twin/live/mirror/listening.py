"""What a mirror of another process tells, or has told."""

from __future__ import annotations

from pathlib import Path

from twin.bridge.bags.reader import BagReader
from twin.bridge.cdr.codec import codec
from twin.bridge.graph import Graph
from twin.bridge.live import LiveBus
from twin.bridge.msgs import DiagnosticArray
from twin.errors import NobodyAnswersError, RecordingError
from twin.live.mirror.status import Status

_TOPIC = "/diagnostics"
_BEFORE_NS = 1_000_000_000
"""A status is so old, at most."""
_PATIENCE_S = 20.0
"""One that is about to start is waited for."""


def heard_statuses(process: LiveBus) -> list[Status]:
    """Return how each robot is mirrored, as a mirror on the graph tells next.

    Raises:
        NobodyAnswersError: There is none.
    """
    found: list[Status] = []

    def on_diagnostics(message: DiagnosticArray) -> None:
        found.extend(_statuses(message))

    process.bus.create_node("mirror_status").create_subscription(DiagnosticArray, _TOPIC, on_diagnostics, 10)
    Graph.whole(process.bus)  # whoever begins is waited for
    if not process.spin(lambda: bool(found), _PATIENCE_S):
        raise NobodyAnswersError(
            f"no mirror has told of itself in {_PATIENCE_S:g} s; is `twin mirror` running?"
        )
    return found


def past_statuses(bag: Path, at_s: float) -> list[Status]:
    """Return how each robot was mirrored at a time of a mirror's bag [s] after its beginning.

    Raises:
        RecordingError: The bag cannot be read, is not one of a mirror, or has nothing of that time.
    """
    with BagReader(bag) as reader:
        if _TOPIC not in reader.topics:
            raise RecordingError(
                f"{bag}: no mirror has told of itself there; `twin mirror --record` writes one"
            )
        read, found = codec(DiagnosticArray), list[Status]()
        end_ns = reader.info.start_ns + round(at_s * 1e9)
        for message in reader.messages([_TOPIC], max(0, end_ns - _BEFORE_NS), end_ns):
            found = _statuses(read.decode(message.data)) or found
        length_s = (reader.info.end_ns - reader.info.start_ns) * 1e-9
    if not found or at_s > length_s:
        raise RecordingError(
            f"{bag}: no mirror told of itself at {at_s:g} s; the bag is {length_s:.1f} s long"
        )
    return found


def _statuses(message: DiagnosticArray) -> list[Status]:
    told = [Status.from_message(entry) for entry in message.status]
    return [status for status in told if status is not None]
