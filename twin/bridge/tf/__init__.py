"""tf as in tf2 and tf2_ros: a buffer, broadcasters, a listener, and their errors."""

from __future__ import annotations

from twin.bridge.tf.broadcasting import StaticTransformBroadcaster as StaticTransformBroadcaster
from twin.bridge.tf.broadcasting import TransformBroadcaster as TransformBroadcaster
from twin.bridge.tf.broadcasting import TransformListener as TransformListener
from twin.bridge.tf.broadcasting import transform_stamped as transform_stamped
from twin.bridge.tf.buffer import TransformBuffer as TransformBuffer
from twin.bridge.tf.buffer import TransformFuture as TransformFuture
from twin.bridge.tf.errors import DisconnectedFramesError as DisconnectedFramesError
from twin.bridge.tf.errors import ExtrapolationError as ExtrapolationError
from twin.bridge.tf.errors import InvalidFrameError as InvalidFrameError
from twin.bridge.tf.errors import TransformError as TransformError
from twin.bridge.tf.errors import TransformTimeoutError as TransformTimeoutError
from twin.bridge.tf.errors import UnknownFrameError as UnknownFrameError

# The names that programs for tf2_ros use.
Buffer = TransformBuffer
TransformException = TransformError
LookupException = UnknownFrameError
ConnectivityException = DisconnectedFramesError
ExtrapolationException = ExtrapolationError
InvalidArgumentException = InvalidFrameError
TimeoutException = TransformTimeoutError
