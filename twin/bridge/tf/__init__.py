"""tf as in tf2 and tf2_ros: a buffer, broadcasters, a listener, and their errors."""

from __future__ import annotations

from twin.bridge.tf.broadcasting import (
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
    transform_stamped,
)
from twin.bridge.tf.buffer import TransformBuffer
from twin.bridge.tf.errors import (
    DisconnectedFramesError,
    ExtrapolationError,
    InvalidFrameError,
    TransformError,
    TransformTimeoutError,
    UnknownFrameError,
)
from twin.bridge.tf.wait import TransformFuture

__all__ = [
    "Buffer",
    "ConnectivityException",
    "DisconnectedFramesError",
    "ExtrapolationError",
    "ExtrapolationException",
    "InvalidArgumentException",
    "InvalidFrameError",
    "LookupException",
    "StaticTransformBroadcaster",
    "TimeoutException",
    "TransformBroadcaster",
    "TransformBuffer",
    "TransformError",
    "TransformException",
    "TransformFuture",
    "TransformListener",
    "TransformTimeoutError",
    "UnknownFrameError",
    "transform_stamped",
]

# The names that programs for tf2_ros use.
Buffer = TransformBuffer
TransformException = TransformError
LookupException = UnknownFrameError
ConnectivityException = DisconnectedFramesError
ExtrapolationException = ExtrapolationError
InvalidArgumentException = InvalidFrameError
TimeoutException = TransformTimeoutError
