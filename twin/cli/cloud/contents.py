"""`twin cloud scan`, `clusters` and `plane`: what is in a cloud."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.cloud.files import File
from twin.cli.option_groups import AsJson
from twin.errors import CloudError

if TYPE_CHECKING:
    from twin.clouds.points import Points


def scan(
    file: File,
    min_height: Annotated[
        float, typer.Option("--min-height", metavar="M", help="Least z of points that count.")
    ] = -math.inf,
    max_height: Annotated[
        float, typer.Option("--max-height", metavar="M", help="Largest z of points that count.")
    ] = math.inf,
    angle_min: Annotated[float, typer.Option("--angle-min", metavar="RAD", help="The first ray.")] = -math.pi,
    angle_max: Annotated[float, typer.Option("--angle-max", metavar="RAD", help="The last ray.")] = math.pi,
    angle_increment: Annotated[
        float, typer.Option("--angle-increment", metavar="RAD", help="From ray to ray.")
    ] = math.pi / 180.0,
    range_min: Annotated[
        float, typer.Option("--range-min", metavar="M", help="What is nearer is left out.")
    ] = 0.0,
    range_max: Annotated[
        float, typer.Option("--range-max", metavar="M", help="What is farther is left out.")
    ] = math.inf,
    frame: Annotated[str, typer.Option("--frame", help="In which the points are.")] = "base_link",
) -> None:
    """Print the nearest point in each direction as YAML of a sensor_msgs/LaserScan."""
    from twin.bridge.laser_scans import SliceConfig, scan_of
    from twin.bridge.messages.as_text import message_to_yaml
    from twin.bridge.msgs import header
    from twin.bridge.point_cloud2 import cloud_of
    from twin.clouds.files import read_cloud

    config = SliceConfig(
        min_height=min_height,
        max_height=max_height,
        angle_min=angle_min,
        angle_max=angle_max,
        angle_increment=angle_increment,
        range_min=range_min,
        range_max=range_max,
    )
    message = scan_of(cloud_of(header(0, frame), read_cloud(file)), config)
    typer.echo(message_to_yaml(message), nl=False)


def clusters(
    file: File,
    tolerance: Annotated[
        float, typer.Option("--tolerance", metavar="M", help="Longest step from point to point.")
    ] = 0.05,
    min_size: Annotated[
        int, typer.Option("--min-size", min=1, metavar="N", help="Points of a cluster, at least.")
    ] = 1,
    max_size: Annotated[
        int | None, typer.Option("--max-size", min=1, metavar="N", help="Points of a cluster, at most.")
    ] = None,
    into: Annotated[
        Path | None, typer.Option("--into", metavar="DIR", help="Write each to cluster_<number>.pcd there.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the groups of points that hang together, the largest first."""
    from twin.clouds.clusters import euclidean_clusters
    from twin.clouds.files import read_cloud, write_cloud
    from twin.clouds.points import coordinates

    if not 0.0 < tolerance < math.inf:
        raise CloudError(f"--tolerance is {tolerance:g} m; valid is more than 0")
    points = read_cloud(file).reshape(-1)
    rows: list[dict[str, Any]] = []
    for number, index in enumerate(
        euclidean_clusters(points, tolerance, min_size=min_size, max_size=max_size)
    ):
        xyz = coordinates(points[index])
        low, high = xyz.min(axis=0), xyz.max(axis=0)
        middle, size = xyz.mean(axis=0).tolist(), (high - low).tolist()
        rows.append({"cluster": number, "points": len(index), "centroid": middle, "size": size})
        if into is not None:
            write_cloud(into / f"cluster_{number}.pcd", points[index])
    if as_json:
        from twin.cli.console import print_json

        print_json(rows)
        return
    from twin.cli.console import print_table

    columns = ("cluster", "points", "centroid in m", "size in m")
    print_table(
        columns,
        [
            (str(row["cluster"]), str(row["points"]), _numbers(row["centroid"]), _numbers(row["size"]))
            for row in rows
        ],
    )


def plane(
    file: File,
    threshold: Annotated[
        float, typer.Option("--threshold", metavar="M", help="How far off a point of the plane is, at most.")
    ] = 0.01,
    inliers: Annotated[
        Path | None, typer.Option("--inliers", metavar="OUT", help="Write the points of the plane there.")
    ] = None,
    others: Annotated[
        Path | None, typer.Option("--others", metavar="OUT", help="Write all other points there.")
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="Of the points that planes are tried through.")
    ] = 0,
    as_json: AsJson = False,
) -> None:
    """Find the plane that most points lie in: the floor, a wall, a table."""
    import numpy as np

    from twin.clouds.files import check_ending, read_cloud, write_cloud
    from twin.clouds.planes import fit_plane
    from twin.files.writing import check_file

    if not 0.0 <= threshold < math.inf:
        raise CloudError(f"--threshold is {threshold:g} m; valid is 0 or more")
    written = {"--inliers": inliers, "--others": others}
    for option, output in written.items():
        if output is not None:
            check_ending(output)
            check_file(output, option)
    points: Points = read_cloud(file).reshape(-1)
    found = fit_plane(points, threshold, np.random.Generator(np.random.Philox(seed)))
    for output, kept in ((inliers, found.inliers), (others, ~found.inliers)):
        if output is not None:
            write_cloud(output, points[kept])
    facts = {
        "normal": found.normal.tolist(),
        "offset": found.offset,
        "points": int(found.inliers.sum()),
        "of": points.size,
    }
    if as_json:
        from twin.cli.console import print_json

        print_json(facts)
        return
    typer.echo(f"normal  {_numbers(facts['normal'])}")
    typer.echo(f"offset  {found.offset:.4g} m")
    typer.echo(f"points  {facts['points']} of {points.size}")


def _numbers(values: list[float]) -> str:
    return ", ".join(f"{round(value, 3) + 0.0:g}" for value in values)
