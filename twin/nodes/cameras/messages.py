"""What a camera sees as messages; an image is rows from the top, pixels from the left."""

from __future__ import annotations

from functools import lru_cache
from io import BytesIO
from struct import pack
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.bridge.msgs import CameraInfo, CompressedImage, Header, Image, PointCloud2, PointField, new
from twin.models.lens import Lens
from twin.models.wide_lens import WideLens

_QUALITY = 80
"""Of JPEG pictures, as image_transport's default."""
_MOST = 65535
"""In 16 bits."""
_DEPTH_MAX, _DEPTH_QUANTIZATION = np.float32(10.0), np.float32(100.0)
"""[m], and where the step of what is quantised doubles; both are image_transport's defaults."""
_QUANT_A = _DEPTH_QUANTIZATION * (_DEPTH_QUANTIZATION + np.float32(1.0))
_QUANT_B = np.float32(1.0) - _QUANT_A / _DEPTH_MAX
_INVERSE_DEPTH = 0
_XYZ = ("x", "y", "z")
_PIXELS = {"mono8": ("u1", 1), "rgb8": ("u1", 3), "bgr8": ("u1", 3), "16UC1": ("u2", 1), "32FC1": ("f4", 1)}
"""Type of a number, and how many are in a pixel."""


def image(header: Header, pixels: NDArray[Any], encoding: str) -> Image:
    """Return an image of pixels, shape (height, width) or (height, width, channels)."""
    height, width = pixels.shape[:2]
    return Image(
        header=header,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=pixels[0].nbytes,
        data=_bytes(pixels),
    )


def pixels(message: Image) -> NDArray[Any] | None:
    """Return an image's numbers, shape (height, width) or (height, width, 3); None if it has none that fit.

    It may be of another encoding, of size 0, or cut off.
    """
    kind, channels = _PIXELS.get(message.encoding, ("", 0))
    size = message.height, message.width
    if not channels or not all(size):
        return None
    number = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    wide = message.width * channels * number.itemsize
    if message.step < wide or len(message.data) < message.step * message.height:
        return None
    rows = np.asarray(message.data)[: message.step * message.height].reshape(message.height, message.step)
    numbers = np.ascontiguousarray(rows[:, :wide]).view(number)
    return numbers.reshape(*size, channels) if channels > 1 else numbers


def metres(message: Image) -> NDArray[np.float32] | None:
    """Return depths [m], nan where there are none, shape (height, width); None if it is no such image."""
    numbers = pixels(message)
    if numbers is None or message.encoding not in ("32FC1", "16UC1"):
        return None
    z = numbers.astype(np.float32)
    if message.encoding == "16UC1":
        z[z == 0.0] = np.nan
        z *= np.float32(1e-3)
    return z


def depth_image(header: Header, z: NDArray[np.float32], encoding: str) -> Image:
    """Return depths [m], nan where there are none, as `32FC1`, or as `16UC1`: millimetres, or 0 (REP-118)."""
    if encoding == "32FC1":
        return image(header, z, encoding)
    millimetres = np.rint(np.nan_to_num(z, nan=0.0) * 1e3)
    millimetres[millimetres > _MOST] = 0.0
    return image(header, millimetres.astype(np.uint16), encoding)


def compressed_depth(header: Header, depths: Image) -> CompressedImage:
    """Return a depth image as compressed_depth_image_transport packs it: 12 bytes, then a PNG of 16 bits.

    Both end at 10 m. Millimetres stay what they are. Of metres the PNG holds a / z + b, where the 12 bytes
    say a and b: steps of z² / 10100 m, and 0 nearer than 0.152 m, as 16 bits hold no more.
    """
    from PIL import Image as Pillow

    if depths.encoding == "32FC1":
        parameters = _QUANT_A, _QUANT_B
        z = depths.data.view(np.float32)
        levels = np.zeros(z.shape, np.float32)
        seen = (z > 0.0) & (z < _DEPTH_MAX)
        levels[seen] = _QUANT_A / z[seen] + _QUANT_B
    else:
        parameters = np.float32(0.0), np.float32(0.0)
        levels = depths.data.view(np.uint16).astype(np.float32)
        levels[levels > 1e3 * _DEPTH_MAX] = 0.0
    levels[levels > _MOST] = 0.0
    values = levels.astype(np.uint16).reshape(depths.height, depths.width)
    file = BytesIO()
    file.write(pack("<iff", _INVERSE_DEPTH, *parameters))
    Pillow.fromarray(values).save(file, "png", compress_level=1)
    return CompressedImage(
        header=header,
        format=f"{depths.encoding}; compressedDepth png",
        data=np.frombuffer(file.getvalue(), np.uint8),
    )


