"""What becomes of a command, a stop or a release."""

from __future__ import annotations

from enum import StrEnum


class Verdict(StrEnum):
    """Accepted, or why not; as acknowledgements spell it."""

    ACCEPTED = "accepted"
    NOT_STAMPED = "not stamped"
    DUPLICATE = "duplicate"
    """Its sender has sent a command with this stamp."""
    OUT_OF_ORDER = "out of order"
    """Its sender has sent a later command, or its clock was set back."""
    OLD = "old"
    """It was under way for longer than its sender's commands are; a release: nobody sees that stop now."""
    NOT_FINITE = "not finite"
    STOPPED = "stopped"
    """The emergency stop holds."""
    OVERRIDDEN = "overridden"
    """The operator commands."""
    RIVAL = "rival"
    """Another sender commands in the same way."""
