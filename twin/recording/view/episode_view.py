"""An environment in a live viewer, episode by episode."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Sequence

import rerun as rr
import rerun.blueprint as rrb

from twin.geometry import Array, Pose3
from twin.models.shapes import Cylinder
from twin.recording.blueprint import DARK, orbit
from twin.recording.channels.spatial import SCAN_COLOUR
from twin.recording.columns import TIMELINE, component, send, sim_time, transforms
from twin.recording.extents import bounds
from twin.recording.frames import WORLD
from twin.recording.live_screen import LiveScreen
from twin.recording.shapes import Drawing, Solid, declare_floor, declare_shapes, draw_solids
from twin.recording.stream import open_recording
from twin.sim.shapes import BodyShape

_APPLICATION_ID = "twin-envs"
_GOAL_RGBA = (38, 178, 64, 255)


class EpisodeView:
    """A viewer's window, or where there is no display, its page for a browser on this computer."""

    def __init__(self, shapes: Sequence[BodyShape], pose_of: Callable[[str], Pose3]) -> None:
        """Prepare; the viewer starts with the first episode. Nobody waits for it.

        Args:
            shapes: Of everything but the floor.
            pose_of: Returns the pose in the world of what never moves.

        Raises:
            RecordingError: There is no viewer.
        """
        self._shapes, self._pose_of = tuple(shapes), pose_of
        self._screen = LiveScreen(logging.getLogger("twin.envs").warning)
        self.page_url = self._screen.page_url
        """Address of the viewer's page; None: it has a window."""
        self._recording: rr.RecordingStream | None = None

    def begin(self, name: str, goal: Sequence[float], tolerance: float) -> None:
        """Show a new episode with a name of its own, and its goal at x, y [m], a disc of a radius [m]."""
        statics = [shape for shape in self._shapes if shape.static]
        low, high = bounds(statics, self._pose_of)
        identity, layout = f"{name} {uuid.uuid4()}", _layout(low, high)
        self._recording = open_recording(None, _APPLICATION_ID, identity, layout, self._screen)
        self._screen.put(lambda shown: shown.send_recording_name(name), lasting=True)
        declare_episode(self._recording, self._shapes, self._pose_of)
        disc = Cylinder(radius=tolerance, length=0.01)
        solid = Solid(disc, Pose3.from_xyz_rpy((*goal, 0.005)), _GOAL_RGBA)
        draw_solids(self._recording, [Drawing("/world/goal", WORLD, [solid])])

    def show(self, time_ns: int, names: Sequence[str], xyz: Array, quat_wxyz: Array, points: Array) -> None:
        """Show a moment of the episode.

        Args:
            time_ns: Since it began.
            names: Of the n bodies that move.
            xyz: Theirs, in the world, shape (n, 3) [m].
            quat_wxyz: Theirs, shape (n, 4).
            points: Where the lidar sees something, in the world, shape (m, 3) [m].
        """
        recording = self._recording
        assert recording is not None, "an episode must have begun"
        rows = len(names)
        turned = quat_wxyz[:, [1, 2, 3, 0]]
        times = sim_time([time_ns])
        poses = transforms("/tf", sim_time([time_ns] * rows), [WORLD] * rows, names, xyz, turned)
        seen = component(rr.Points3D, "positions").column(points, [len(points)])
        send(recording, [poses, ("/world/scan", times, (seen,))])

    def close(self) -> None:
        """End the viewer."""
        self._screen.finish()
        self._screen.close()
        self._recording = None


def declare_episode(
    recording: rr.RecordingStream, shapes: Sequence[BodyShape], pose_of: Callable[[str], Pose3]
) -> None:
    """Log what does not change in an episode: floor and shapes."""
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, rr.CoordinateFrame(WORLD), static=True)
    look = rr.Points3D.from_fields(colors=[SCAN_COLOUR], radii=rr.Radius.ui_points(2.0))
    recording.log("/world/scan", rr.CoordinateFrame(WORLD), look, static=True)
    declare_shapes(recording, shapes, pose_of)
    low, high = bounds([shape for shape in shapes if shape.static], pose_of)
    declare_floor(recording, low[:2], high[:2])


def _layout(low: Array, high: Array) -> rrb.Blueprint:
    """Return the screen: everything between two corners [m], seen from the south, above."""
    centre, size = (low + high) / 2.0, float(max(high[:2] - low[:2]))
    eye = orbit((centre[0], centre[1] - 0.75 * size, 0.75 * size), (centre[0], centre[1], 0.0))
    view = rrb.Spatial3DView(
        name="Environment",
        origin="/",
        contents="/world/**",
        background=DARK,
        spatial_information=rrb.SpatialInformation(target_frame=WORLD),
        eye_controls=eye,
    )
    return rrb.Blueprint(
        view,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        auto_views=False,
        auto_layout=False,
    )
