"""The screen that a recording opens with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.geometry import Array, matrix_from_quat_wxyz
from twin.models.shapes import Box, Geometry, Mesh, Sphere
from twin.recording.columns import TIMELINE
from twin.recording.frames import WORLD, Frames
from twin.recording.sources import BodyShape, World

_RASTERS = ("map", "global_costmap/costmap", "local_costmap/costmap")
_FIELD_OF_VIEW = 1.2
"""Vertical angle of Rerun's eye [rad], a bit less than it is."""


def layout(world: World, shapes: Sequence[BodyShape]) -> rrb.Blueprint:
    """Return the layout for a world: 3-D, map from above, plots, states, log, verdict."""
    low, high = extent(world, shapes)
    robots = Frames(world.body_names).robots or ("robot",)
    left = rrb.Vertical(
        _simulation(robots, low, high),
        rrb.Horizontal(
            _plot("Forward velocity [m/s]", [f"/velocity/{robot}/linear/**" for robot in robots]),
            _plot("Turning velocity [rad/s]", [f"/velocity/{robot}/angular/**" for robot in robots]),
            rrb.Tabs(
                _plot("Joints [m, rad]", [f"/joints/{robot}/**" for robot in robots]),
                _plot("Localisation error [m, rad]", [f"/localisation/{robot}/**" for robot in robots]),
            ),
        ),
        row_shares=[5, 2],
    )
    right = rrb.Vertical(
        rrb.Tabs(*(_close_up(robot, _base(world, robot)) for robot in robots)),
        _from_above(robots, low, high),
        rrb.StateTimelineView(name="Mission", origin="/", contents=_mission(robots)),
        rrb.Horizontal(_log(), rrb.TextDocumentView(name="Verdict", origin="/verdict"), column_shares=[3, 2]),
        row_shares=[5, 4.2, 1.6, 2.6],
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[5, 3]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        auto_views=False,
        auto_layout=False,
    )


def extent(world: World, shapes: Sequence[BodyShape]) -> tuple[Array, Array]:
    """Return the corners (x, y) [m] of a rectangle that holds all shapes (of meshes: their origins)."""
    lows, highs = [np.array((-1.0, -1.0))], [np.array((1.0, 1.0))]
    for shape in shapes:
        pose = world.pose(shape.body) @ shape.T_body_geometry
        reach = (np.abs(matrix_from_quat_wxyz(pose.quat_wxyz)) @ _half_size(shape.geometry))[:2]
        lows.append(pose.xyz[:2] - reach)
        highs.append(pose.xyz[:2] + reach)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _half_size(geometry: Geometry) -> Array:
    """Return half the edges [m] of a box around a shape, in the shape's frame."""
    if isinstance(geometry, Box):
        return np.array(geometry.size) / 2.0
    if isinstance(geometry, Mesh):
        return np.zeros(3)
    length = 0.0 if isinstance(geometry, Sphere) else geometry.length
    return np.array((geometry.radius, geometry.radius, geometry.radius + length / 2.0))


def _simulation(robots: Sequence[str], low: Array, high: Array) -> rrb.Spatial3DView:
    """Return the view of what truly happens, seen from the south side, above."""
    centre = (low + high) / 2.0
    size = float(max(np.max(high - low), 4.0))
    return rrb.Spatial3DView(
        name="Simulation",
        origin="/",
        contents=["+ /world/**", "+ /estimate/**", "+ /trails/**", "+ /ros/**", *_rasters(robots, "-")],
        overrides=_whole_trails(robots),
        background=rrb.Background(kind="SolidColor", color=(38, 42, 48)),
        line_grid=rrb.LineGrid3D(visible=True, spacing=1.0, color=(110, 110, 110, 110)),
        spatial_information=rrb.SpatialInformation(target_frame=WORLD),
        eye_controls=rrb.EyeControls3D(
            kind="Orbital",
            position=(centre[0] - 0.1 * size, centre[1] - 0.68 * size, 0.5 * size),
            look_target=(centre[0], centre[1], 0.0),
            eye_up=(0.0, 0.0, 1.0),
        ),
    )


def _from_above(robots: Sequence[str], low: Array, high: Array) -> rrb.Spatial3DView:
    """Return the view of what the robot knows: map, costmaps, plan, particles, scan, with north up."""
    centre = (low + high) / 2.0
    height = float(max(np.max(high - low), 4.0)) / (2.0 * np.tan(_FIELD_OF_VIEW / 2.0))
    return rrb.Spatial3DView(
        name="Map",
        origin="/",
        contents=[
            "+ /ros/**",
            "+ /estimate/**",
            "+ /trails/**",
            *(f"+ /world/{robot}/**" for robot in robots),
        ],
        overrides=_whole_trails(robots),
        background=rrb.Background(kind="SolidColor", color=(60, 66, 70)),
        line_grid=rrb.LineGrid3D(visible=False),
        spatial_information=rrb.SpatialInformation(target_frame=WORLD),
        eye_controls=rrb.EyeControls3D(
            kind="Orbital",
            position=(centre[0], centre[1] - 0.001, height),
            look_target=(centre[0], centre[1], 0.0),
            eye_up=(0.0, 1.0, 0.0),
        ),
    )


def _base(world: World, robot: str) -> str:
    """Return the body that a robot's close-up view travels with."""
    links = [name for name in world.body_names if name.startswith(f"{robot}/")]
    return f"{robot}/base_link" if f"{robot}/base_link" in links or not links else links[0]


def _close_up(robot: str, base: str) -> rrb.Spatial3DView:
    """Return a view that travels with a robot, in the frame of its base."""
    return rrb.Spatial3DView(
        name=robot,
        origin="/",
        contents=["+ /world/**", "+ /estimate/**", "+ /trails/**", "+ /ros/**", *_rasters([robot], "-")],
        overrides=_whole_trails([robot]),
        background=rrb.Background(kind="SolidColor", color=(38, 42, 48)),
        line_grid=rrb.LineGrid3D(visible=False),
        spatial_information=rrb.SpatialInformation(target_frame=base),
        eye_controls=rrb.EyeControls3D(
            kind="Orbital", position=(-1.3, 1.7, 1.5), look_target=(0.25, 0.0, 0.5), eye_up=(0.0, 0.0, 1.0)
        ),
    )


def _log() -> rrb.TextLogView:
    return rrb.TextLogView(
        name="Log", origin="/log", columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    )


def _plot(name: str, contents: list[str]) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        name=name,
        origin="/",
        contents=[f"+ {content}" for content in contents],
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
    )


def _mission(robots: Sequence[str]) -> list[str]:
    return ["+ /mission/state", *(f"+ /{robot}/mission/state" for robot in robots)]


def _rasters(robots: Sequence[str], sign: str) -> list[str]:
    spaces = ("", *(f"/{robot}" for robot in robots))
    return [f"{sign} /ros{space}/{raster}" for space in spaces for raster in _RASTERS]


def _whole_trails(robots: Sequence[str]) -> dict[Any, Any]:
    """Return the overrides that show every segment of a trail up to the cursor."""
    whole_past = rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rr.TimeRangeBoundary.infinite(),
        end=rr.TimeRangeBoundary.cursor_relative(seconds=0.0),
    )
    kinds = ("truth", "odometry", "estimate")
    return {f"/trails/{robot}/{kind}": [whole_past] for robot in robots for kind in kinds}
