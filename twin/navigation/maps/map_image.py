"""Map images as grey levels, PGM by hand, PNG, BMP and others through pillow; and these as occupancy.

With the exact rules of nav2_map_server (map_io.cpp).
"""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twin.errors import MapError, Problem
from twin.files.reading import read_bytes
from twin.navigation.maps.map_yaml import MapMetadata, read_metadata
from twin.navigation.maps.occupancy_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap

_HEADER = re.compile(rb"P[25]" + 3 * rb"(?:\s|#[^\n]*\n)*+(\d++)")
"""Of a PGM: white space and comments stand between numbers."""


def read_image(path: Path) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """Return the grey levels 0..255, shape (h, w), row 0 on top, and the alpha channel if there is one.

    Raises:
        MapError: the file is no image, or its format needs pillow and pillow is missing.
    """
    content = read_bytes(path)
    if content[:2] in (b"P5", b"P2"):
        return _read_pgm(path, content), None
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError as error:
        message = f"{path.suffix or 'this'} images need pillow; valid is `pip install pillow` or a PGM image"
        raise MapError(Problem(message, path)) from error
    try:
        with Image.open(io.BytesIO(content)) as image:
            has_alpha = "A" in image.getbands() or "transparency" in image.info
            if image.mode.startswith(("I", "F")):  # 16 bits per pixel, which pillow does not scale by itself
                levels = np.clip(np.asarray(image, dtype=np.float64), 0, 65535)
                return np.rint(levels / 257.0).astype(np.uint8), None
            rgba = np.asarray(image.convert("RGBA"))
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
        raise MapError(Problem("the file is not an image; valid is PGM, PNG or BMP", path)) from error
    return _luma(rgba), rgba[..., 3] if has_alpha else None


def write_image(path: Path, gray: NDArray[np.uint8], alpha: NDArray[np.uint8] | None = None) -> None:
    """Write grey levels, shape (h, w), row 0 on top, as the suffix says: .pgm, .png or .bmp.

    Transparency needs .png, and makes it RGBA, as nav2's saver does.
    """
    if path.suffix.lower() == ".pgm":
        height, width = gray.shape
        path.write_bytes(b"P5\n%d %d\n255\n" % (width, height) + gray.tobytes())
        return
    from PIL import Image

    pixels = gray if alpha is None else np.stack([gray, gray, gray, alpha], axis=-1)
    Image.fromarray(np.ascontiguousarray(pixels)).save(path)


def _luma(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return grey levels as GraphicsMagick, with which Nav2 reads images, weighs colours (PixelIntensity)."""
    red, green, blue = (rgba[..., k].astype(np.uint32) * 257 for k in range(3))
    return np.rint(((306 * red + 601 * green + 117 * blue) >> 10) / 257.0).astype(np.uint8)


def _read_pgm(path: Path, content: bytes) -> NDArray[np.uint8]:
    """Decode PGM (netpbm): magic, width, height, maxval with white space and comments between, samples."""
    (width, height, maxval), offset = _read_header(path, content)
    count = width * height
    if content[:2] == b"P2":
        words = [line.split(b"#", 1)[0] for line in content[offset:].splitlines()]
        try:
            samples = np.array(b" ".join(words).split(), dtype=np.int64)
        except ValueError as error:
            raise MapError(Problem("the samples of the PGM are not all numbers", path)) from error
    else:
        dtype = np.dtype(">u2") if maxval > 255 else np.dtype(np.uint8)
        body = content[offset:]
        samples = np.frombuffer(body[: len(body) // dtype.itemsize * dtype.itemsize], dtype=dtype)
    if samples.size < count:
        message = f"the PGM has {samples.size} samples; valid is {count} ({width} x {height} by its header)"
        raise MapError(Problem(message, path))
    levels = np.clip(samples[:count].reshape(height, width), 0, maxval)
    if maxval == 255:
        return levels.astype(np.uint8)
    return np.rint(levels * (255.0 / maxval)).astype(np.uint8)


def _read_header(path: Path, content: bytes) -> tuple[tuple[int, int, int], int]:
    found = _HEADER.match(content)
    width, height, maxval = map(int, found.groups()) if found else (0, 0, 0)
    if found is None or width < 1 or height < 1 or not 1 <= maxval <= 65535:
        message = "the PGM header is broken; valid is P5 or P2, width, height and maxval (1..65535)"
        raise MapError(Problem(message, path))
    return (width, height, maxval), found.end() + 1


def load_map(path: Path) -> OccupancyMap:
    """Read a map; `~` is the home folder.

    Raises:
        MapError: every fault of the YAML file at once, or that of the image.
    """
    return load_image(read_metadata(path.expanduser()))


def load_image(metadata: MapMetadata) -> OccupancyMap:
    """Read the image of a map whose YAML file is read.

    Raises:
        MapError: it is no image.
    """
    gray, alpha = read_image(metadata.image)
    data = occupancy_from_gray(gray, alpha, metadata)
    return OccupancyMap(data=data[::-1], resolution=metadata.resolution, origin=metadata.origin)


def occupancy_from_gray(
    gray: NDArray[np.uint8], alpha: NDArray[np.uint8] | None, metadata: MapMetadata
) -> NDArray[np.int8]:
    """Return the occupancy, shape (h, w), of an image of the same shape and row order.

    As Nav2 it computes in single precision, rounds halves up, and ignores `negate` and transparency of raw
    images. Source: nav2_map_server/src/map_io.cpp, loadMapFromFile.
    """
    if metadata.mode == "raw":
        return np.where(gray <= OCCUPIED, gray, UNKNOWN).astype(np.int8)
    # There are only 256 levels: a table of them is the whole rule.
    level = np.arange(256, dtype=np.float32) / np.float32(255.0)
    if not metadata.negate:
        level = np.float32(1.0) - level
    occupied_thresh, free_thresh = np.float32(metadata.occupied_thresh), np.float32(metadata.free_thresh)
    table = np.full(256, UNKNOWN, dtype=np.int8)
    if metadata.mode == "scale" and free_thresh < occupied_thresh:
        span = np.float32(metadata.occupied_thresh - metadata.free_thresh)
        scaled = (level - free_thresh) / span * np.float32(100.0)
        between = (level > free_thresh) & (level < occupied_thresh)
        table[between] = np.floor(scaled[between].astype(np.float64) + 0.5)
    table[level >= occupied_thresh] = OCCUPIED
    table[level <= free_thresh] = FREE
    data = table[gray]
    if alpha is not None:
        data[alpha < 255] = UNKNOWN
    return data
