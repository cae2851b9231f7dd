"""LAS (ASPRS, 1.0 to 1.4), surveyors' format, by laspy; a point is whole tenths of a millimetre."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from types import ModuleType

import numpy as np

from twin.clouds.colours import COLOURS, channels, packed_colour
from twin.clouds.files.encodings import MOST_BYTES, Encoding, Source
from twin.clouds.points import Points, packed, scalar_fields
from twin.errors import CloudError

_SCALE = 1e-4
_FARTHEST = _SCALE * np.iinfo(np.int32).max
_PARTS = ("red", "green", "blue")


def parse_las(content: bytes, path: Path) -> Points:
    """Return the points of a file's content with all their dimensions; `path` is for messages.

    x, y and z are float64 in metres, as surveyors' coordinates need; colours become PCL's `rgb`.

    Raises:
        CloudError: It is no LAS file, is cut off, or laspy is not installed.
    """
    laspy, source = _laspy(), Source(content, path)
    if not content.startswith(b"LASF"):
        raise source.fault("does not begin with 'LASF', as every LAS file does")
    # laspy believes the header: what it promises is compared with what is there before anything is read.
    _check_records(source)
    try:
        with laspy.open(io.BytesIO(content)) as reader:
            header = reader.header
            promised = header.offset_to_point_data + header.point_count * header.point_format.size
            if header.are_points_compressed:
                raise source.fault("is compressed (LAZ); write it as plain LAS")
            if promised > len(content):
                raise source.fault(f"the header promises {promised} bytes, but {len(content)} are there")
            count = header.point_count
            if count * (header.point_format.size + 24) > MOST_BYTES:
                raise source.fault(f"{count} points are more than fit into {MOST_BYTES} bytes")
            read = reader.read()
    except CloudError:
        raise
    except Exception as fault:  # laspy has no error of its own for what is wrong inside a file
        raise source.fault(f"cannot be read as LAS: {fault or type(fault).__name__}") from fault
    columns = {name: np.asarray(read[name], np.float64) for name in "xyz"}
    names = [name for name in header.point_format.dimension_names if name not in "XYZ"]
    columns |= {name: np.asarray(read[name]) for name in names if name not in _PARTS}
    if set(_PARTS) <= set(names):
        parts = np.stack([np.asarray(read[part]) for part in _PARTS], axis=-1)
        # The standard wants 16 bits; many writers store 8.
        eight = parts >> 8 if parts.size and parts.max() > 255 else parts
        columns["rgb"] = packed_colour(eight.astype(np.uint8)).view(np.float32)
    points = np.empty(count, [(name, column.dtype.str, column.shape[1:]) for name, column in columns.items()])
    for name, column in columns.items():
        points[name] = column
    return points


def _check_records(source: Source) -> None:
    """Raise CloudError if a file is too short for the variable length records that its header promises."""
    content = source.content
    if len(content) < 227:
        raise source.fault(f"ends after {len(content)} bytes; the header alone has 227 or more")
    header = struct.unpack_from("<H", content, 94)[0]
    promised = header + 54 * struct.unpack_from("<I", content, 100)[0]
    if header >= 375 and content[24:26] >= b"\x01\x04" and len(content) >= 247:
        promised += 60 * struct.unpack_from("<I", content, 243)[0]
    if promised > len(content):
        raise source.fault(f"the header promises {promised} bytes or more, but {len(content)} are there")


def las_of(points: Points, encoding: Encoding) -> bytes:
    """Return a cloud as a file's content, LAS 1.4; fields that LAS has not are extra bytes.

    Points that were not measured are left out, as LAS has whole numbers only. `intensity` is rounded.

    Raises:
        CloudError: LAS has no such encoding, nothing for a field, a point is farther away than it can say,
            or laspy is not installed.
    """
    if encoding != "binary":
        raise CloudError(f"LAS has no encoding {encoding!r}; valid is binary")
    laspy = _laspy()
    plain = packed(points).reshape(-1)
    kinds = dict(scalar_fields(plain.dtype))
    plain = plain[np.all([np.isfinite(plain[name]) for name in "xyz"], axis=0)]
    colour = next((name for name in kinds if name in COLOURS and kinds[name].str in ("<f4", "<u4")), None)
    header = laspy.LasHeader(version="1.4", point_format=6 if colour is None else 7)
    own = set(header.point_format.dimension_names)
    for name, kind in kinds.items():
        if name not in {"x", "y", "z", colour} and name not in own:
            if kind.shape or kind.kind not in "iuf":
                raise CloudError(f"LAS has no type for the field {name!r} of {kind}; valid are numbers")
            header.add_extra_dim(laspy.ExtraBytesParams(name=name, type=kind.newbyteorder("=")))
    header.scales = np.full(3, _SCALE)
    # Far from zero, as in national grids, only the distances among the points have to fit.
    header.offsets = np.array([np.floor(plain[name].min()) if len(plain) else 0.0 for name in "xyz"])
    for name, offset in zip("xyz", header.offsets, strict=True):
        if len(plain) and plain[name].max() - offset > _FARTHEST:
            raise CloudError(f"LAS holds points within {_FARTHEST:.0f} m of each other; {name} spans more")
    written = laspy.LasData(header)
    for name in "xyz":
        setattr(written, name, plain[name].astype(np.float64))
    for name in kinds.keys() - {"x", "y", "z", colour}:
        values = plain[name]
        if name in own and values.dtype.kind == "f" and written[name].dtype.kind != "f":
            limits = np.iinfo(written[name].dtype)
            values = np.clip(np.nan_to_num(np.rint(values)), limits.min, limits.max)
        written[name] = values
    if colour is not None:
        for part, eight in zip(_PARTS, channels(plain[colour]).T, strict=False):
            written[part] = eight.astype(np.uint16) * 257
    sink = io.BytesIO()
    written.write(sink)
    return sink.getvalue()


def _laspy() -> ModuleType:
    try:
        import laspy
    except ImportError:
        raise CloudError("LAS files need laspy, which is not installed: pip install 'twin[las]'") from None
    return laspy
