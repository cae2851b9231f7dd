"""Camera pictures as JPEG."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from twin.bridge.msgs import CompressedImage, Image
from twin.errors import BridgeError

IMAGE, COMPRESSED = Image.__msgtype__, CompressedImage.__msgtype__
_QUALITY = 80
_LARGEST_PX = 8192
_MOST_PIXELS = 50_000_000
_RAW = {
    "mono8": ("L", "L", 1), "8UC1": ("L", "L", 1), "rgb8": ("RGB", "RGB", 3), "8UC3": ("RGB", "BGR", 3),
    "bgr8": ("RGB", "BGR", 3), "rgba8": ("RGB", "RGBX", 4), "bgra8": ("RGB", "BGRX", 4),
}  # fmt: skip
"""Pillow's mode, the order of a pixel's bytes, and how many they are, by encoding."""


class NoPictureError(BridgeError):
    """A message that cannot be shown."""


@dataclass(frozen=True)
class Wish:
    """How a client wants pictures: quality 1 to 100, size in pixels; None: as they are."""

    quality: int | None = None
    width: int | None = None
    height: int | None = None

    @classmethod
    def of(cls, query: Mapping[str, str]) -> Wish:
        """Read the parameters that web_video_server has, too.

        Raises:
            BridgeError: a number that is none, or out of range.
        """
        return cls(
            _whole(query, "quality", 100),
            _whole(query, "width", _LARGEST_PX),
            _whole(query, "height", _LARGEST_PX),
        )


def jpeg_of(message: Any, wish: Wish) -> bytes:
    """Return an Image or a CompressedImage as a JPEG file; one that is as it is wished for stays as it is.

    Raises:
        NoPictureError: no picture that can be shown.
    """
    from PIL import Image as Pillow

    try:
        if message.__msgtype__ == COMPRESSED:
            data = message.data.tobytes()
            if wish == Wish() and data.startswith(b"\xff\xd8"):
                return data
            picture: Any = Pillow.open(BytesIO(data), formats=("JPEG", "PNG", "WEBP"))
        else:
            if message.encoding not in _RAW:
                raise NoPictureError(f"{message.encoding[:40]!r} is not shown; valid: {', '.join(_RAW)}")
            mode, order, size = _RAW[message.encoding]
            if message.step < message.width * size or len(message.data) < message.step * message.height:
                raise NoPictureError("the picture has fewer bytes than it says")
            shape = (message.width, message.height)
            picture = Pillow.frombuffer(mode, shape, message.data.tobytes(), "raw", order, message.step, 1)
        if not 0 < picture.width * picture.height <= _MOST_PIXELS:
            raise NoPictureError(f"a picture of {picture.width} x {picture.height} pixels is not shown")
        if wish.width or wish.height:
            aspect = picture.width / picture.height
            width = wish.width or max(1, round((wish.height or 1) * aspect))
            picture = picture.resize((width, wish.height or max(1, round(width / aspect))))
        file = BytesIO()
        picture.convert("L" if picture.mode == "L" else "RGB").save(
            file, "jpeg", quality=wish.quality or _QUALITY
        )
    except (OSError, ValueError, Pillow.DecompressionBombError) as error:
        raise NoPictureError(f"the picture cannot be shown: {error}") from None
    return file.getvalue()


def _whole(query: Mapping[str, str], name: str, most: int) -> int | None:
    text = query.get(name)
    if text is None:
        return None
    if not text.isascii() or not text.isdigit() or not 1 <= int(text[:9]) <= most:
        raise BridgeError(f"{name}={text[:20]} is not valid; valid: 1 to {most}")
    return int(text)
