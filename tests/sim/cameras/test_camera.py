"""What a camera sees is where its lens says, as far as rays say, and the same each time."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from ctypes.util import find_library
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from tests.drawing import needs_opengl
from tests.sim.cameras.conftest import BALL, BALL_AT, BALL_RADIUS, EYE, WALL, Look
from twin.bridge.msgs import Header, new
from twin.errors import ModelError
from twin.geometry import Pose3
from twin.models.shapes import Box, Capsule, Cylinder, Geometry, Sphere
from twin.nodes.cameras.messages import camera_info
from twin.sim.scene import Shape, StaticBody

pytestmark = needs_opengl
SMALL = 0.12
LENS = "<distortion><k1>-0.25</k1><k2>0.1</k2><k3>0.01</k3><p1>0.002</p1><p2>-0.001</p2></distortion>"


def wide(kind: str, fov: float, cutoff: str = "<cutoff_angle>3.1416</cutoff_angle>") -> str:
    """Return what a wide-angle camera has inside; it makes pictures of 480 x 480 pixels."""
    return (
        f"<lens><type>{kind}</type>{cutoff}<env_texture_size>512</env_texture_size></lens>"
        f"<horizontal_fov>{fov}</horizontal_fov><image><width>480</width><height>480</height></image>"
    )


def outline(centre: np.ndarray, radius: float) -> np.ndarray:
    """Return points of the edge at which a sphere is seen, in the optical frame, shape (n, 3)."""
    d2 = centre @ centre
    share = 1.0 - radius**2 / d2
    side = np.cross(centre, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    other = np.cross(centre, side) / np.sqrt(d2)
    turn = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)[:, None]
    return share * centre + radius * np.sqrt(share) * (np.cos(turn) * side + np.sin(turn) * other)


def middle(polygon: np.ndarray) -> np.ndarray:
    """Return the centre of the area of a polygon, shape (n, 2)."""
    after = np.roll(polygon, -1, axis=0)
    cross = polygon[:, 0] * after[:, 1] - after[:, 0] * polygon[:, 1]
    return ((polygon + after) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())


def opencv_projection(points: np.ndarray, k: np.ndarray, d: tuple[float, ...]) -> np.ndarray:
    """Project as the formulas of OpenCV's calib3d page say."""
    k1, k2, p1, p2, k3 = d
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.stack((k[0, 0] * u + k[0, 2], k[1, 1] * v + k[1, 2]), axis=1)


INTRINSICS = "<lens><intrinsics><fx>120</fx><fy>150</fy><cx>62</cx><cy>70</cy><s>0</s></intrinsics></lens>"


@pytest.mark.parametrize(
    "inside", ["", LENS, INTRINSICS, LENS + INTRINSICS], ids=["pinhole", "lens", "intrinsics", "both"]
)
def test_a_ball_is_seen_where_the_camera_info_says(camera_at: Look, inside: str) -> None:
    camera = camera_at(BALL, inside=inside)
    image = camera.look(0).colours
    assert image is not None
    red = (image[..., 0].astype(int) - image[..., 1]) > 60
    v, u = np.nonzero(red)
    assert len(u) > 200
    ahead, left, up = np.array(BALL_AT) - EYE
    info = camera_info(new(Header), camera.spec.lens)
    if INTRINSICS in inside:
        assert info.k.tolist() == [120, 0, 62, 0, 150, 70, 0, 0, 1]
    ball = np.array([-left, -up, ahead])
    edge = opencv_projection(outline(ball, BALL_RADIUS), info.k.reshape(3, 3), tuple(info.d))
    assert np.abs(np.array([u.mean(), v.mean()]) - middle(edge)).max() < 0.2


