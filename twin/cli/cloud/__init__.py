"""`twin cloud`: point clouds in files, as PCL's tools have them, and on topics."""

from __future__ import annotations

import typer

from twin.cli.cloud import contents, files, topics
from twin.cli.option_groups import example

app = typer.Typer(
    no_args_is_help=True, help="Point clouds: look at files, convert, thin, move, take apart, publish, save."
)

for _function, _example in (
    (files.info, "twin cloud info scene.pcd --json"),
    (files.convert, "twin cloud convert scene.pcd scene.ply --encoding ascii"),
    (files.crop, "twin cloud crop scene.pcd table.pcd --min 0.5,-1,0.6 --max 2,1,1.5"),
    (files.voxel, "twin cloud voxel scene.pcd thin.pcd --leaf 0.05"),
    (files.transform, "twin cloud transform scan.pcd base.pcd --xyz 0.2,0,0.5 --rpy 0,0,1.57"),
    (files.deskew, "twin cloud deskew turn.pcd still.pcd --linear 1,0,0 --angular 0,0,0.5"),
    (contents.scan, "twin cloud scan hall.pcd --min-height 0.1 --max-height 0.5"),
    (contents.clusters, "twin cloud clusters above.pcd --tolerance 0.05 --min-size 10"),
    (contents.plane, "twin cloud plane scene.pcd --threshold 0.01 --others above.pcd"),
    (topics.publish, "twin cloud publish scene.pcd --topic filtered_plane --frame base_link"),
    (topics.save, "twin cloud save /points scene.pcd"),
):
    app.command(no_args_is_help=True, epilog=example(_example))(_function)
