"""The screen that a recording opens with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import ArrayLike

from twin.recording.columns import TIMELINE
from twin.recording.extents import Floor, RobotBox, Stage
from twin.recording.frames import WORLD
from twin.recording.map_eye import MAP_EYE, MAP_IMAGE

_RASTERS = ("map", "global_costmap/costmap", "local_costmap/costmap")
_COSTS = ("global_costmap/costmap",)
DARK = rrb.Background(kind="SolidColor", color=(38, 42, 48))
_LEAST_STAGE = 2.5
"""Size of the floor that the camera looks at [m], at least."""
_CLOSE_UP = np.array((-0.62, 0.62, 0.48))
"""Where the close-up is seen from: behind, on the left, above."""
_CLOSE_UP_DISTANCE = 1.3
"""Of the camera, relative to the robot's size."""
_LEGEND_ROOM = 1.35
"""How much longer than the run the time axis of a plot is, so that the legend covers no curve."""


def layout(
    stage: Stage,
    robots: Sequence[RobotBox],
    end_ns: int | None = None,
    *,
    mirrors: bool = False,
    pictures: Sequence[str] = (),
    flat: Sequence[str] = (),
    joints_move: bool = True,
) -> rrb.Blueprint:
    """Return the screen: 3-D, mission, plots on the left; close-up, map, verdict and log on the right.

    Args:
        stage: The floor to show.
        robots: Each has a close-up.
        end_ns: Simulated time at which the recording ends [ns]; None: it goes on.
        mirrors: How far virtual and physical robots are apart comes before the joints, and the status of
            the mirror before the verdict.
        pictures: Entities of what cameras see; each is beside the close-ups.
        flat: Those of them that have no place in space.
        joints_move: Else their plot, which is then of noise, is behind that of the localisation's error.
    """
    names = [box.robot for box in robots]
    joints = _plot("Joints [m, rad]", [f"/joints/{name}/**" for name in names], end_ns)
    error = _plot("Localisation error [m, rad]", [f"/localisation/{name}/**" for name in names], end_ns)
    plots = [joints, error] if joints_move else [error, joints]
    texts = [rrb.TextDocumentView(name="Verdict", origin="/verdict"), _log()]
    if mirrors:
        apart = _plot("Divergence [m, rad]", [f"/divergence/{name}/**" for name in names], end_ns)
        # Where the virtual robot is believed to be is no error: it is where the physical one is seen.
        plots = [apart, joints]
        texts.insert(0, rrb.TextDocumentView(name="Mirror", origin="/mirror/status"))
    left = rrb.Vertical(
        _whole("Simulation", stage, names, _RASTERS, flat),
        _mission(names, end_ns),
        rrb.Horizontal(
            rrb.Tabs(
                _plot("Forward velocity [m/s]", [f"/velocity/{name}/linear/**" for name in names], end_ns),
                _plot("Turning velocity [rad/s]", [f"/velocity/{name}/angular/**" for name in names], end_ns),
            ),
            rrb.Tabs(*plots),
        ),
        row_shares=[5, 1.8, 2.6],
    )
    right = rrb.Vertical(*_close_ups(robots, pictures, _RASTERS, flat), _from_above(names), rrb.Tabs(*texts))
    return _screen(left, right)


def graph_layout(
    floor: Floor,
    names: Sequence[str],
    robots: Sequence[RobotBox],
    pictures: Sequence[str],
    flat: Sequence[str],
    texts: Mapping[str, str],
) -> rrb.Blueprint:
    """Return the screen of a graph: as that of a run, without what only a simulator knows.

    Args:
        floor: To show.
        names: Of robots.
        robots: Those that are drawn; each has a close-up.
        pictures: Entities of what cameras see.
        flat: Those of them that have no place in space.
        texts: Entities of messages to read, and what they are called.
    """
    left = rrb.Vertical(
        _whole("World", floor, names, _COSTS, flat),
        rrb.Horizontal(
            _plot("Forward velocity [m/s]", [f"/velocity/{name}/linear/**" for name in names], None),
            _plot("Turning velocity [rad/s]", [f"/velocity/{name}/angular/**" for name in names], None),
            _plot("Joints [m, rad]", ["/joints/**"], None),
        ),
        row_shares=[5, 1.8],
    )
    below: list[Any] = [_log(), _mission(names, None)]
    below += [rrb.TextDocumentView(name=name, origin=entity) for entity, name in texts.items()]
    right = rrb.Vertical(*_close_ups(robots, pictures, _COSTS, flat), _from_above(names), rrb.Tabs(*below))
    return _screen(left, right)


def _close_ups(
    robots: Sequence[RobotBox], pictures: Sequence[str], hidden: Sequence[str], flat: Sequence[str]
) -> list[Any]:
    """Return what is at the top on the right: close-ups, and what cameras see beside them."""
    seen = [rrb.Spatial2DView(name=_camera_name(entity), origin=entity) for entity in pictures]
    close_ups: list[Any] = [rrb.Tabs(*(_close_up(box, hidden, flat) for box in robots))] if robots else []
    return [rrb.Horizontal(*close_ups, rrb.Tabs(*seen))] if seen else close_ups


