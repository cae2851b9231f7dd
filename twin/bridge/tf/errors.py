"""Why a transform is not available: tf2's classes of errors, in sentences that name who and when."""

from __future__ import annotations

from twin.errors import BridgeError


class TransformError(BridgeError, LookupError):
    """A transform is not available: tf2's TransformException."""


class UnknownFrameError(TransformError):
    """Nobody has published a frame, or the frames form a loop: tf2's LookupException."""


class DisconnectedFramesError(TransformError):
    """Two frames belong to different trees: tf2's ConnectivityException."""


class ExtrapolationError(TransformError):
    """The time asked for is outside of what was published: tf2's ExtrapolationException."""


class InvalidFrameError(TransformError):
    """A frame name that is empty or starts with '/': tf2's InvalidArgumentException."""


class TransformTimeoutError(TransformError):
    """A transform did not come in time: tf2's TimeoutException."""


def seconds(time_ns: int) -> str:
    """Return a time [ns] in seconds, exact, with at least three decimals.

    >>> seconds(1_500_000_000), seconds(-20_000)
    ('1.500', '-0.00002')
    """
    whole, rest = divmod(abs(time_ns), 1_000_000_000)
    decimals = f"{rest:09d}"
    return f"{'-' if time_ns < 0 else ''}{whole}.{decimals[:3]}{decimals[3:].rstrip('0')}"