def jpeg(header: Header, pixels: NDArray[np.uint8], encoding: str) -> CompressedImage:
    """Return an image as JPEG, called as image_transport calls it."""
    from PIL import Image as Pillow

    grey = encoding == "mono8"
    file = BytesIO()
    Pillow.fromarray(pixels if grey else rgb(pixels, encoding)).save(file, "jpeg", quality=_QUALITY)
    return CompressedImage(
        header=header,
        format=f"{encoding}; jpeg compressed {'mono8' if grey else 'bgr8'}",
        data=np.frombuffer(file.getvalue(), np.uint8),
    )


def rgb(pixels: NDArray[np.uint8], encoding: str) -> NDArray[np.uint8]:
    """Return pixels of an encoding as red, green and blue, shape (height, width, 3)."""
    if encoding == "mono8":
        return np.repeat(pixels[..., None], 3, axis=-1)
    return pixels[..., ::-1] if encoding == "bgr8" else pixels


def camera_info(header: Header, lens: Lens | WideLens, baseline: float = 0.0) -> CameraInfo:
    """Return how a camera projects (REP-104).

    Args:
        header: Of the image.
        lens: Through which it was taken.
        baseline: How far it is to the right of the left camera of a stereo pair [m].
    """
    info = new(CameraInfo)
    info.header, info.height, info.width = header, lens.height, lens.width
    info.distortion_model, distortion = lens.model
    info.d = np.array(distortion)
    info.k, info.r = lens.matrix.ravel(), np.eye(3).ravel()
    info.p = np.hstack((lens.matrix, np.zeros((3, 1)))).ravel()
    info.p[3] = -info.p[0] * baseline
    return info


def cloud(
    header: Header, lens: Lens | WideLens, z: NDArray[np.float32], rgb: NDArray[np.uint8] | None = None
) -> PointCloud2:
    """Return a point for each pixel, row by row, nan where there is no depth; in the optical frame.

    Args:
        header: Of the image.
        lens: Through which it was taken.
        z: Depths [m], shape (height, width).
        rgb: Colours of the same pixels, shape (height, width, 3).
    """
    names = _XYZ if rgb is None else (*_XYZ, "rgb")
    points = np.empty((*z.shape, len(names)), np.float32)
    points[..., :2] = rays(lens) * z[..., None]
    points[..., 2] = z
    points[np.isnan(z), :3] = np.nan
    if rgb is not None:
        red, green, blue = (rgb[..., i].astype(np.uint32) for i in range(3))
        points[..., 3] = (red << 16 | green << 8 | blue).view(np.float32)
    height, width = z.shape
    step = points[0, 0].nbytes
    return PointCloud2(
        header=header,
        height=height,
        width=width,
        fields=[PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate(names)],
        is_bigendian=False,
        point_step=step,
        row_step=width * step,
        data=_bytes(points),
        is_dense=bool(np.isfinite(z).all()),
    )


@lru_cache(maxsize=16)
def rays(lens: Lens | WideLens) -> NDArray[np.float32]:
    """Return the x and y on the plane z = 1 of what each pixel sees, shape (height, width, 2)."""
    return lens.rays().astype(np.float32)


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    data = np.ascontiguousarray(values).reshape(-1).view(np.uint8)
    data.flags.writeable = False
    return data
