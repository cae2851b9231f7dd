"""What a mirror of another process tells."""

from __future__ import annotations

from twin.bridge.live import LiveBus
from twin.bridge.msgs import DiagnosticArray
from twin.errors import NobodyAnswersError
from twin.live.mirror.status import Status

_PATIENCE_S = 5.0


def heard_statuses(process: LiveBus) -> list[Status]:
    """Return how each robot is mirrored, as a mirror on the graph tells next.

    Raises:
        NobodyAnswersError: There is none.
    """
    found: list[Status] = []

    def on_diagnostics(message: DiagnosticArray) -> None:
        told = [Status.from_message(entry) for entry in message.status]
        found.extend(status for status in told if status is not None)

    process.bus.create_node("mirror_status").create_subscription(
        DiagnosticArray, "/diagnostics", on_diagnostics, 10
    )
    if not process.spin(lambda: bool(found), _PATIENCE_S):
        raise NobodyAnswersError(
            f"no mirror has told of itself in {_PATIENCE_S:g} s; is `twin mirror` running?"
        )
    return found