@pytest.mark.parametrize(
    ("kind", "fov", "angles"),
    [
        ("equidistant", 6.28, (0.0, 0.79, 1.4, 2.4)),  # 0.79: on two faces of the cube
        ("stereographic", 5.0, (0.0, 0.79, 1.4, 2.2)),
        ("equisolid_angle", 6.28, (0.0, 0.79, 1.4, 2.4)),
        ("orthographic", 3.14, (0.0, 0.79, 1.3)),
        ("gnomonical", 2.6, (0.0, 0.79, 1.1)),
    ],
)
def test_balls_are_seen_where_a_wide_lens_says(
    camera_at: Look, kind: str, fov: float, angles: tuple[float, ...]
) -> None:
    ways = [np.array([np.cos(angle), np.sin(angle) * 0.96, np.sin(angle) * 0.28]) for angle in angles]
    red_ball = (Shape(geometry=Sphere(radius=SMALL), rgba=(1.0, 0.0, 0.0, 1.0)),)
    balls = [
        StaticBody(name=f"ball {i}", T_world_body=Pose3.from_xyz_rpy(EYE + 2.0 * way), shapes=red_ball)
        for i, way in enumerate(ways)
    ]
    camera = camera_at(*balls, kind="wideanglecamera", inside=wide(kind, fov))
    image = camera.look(0).colours
    assert image is not None
    red = (image[..., 0].astype(int) - image[..., 1]) > 60
    for x, y, z in ways:
        seen = camera.spec.lens.project(outline(2.0 * np.array([-y, -z, x]), SMALL))
        (left, top), (right, bottom) = np.floor(seen.min(axis=0)) - 2, np.ceil(seen.max(axis=0)) + 3
        v, u = np.nonzero(red[int(top) : int(bottom), int(left) : int(right)])
        assert len(u) > 10
        assert np.abs(np.array([u.mean() + left, v.mean() + top]) - middle(seen)).max() < 0.2


def test_opencv_finds_what_an_equidistant_lens_shows(camera_at: Look) -> None:
    cv2 = pytest.importorskip("cv2")
    camera = camera_at(BALL, kind="wideanglecamera", inside=wide("equidistant", 3.14))
    info = camera_info(new(Header), camera.spec.lens)
    assert info.distortion_model == "equidistant"
    image = camera.look(0).colours
    assert image is not None
    v, u = np.nonzero((image[..., 0].astype(int) - image[..., 1]) > 60)
    ahead, left, up = np.array(BALL_AT) - EYE
    points, still = outline(np.array([-left, -up, ahead]), BALL_RADIUS)[:, None], np.zeros((3, 1))
    edge, _ = cv2.fisheye.projectPoints(points, still, still, info.k.reshape(3, 3), info.d)
    assert np.abs(np.array([u.mean(), v.mean()]) - middle(edge[:, 0])).max() < 0.2


def test_a_wide_picture_has_no_seams_and_ends_at_the_cutoff(camera_at: Look) -> None:
    inside = wide("equidistant", 3.14, "<cutoff_angle>1.2</cutoff_angle>")
    camera = camera_at(WALL, kind="wideanglecamera", inside=inside)
    assert len(camera.source.turns) == 5
    image = camera.look(0).colours
    assert image is not None
    angle = np.arccos(camera.spec.lens.directions()[..., 2])
    assert (image[np.isnan(angle)] == 0).all()
    assert (image[~np.isnan(angle)] > 0).all()
    assert np.nanmax(angle) == pytest.approx(1.2, abs=0.02)
    wall = image[200:210, 100:380].astype(int)  # of which one part is seen ahead, two are seen beside
    assert np.ptp(wall.reshape(-1, 3), axis=0).max() <= 1


def test_a_narrow_wide_lens_draws_one_view(camera_at: Look) -> None:
    assert len(camera_at(kind="wideanglecamera", inside=wide("equidistant", 1.0)).source.turns) == 1


def test_the_depth_of_a_wall_is_what_rays_measure(camera_at: Look) -> None:
    camera = camera_at(WALL)
    depth = camera.look(0, colours=False, depth=True).depth
    assert depth is not None
    world, hit = camera.mount.world, np.full((120, 160), np.nan)
    rays = camera.spec.lens.rays()
    for row in range(0, 120, 7):
        for column in range(0, 160, 7):
            x, y = rays[row, column]
            ray = np.array([1.0, -x, -y])
            length = mujoco.mj_ray(
                world.model, world.data, np.array(EYE), ray, None, 1, -1, np.zeros(1, np.int32)
            )
            hit[row, column] = length  # in lengths of the ray, whose x is 1: along the axis
    cast = np.isfinite(hit)
    assert cast.sum() > 350
    error = np.abs(depth - hit)[cast]
    assert np.median(error) < 1e-5
    assert error.max() < 1e-3
    assert np.median(np.abs(depth[:60] - 3.0)) < 1e-5


