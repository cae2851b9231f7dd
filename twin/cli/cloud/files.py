"""`twin cloud info`, `convert`, `crop`, `voxel`, `transform` and `deskew`: files of points."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from twin.errors import CloudError

if TYPE_CHECKING:
    from twin.clouds.points import Points

# As in twin/clouds/files: typer reads it here without numpy.
Encoding = Annotated[
    Literal["ascii", "binary", "binary_compressed"],
    typer.Option("--encoding", help="How numbers are written; binary_compressed: PCD only."),
]
File = Annotated[Path, typer.Argument(metavar="FILE", help="A .pcd, .ply or .las file.", show_default=False)]
Source = Annotated[Path, typer.Argument(metavar="IN", help="A .pcd, .ply or .las file.", show_default=False)]
Output = Annotated[
    Path, typer.Argument(metavar="OUT", help="The .pcd, .ply or .las file to write.", show_default=False)
]


def info(
    file: File, as_json: Annotated[bool, typer.Option("--json", help="Print the facts as JSON.")] = False
) -> None:
    """Say what a cloud is: fields, points, how many were not measured, and the box around the others."""
    from twin.clouds.files import read_cloud
    from twin.clouds.points import XYZ, measured, scalar_fields

    points = read_cloud(file)
    fields = {name: str(kind) for name, kind in scalar_fields(points.dtype)}
    whole = measured(points) if set(XYZ) <= set(fields) else points[:0]
    facts: dict[str, Any] = {
        "file": str(file),
        "fields": fields,
        "points": points.size,
        "shape": list(points.shape),
        "not_measured": points.size - len(whole) if set(XYZ) <= set(fields) else None,
        "min": [float(whole[axis].min()) for axis in XYZ] if len(whole) else None,
        "max": [float(whole[axis].max()) for axis in XYZ] if len(whole) else None,
    }
    if as_json:
        from twin.cli.console import print_json

        print_json(facts)
        return
    size = f", {points.shape[1]} x {points.shape[0]}" if points.ndim == 2 else ""
    typer.echo(f"points  {points.size}{size}")
    typer.echo(f"fields  {', '.join(f'{name} {kind}' for name, kind in fields.items())}")
    if facts["not_measured"]:
        typer.echo(f"NaN     {facts['not_measured']}")
    for axis, low, high in zip(XYZ, facts["min"] or (), facts["max"] or (), strict=False):
        typer.echo(f"{axis}       {low:.4g} to {high:.4g} m")


def convert(source: Source, output: Output, encoding: Encoding = "binary") -> None:
    """Write a cloud in another format or encoding, with all its fields."""
    _rewrite(source, output, encoding, lambda points: points)


def crop(
    source: Source,
    output: Output,
    low: Annotated[
        str, typer.Option("--min", metavar="X,Y,Z", help="Least x, y, z in metres.", show_default="no limit")
    ] = "",
    high: Annotated[
        str,
        typer.Option("--max", metavar="X,Y,Z", help="Largest x, y, z in metres.", show_default="no limit"),
    ] = "",
    negative: Annotated[bool, typer.Option("--negative", help="Keep what is outside of the box.")] = False,
    encoding: Encoding = "binary",
) -> None:
    """Keep the points in a box."""
    from twin.clouds.filters import crop_box

    corners = _corner("--min", low, -math.inf), _corner("--max", high, math.inf)
    _rewrite(source, output, encoding, lambda points: crop_box(points, *corners, negative=negative))


def voxel(
    source: Source,
    output: Output,
    leaf: Annotated[float, typer.Option("--leaf", metavar="M", help="Edge of a cube.")] = 0.05,
    encoding: Encoding = "binary",
) -> None:
    """Keep one point for each cube of a grid: the centroid of those in it."""
    from twin.clouds.filters import voxel_grid

    _rewrite(source, output, encoding, lambda points: voxel_grid(points, leaf))


def transform(
    source: Source,
    output: Output,
    xyz: Annotated[
        str,
        typer.Option("--xyz", metavar="X,Y,Z", help="Where the cloud's frame is in the new one, in metres."),
    ] = "0,0,0",
    rpy: Annotated[
        str,
        typer.Option(
            "--rpy", metavar="R,P,Y", help="How it is turned there: roll, pitch and yaw in radians."
        ),
    ] = "0,0,0",
    encoding: Encoding = "binary",
) -> None:
    """Write a cloud in another frame; normals turn with it."""
    from twin.clouds.points import transformed
    from twin.geometry import Pose3

    T_new_cloud = Pose3.from_xyz_rpy(_finite("--xyz", xyz), _finite("--rpy", rpy))
    _rewrite(source, output, encoding, lambda points: transformed(points, T_new_cloud))


def deskew(
    source: Source,
    output: Output,
    linear: Annotated[
        str,
        typer.Option("--linear", metavar="X,Y,Z", help="Velocity of the lidar in its own frame, in m/s."),
    ] = "0,0,0",
    angular: Annotated[
        str, typer.Option("--angular", metavar="X,Y,Z", help="How fast it turned there, in rad/s.")
    ] = "0,0,0",
    at: Annotated[
        float,
        typer.Option("--at", metavar="S", help="The moment of the new cloud, after its first point."),
    ] = 0.0,
    encoding: Encoding = "binary",
) -> None:
    """Take the motion of the lidar out of a cloud, by the times of its points and an even velocity."""
    import numpy as np

    from twin.clouds.deskewing import deskewed_by_twist

    if not math.isfinite(at):
        raise CloudError(f"--at is {at:g}; valid is a number of seconds")
    twist = np.array(_finite("--linear", linear)), np.array(_finite("--angular", angular))
    _rewrite(source, output, encoding, lambda points: deskewed_by_twist(points, *twist, at=at))


def _corner(option: str, text: str, instead: float) -> list[float]:
    return _three(option, text) if text else [instead] * 3


def _finite(option: str, text: str) -> list[float]:
    numbers = _three(option, text)
    if not all(map(math.isfinite, numbers)):
        raise CloudError(f"{option} is '{text}'; valid are three finite numbers, as 0.5,-1,0.2")
    return numbers


def _three(option: str, text: str) -> list[float]:
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError:
        raise CloudError(f"{option} is '{text}'; valid are three numbers, as 0.5,-1,0.2") from None
    if math.isnan(x + y + z):
        raise CloudError(f"{option} is '{text}'; valid are three numbers, as 0.5,-1,0.2")
    return [x, y, z]


def _rewrite(source: Path, output: Path, encoding: Any, change: Any) -> None:
    from twin.clouds.files import check_ending, read_cloud, write_cloud
    from twin.files.writing import check_file

    check_ending(output)
    check_file(output, "OUT")
    points: Points = read_cloud(source)
    made: Points = change(points)
    write_cloud(output, made, encoding)
    of = "" if made.size == points.size else f" of {points.size}"
    typer.echo(f"{output}: {made.size}{of} points")
