"""Pictures as a stream of H.264, a tenth as large as JPEG, by PyAV (an extra: its wheels bring x264, GPL)."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.errors import RecordingError
from twin.recording.columns import Component

if TYPE_CHECKING:
    from collections.abc import Sequence

    from twin.recording.columns import Column

_SAMPLE, _IS_KEYFRAME = (Component(rr.VideoStream, name) for name in ("sample", "is_keyframe"))
_KEY_NS = 1_000_000_000
"""Between two frames that need none before them, at most, if there are so many."""
_OPTIONS = {
    "preset": "veryfast",
    "tune": "zerolatency",  # a frame is out before the next one is in
    "crf": "23",
    "forced-idr": "1",
    "x264-params": "scenecut=0:keyint=infinite",  # keyframes are where we say
}


def check_installed() -> None:
    """See that frames can be encoded.

    Raises:
        RecordingError: PyAV is not installed.
    """
    try:
        import av  # noqa: F401
    except ImportError:
        raise RecordingError(
            "recording.images h264 needs PyAV, which is not installed: pip install 'twin[video]'"
        ) from None


class Frame(NamedTuple):
    """One encoded picture."""

    time_ns: int
    sample: NDArray[np.uint8]
    """Annex B's bytes."""
    is_keyframe: bool
    """Whether it needs no frame before it."""


class Video:
    """One stream of pictures of one size; others have no place in it.

    No frame refers to a later one. It is encoded in one thread, so that it is the same from run to run.
    """

    codec = rr.VideoCodec.H264

    def __init__(self) -> None:
        self._encoder: Any = None
        self._size = (0, 0)
        self._key_ns = 0
        self._count = 0

    def frames(self, times_ns: Sequence[int], files: Sequence[NDArray[np.uint8]]) -> Iterator[Frame]:
        """Yield the frames of JPEG or PNG pictures; what is no picture, or of another size, is left out."""
        for time_ns, file in zip(times_ns, files, strict=True):
            pixels = _pixels(file)
            if pixels is not None and (self._encoder is None or pixels.shape[:2] == self._size):
                yield self._frame(time_ns, pixels)

    def _frame(self, time_ns: int, pixels: NDArray[np.uint8]) -> Frame:
        import av
        from av.video.frame import PictureType

        self._size = pixels.shape[0], pixels.shape[1]
        if self._encoder is None:
            self._encoder = _encoder(*self._size)
            self._key_ns = time_ns
        frame = av.VideoFrame.from_ndarray(_even(pixels), format="rgb24").reformat(format="yuv420p")
        frame.pts, self._count = self._count, self._count + 1
        frame.pict_type = PictureType.P
        if time_ns >= self._key_ns:
            frame.pict_type, self._key_ns = PictureType.I, time_ns + _KEY_NS
        (packet,) = self._encoder.encode(frame)
        return Frame(time_ns, np.frombuffer(bytes(packet), np.uint8), packet.is_keyframe)


def columns(frames: Sequence[Frame]) -> tuple[Column, ...]:
    """Return frames as Rerun has them, a row for each."""
    return (
        _SAMPLE.column([frame.sample for frame in frames]),
        _IS_KEYFRAME.column([frame.is_keyframe for frame in frames]),
    )


def _encoder(height: int, width: int) -> Any:
    from fractions import Fraction

    import av

    encoder = av.CodecContext.create("libx264", "w")
    encoder.width, encoder.height = width + width % 2, height + height % 2
    encoder.pix_fmt, encoder.time_base = "yuv420p", Fraction(1, 30)  # Rerun has the times
    encoder.thread_count, encoder.max_b_frames = 1, 0
    encoder.options = _OPTIONS
    return encoder


def _pixels(file: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """Return red, green and blue of a picture, shape (height, width, 3)."""
    from PIL import Image

    try:
        return np.asarray(Image.open(BytesIO(file.tobytes())).convert("RGB"))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):  # from outside may come anything
        return None


def _even(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture with an even number of rows and columns, as colours are stored for two by two."""
    height, width = pixels.shape[:2]
    return np.pad(pixels, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