def test_there_is_no_depth_in_the_sky_and_beyond_the_far_plane(camera_at: Look) -> None:
    inside = "<depth_camera><clip><far>1.5</far></clip></depth_camera>"
    view, plain = (camera_at(BALL, inside=text).look(0, depth=True) for text in (inside, ""))
    assert view.depth is not None
    assert view.colours is not None
    assert plain.colours is not None
    assert (view.colours == plain.colours).all()  # in which the ball is still seen
    assert np.isnan(view.depth[:60]).all()  # the ball is 2 m away
    assert 0.5 < np.nanmin(view.depth) < np.nanmax(view.depth) <= 1.5


_NOT = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("shape", "rpy", "miss"),
    [
        (Box(size=(0.5, 0.5, 0.5)), (0.3, 0.2, 0.1), (0.0, 0.34, 0.0)),
        (Sphere(radius=0.2), _NOT, (0.12, 0.12, 0.12)),
        (Cylinder(radius=0.1, length=0.6), (0.0, 0.5 * np.pi, 0.0), (0.0, 0.0, 0.15)),
        (Capsule(radius=0.1, length=0.4), _NOT, (0.0, 0.09, 0.25)),
    ],
    ids=["box", "ball", "cylinder", "capsule"],
)
def test_a_camera_inside_a_wall_says_so_once_and_goes_on(
    camera_at: Look, caplog: pytest.LogCaptureFixture, shape: Geometry, rpy: Any, miss: Any
) -> None:
    for offset, said in ((miss, []), (_NOT, ["camera 'camera' of mast is inside around"])):
        T_world_body = Pose3.from_xyz_rpy(np.add(EYE, offset), rpy)
        camera = camera_at(
            StaticBody(name="around", T_world_body=T_world_body, shapes=(Shape(geometry=shape),))
        )
        for _ in range(2):
            view = camera.look(0, depth=True)
            assert view.depth is not None
            assert view.depth.shape == (120, 160)
        warned = (record for record in caplog.records if record.levelno >= logging.WARNING)
        assert [record.getMessage().partition(":")[0] for record in warned] == said


def test_encodings_are_of_the_same_picture(camera_at: Look) -> None:
    rgb, bgr, grey = (camera_at(BALL, format=name).look(0).colours for name in ("R8G8B8", "B8G8R8", "L8"))
    assert rgb is not None
    assert bgr is not None
    assert grey is not None
    assert (bgr == rgb[..., ::-1]).all()
    assert np.abs(grey - rgb @ [0.299, 0.587, 0.114]).max() <= 0.5


NOISE = "<noise><type>gaussian</type><mean>0.02</mean><stddev>0.01</stddev></noise>"


def test_noise_is_of_the_seed_and_the_time(camera_at: Look) -> None:
    plain = camera_at(WALL).look(0).colours
    camera, other = camera_at(WALL, inside=NOISE), camera_at(WALL, inside=NOISE, seed=1)
    first, again = camera.look(0).colours, camera.look(0).colours
    later, of_other = camera.look(100_000_000).colours, other.look(0).colours
    assert first is not None
    assert plain is not None
    assert again is not None
    assert (first == again).all()
    assert (first != later).any()
    assert (first != of_other).any()
    off = (first.astype(float) - plain)[:60]
    assert abs(off.mean() - 0.02 * 255) < 0.1
    assert abs(off.std() - 0.01 * 255) < 0.2


@pytest.mark.parametrize(
    ("noise", "sigma"),
    [
        ("<type>kinect</type>", 1.425e-3 * 9.0),
        (
            "<type>realsense</type><subpixel>0.1</subpixel><baseline>0.07</baseline>",
            9.0 * 0.1 / (80.0 / np.tan(0.6) * 0.07),
        ),
    ],
    ids=["kinect", "realsense"],
)
def test_depth_is_as_wrong_as_the_models_say(camera_at: Look, noise: str, sigma: float) -> None:
    inside = f"<depth_camera><noise>{noise}</noise></depth_camera>"
    depth = camera_at(WALL, inside=inside).look(0, colours=False, depth=True).depth
    assert depth is not None
    wall = depth[:60, 10:].astype(float)
    assert np.isfinite(wall).all()
    assert np.isnan(depth[:60, 0]).all()  # the other view sees less at this side
    inverse, sigma = 1.0 / wall, sigma / 9.0  # which is what such cameras measure
    assert abs(inverse.mean() - 1.0 / 3.0) < 0.06 * sigma
    assert abs(inverse.std() / sigma - 1.0) < 0.1


