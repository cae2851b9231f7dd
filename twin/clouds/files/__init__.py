"""Files of points: PCD as PCL writes it, PLY as CloudCompare, Open3D and MeshLab do, LAS of surveyors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import get_args

from twin.clouds.files.encodings import Encoding
from twin.clouds.files.las import las_of, parse_las
from twin.clouds.files.pcd import parse_pcd, pcd_of
from twin.clouds.files.ply import parse_ply, ply_of
from twin.clouds.points import Points
from twin.errors import CloudError, Problem
from twin.files.reading import absence, read_bytes
from twin.files.writing import write_whole

_FORMATS: dict[str, tuple[Callable[[bytes, Path], Points], Callable[[Points, Encoding], bytes]]] = {
    ".pcd": (parse_pcd, pcd_of),
    ".ply": (parse_ply, ply_of),
    ".las": (parse_las, las_of),
}
ENCODINGS: tuple[str, ...] = get_args(Encoding)


def read_cloud(path: Path) -> Points:
    """Return the cloud of a .pcd, .ply or .las file, organised if the file says so.

    Raises:
        CloudError: There is no such file, or it is not what its ending says: its first fault, with the line
            or the byte.
    """
    parse, _ = _format(path)
    missing = absence(path)
    if missing:
        raise CloudError(Problem(missing, path))
    try:
        content = read_bytes(path)
    except OSError as fault:
        raise CloudError(Problem(f"cannot be read: {fault.strerror}", path)) from fault
    return parse(content, path)


def write_cloud(path: Path, points: Points, encoding: Encoding = "binary") -> None:
    """Write a cloud as its ending says: .pcd, .ply or .las.

    Raises:
        CloudError: The format has no such encoding, or nothing for a field of the cloud.
        RecordingError: The file cannot be written.
    """
    _, content_of = _format(path)
    write_whole(path, content_of(points, encoding))


def check_ending(path: Path) -> None:
    """Refuse, before any work, a file whose format is unknown.

    Raises:
        CloudError: Its ending is none of them.
    """
    _format(path)


def _format(path: Path) -> tuple[Callable[[bytes, Path], Points], Callable[[Points, Encoding], bytes]]:
    found = _FORMATS.get(path.suffix.lower())
    if found is None:
        raise CloudError(
            Problem(
                f"the ending {path.suffix!r} is no format of clouds; valid are {', '.join(_FORMATS)}", path
            )
        )
    return found