def _screen(left: rrb.Vertical, right: rrb.Vertical) -> rrb.Blueprint:
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[5, 3]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        auto_views=False,
        auto_layout=False,
    )


def _camera_name(entity: str) -> str:
    """Return what a view of pictures is called: their topic without what image_transport adds."""
    return (
        entity.removeprefix("/cameras/")
        .removeprefix("/depths/")
        .removesuffix("/compressed")
        .removesuffix("/image_raw")
    )


def _whole(
    name: str, stage: Stage | Floor, robots: Sequence[str], hidden: Sequence[str], flat: Sequence[str]
) -> rrb.Spatial3DView:
    """Return the view of all that happens, seen from the south side, above."""
    centre = (stage.low + stage.high) / 2.0
    width, length = stage.high - stage.low
    size = float(max(0.85 * width, 1.1 * length, _LEAST_STAGE))  # the view is wider than high
    position = (centre[0] - 0.1 * size, centre[1] - 0.7 * size, 0.52 * size)
    grid = rrb.LineGrid3D(visible=True, spacing=1.0, color=(110, 110, 110, 110))
    return _world(name, robots, WORLD, grid, orbit(position, (*centre, 0.0)), hidden, flat)


def _close_up(box: RobotBox, hidden: Sequence[str], flat: Sequence[str]) -> rrb.Spatial3DView:
    """Return a view that travels with a robot, in the frame of its base, from as far as its size asks for."""
    eye = orbit(box.centre + _CLOSE_UP_DISTANCE * box.size * _CLOSE_UP, box.centre)
    return _world(box.robot, [box.robot], box.base, rrb.LineGrid3D(visible=False), eye, hidden, flat)


def _world(
    name: str,
    robots: Sequence[str],
    frame: str,
    grid: rrb.LineGrid3D,
    eye: rrb.EyeControls3D,
    hidden: Sequence[str],
    flat: Sequence[str],
) -> rrb.Spatial3DView:
    return rrb.Spatial3DView(
        name=name,
        origin="/",
        contents=[
            "+ /world/**",
            "+ /estimate/**",
            "+ /trails/**",
            "+ /ros/**",
            "+ /cameras/**",
            *_without(robots, hidden),
            *(f"- {entity}" for entity in flat),
        ],
        overrides=_whole_trails(robots),
        background=DARK,
        line_grid=grid,
        spatial_information=rrb.SpatialInformation(target_frame=frame),
        eye_controls=eye,
    )


def orbit(position: ArrayLike, look_target: ArrayLike) -> rrb.EyeControls3D:
    """Return an eye at a position that looks at another [m], and that the user can take around it."""
    up = (0.0, 0.0, 1.0)
    return rrb.EyeControls3D(kind="Orbital", position=position, look_target=look_target, eye_up=up)


def _from_above(robots: Sequence[str]) -> rrb.Spatial2DView:
    """Return the view of what the robot knows: map, costmaps, plan, particles, scan, with north up."""
    return rrb.Spatial2DView(
        name="Map",
        origin=MAP_EYE,
        contents=["+ /ros/**", "+ /estimate/**", "+ /trails/**", *(f"+ /world/{name}/**" for name in robots)],
        overrides=_whole_trails(robots),
        background=rrb.Background(kind="SolidColor", color=(60, 66, 70)),
        spatial_information=rrb.SpatialInformation(target_frame=MAP_IMAGE),
    )


def _log() -> rrb.TextLogView:
    return rrb.TextLogView(
        name="Log", origin="/log", columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    )


def _plot(name: str, contents: list[str], end_ns: int | None) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        name=name,
        origin="/",
        contents=[f"+ {content}" for content in contents],
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
        axis_x=_time_axis(end_ns, _LEGEND_ROOM),
    )


def _mission(robots: Sequence[str], end_ns: int | None) -> rrb.StateTimelineView:
    spaces = ("", *(f"/{robot}" for robot in robots))
    return rrb.StateTimelineView(
        name="Mission",
        origin="/",
        contents=[f"+ {space}/mission/**" for space in spaces],
        time_view=_time_axis(end_ns, 1.0),
    )


def _time_axis(end_ns: int | None, room: float) -> rrb.TimeAxis | None:
    """Return an axis from the start to `room` times the end."""
    if not end_ns:
        return None
    start, end = (rr.TimeRangeBoundary.absolute(nanos=t) for t in (0, round(room * end_ns)))
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


def _without(robots: Sequence[str], rasters: Sequence[str]) -> list[str]:
    """Return what leaves maps out."""
    spaces = ("", *(f"/{robot}" for robot in robots))
    return [f"- /ros{space}/{raster}" for space in spaces for raster in rasters]


def _whole_trails(robots: Sequence[str]) -> dict[Any, Any]:
    """Return the overrides that show every segment of a trail up to the cursor."""
    whole_past = rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rr.TimeRangeBoundary.infinite(),
        end=rr.TimeRangeBoundary.cursor_relative(seconds=0.0),
    )
    kinds = ("truth", "odometry", "estimate")
    return {f"/trails/{robot}/{kind}": [whole_past] for robot in robots for kind in kinds}