@pytest.mark.parametrize(
    ("noise", "step", "baseline"),
    [
        ("<type>kinect</type>", 2.85e-3, 0.075),
        (
            "<type>realsense</type><subpixel>0.05</subpixel><baseline>0.2</baseline>",
            1.0 / (32.0 * 0.2 * 80.0 / np.tan(0.6)),
            0.2,
        ),
    ],
    ids=["kinect", "realsense"],
)
def test_depth_comes_in_steps_and_has_holes_behind_edges(
    camera_at: Look, noise: str, step: float, baseline: float
) -> None:
    near = StaticBody(
        name="near",
        T_world_body=Pose3.from_xyz_rpy((EYE[0] + 1.05, 0.0, EYE[2])),
        shapes=(Shape(geometry=Box(size=(0.1, 0.4, 0.4))),),
    )
    camera = camera_at(WALL, near, inside=f"<depth_camera><noise>{noise}</noise></depth_camera>")
    depth = camera.look(0, colours=False, depth=True).depth
    assert depth is not None
    steps = 1.0 / (depth[np.isfinite(depth)].astype(float) * step)
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    # Of the wall 3 m away, the box 1 m away hides from the other view what is to the left of it.
    f = 80.0 / np.tan(0.6)
    shadow = f * baseline * (1.0 / 1.0 - 1.0 / 3.0)
    row, left = depth[59], round(79.5 - 0.2 * f)
    holes = np.flatnonzero(np.isnan(row[40:80])) + 40
    assert abs(len(holes) - shadow) <= 2
    assert (np.diff(holes) == 1).all()
    assert abs(holes.max() - left) <= 1
    right = np.flatnonzero(np.isnan(row[80:]))
    assert len(right) <= 2  # an edge, no shadow


def test_what_is_too_near_has_no_depth(camera_at: Look) -> None:
    inside = "<depth_camera><noise><type>realsense</type><baseline>4</baseline></noise></depth_camera>"
    depth = camera_at(WALL, inside=inside).look(0, colours=False, depth=True).depth
    assert depth is not None
    assert np.isnan(depth[:60]).all()  # at 3 m the disparity is 156 pixels, and 126 are searched


def test_a_camera_faster_than_the_physics_is_refused(camera_at: Look) -> None:
    with pytest.raises(ModelError, match="samples at 600 Hz, faster than the physics"):
        camera_at(rate=600)


@pytest.mark.parametrize(
    "asked",
    [
        {"MUJOCO_GL": "osmesa" if find_library("OSMesa") else "egl"},
        pytest.param(
            {"__EGL_VENDOR_LIBRARY_DIRS": "/nowhere"},
            marks=pytest.mark.skipif(not find_library("OSMesa"), reason="OSMesa is not installed"),
        ),
    ],
    ids=["asked for", "as EGL has no driver"],
)
def test_another_process_sees_the_same_with_egl_as_with_osmesa(
    camera_at: Look, asked: dict[str, str]
) -> None:
    """OSMesa is taken where it is installed: without it MuJoCo does not start if it is asked for."""
    view = camera_at(BALL, inside=NOISE).look(0, depth=True)
    assert view.colours is not None
    assert view.depth is not None
    code = (
        "import sys; from tests.sim.cameras.conftest import BALL, built;"
        f"view = built(BALL, inside='{NOISE}').look(0, depth=True);"
        "sys.stdout.buffer.write(view.colours.tobytes() + view.depth.tobytes())"
    )
    # What is left there, as by MuJoCo's EGL, would keep OSMesa out.
    kept_out = {"PYOPENGL_PLATFORM", "MUJOCO_GL", "__EGL_VENDOR_LIBRARY_DIRS"}
    inherited = {name: value for name, value in os.environ.items() if name not in kept_out}
    other = subprocess.run(
        [sys.executable, "-c", code],
        env={
            **inherited,
            **asked,
            "PYTHONPATH": str(Path(__file__).parents[3]),
        },
        capture_output=True,
        check=False,
    )
    assert other.returncode == 0, other.stderr.decode()
    assert other.stdout == view.colours.tobytes() + view.depth.tobytes()
