"""How far off what a camera finds on a shelf is: boxes of any size and colour against where they stand.

Each picture is of another shelf: one to four boxes, some that touch, on a board of a rack, seen by a camera
like that of `warehouse_bot`'s palm, with its noise.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("MUJOCO_GL", "egl")  # before MuJoCo is imported, which chooses its renderer then

import numpy as np

from twin.convert import convert
from twin.geometry import Array, Pose2, Pose3, wrap_angle
from twin.models.loader import parse_urdf
from twin.models.optical_frames import T_CAMERA_OPTICAL
from twin.perception.boxes.detector import Box, BoxesConfig, ColourDepthBoxes, DepthBoxes
from twin.perception.boxes.picture import Picture
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Rgba, Scene, Shape, StaticBody
from twin.sim.world import World
from twin.warehouse.arena_file import RackEntry
from twin.warehouse.arena_scene import box, carton_shapes, rack_body, tote_shapes

LEVEL, EYE = 0.8, 0.122
"""Height of the board, and of the camera above it [m]."""
RACK_Y, LENGTH = 0.35, 6.0
"""Where the middle of the rack is, and its length [m]."""
POSTS = [RACK_Y + float(y) for y in np.linspace(-1.0, 1.0, 3) * (LENGTH - 0.05) / 2.0]
BOARD: Rgba = (0.80, 0.81, 0.80, 1.0)
URDF = """<robot name="mast"><link name="base">
<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1"/></inertial></link>
<gazebo reference="base"><sensor name="camera" type="rgbd_camera"><pose>0 0 {z} 0 0 0</pose>
<update_rate>10</update_rate><camera><horizontal_fov>1.2</horizontal_fov>
<image><width>{width}</width><height>{height}</height><format>R8G8B8</format></image>
<clip><near>0.05</near><far>20</far></clip><noise><stddev>0.007</stddev></noise>
<depth_camera><noise><type>{noise}</type></noise></depth_camera></camera></sensor></gazebo></robot>"""


@dataclass(frozen=True, kw_only=True)
class Goods:
    """A box that stands there."""

    front: Pose2
    """The middle of its front, x into it, in the world; the camera is at the origin and looks along x."""
    size: tuple[float, float, float]
    """Depth, width and height [m]."""
    shapes: tuple[Shape, ...]
    touches: bool
    """Whether one stands flush beside it."""

    @property
    def corners(self) -> Array:
        """Of its footprint, front left and right first, shape (4, 2)."""
        depth, width, _ = self.size
        half = width / 2.0
        return self.front.apply([(0.0, half), (0.0, -half), (depth, -half), (depth, half)])


def drawn(draw: np.random.Generator, distance: float) -> Iterator[Goods]:
    """Yield the boxes of one shelf whose front edge is so far away [m]."""
    front, width = Pose2(0.0, 0.0, 0.0), 0.0
    left = draw.uniform(-0.35, 0.0)
    for number in range(int(draw.integers(1, 5))):
        make = int(draw.integers(3))
        # Totes and cartons have a label of one size, which has to fit.
        least = ((0.12, 0.1), (0.2, 0.12), (0.08, 0.05))[make]
        size = (draw.uniform(0.15, 0.4), draw.uniform(least[0], 0.4), draw.uniform(least[1], 0.26))
        rgba: Rgba = BOARD if draw.random() < 0.2 else (*draw.uniform(0.05, 0.95, 3).tolist(), 1.0)
        touches = number > 0 and bool(draw.random() < 0.5)
        if touches:
            front = front @ Pose2(0.0, (width + size[1]) / 2.0, 0.0)
        else:
            yaw = math.radians(draw.uniform(-20.0, 20.0) if draw.random() < 0.4 else draw.uniform(-4.0, 4.0))
            half = size[1] / 2.0 * math.cos(yaw)
            left += draw.uniform(0.06, 0.25) + size[0] * max(0.0, math.sin(yaw))
            inset = draw.uniform(0.03, 0.1) + size[1] / 2.0 * abs(math.sin(yaw))
            front = Pose2(distance + inset, left + half, yaw)
        width = size[1]
        makes = tote_shapes(size, rgba), carton_shapes(size), (box(size, (0.0, 0.0, 0.0), rgba),)
        yield Goods(front=front, size=size, shapes=makes[make], touches=touches)
        left = float(Goods(front=front, size=size, shapes=(), touches=False).corners[:, 1].max())


def is_in_sight(goods: Goods, others: list[Goods], edge: float, spread: float, up: float) -> bool:
    """Return whether all of a box's front is in the picture, and nothing before its edges.

    Args:
        goods: The box.
        others: All that are there.
        edge: Distance of the shelf's front edge [m].
        spread: Tangent of half the field of view.
        up: Likewise, upwards.
    """
    (x0, y0), (x1, y1) = goods.corners[:2]
    if max(abs(y0 / x0), abs(y1 / x1)) > spread or goods.size[2] - EYE > up * min(x0, x1):
        return False
    inner = goods.front.apply([(0.0, s * (goods.size[1] / 2.0 - 0.004)) for s in np.linspace(-1.0, 1.0, 9)])
    solids = [_post(edge, y) for y in POSTS] + [other.corners for other in others if other is not goods]
    return not any(_hides(solid, point) for solid in solids for point in inner)


def _post(edge: float, y: float) -> Array:
    return np.array(
        [(edge + x, y + side) for x, side in ((0, 0.025), (0, -0.025), (0.05, -0.025), (0.05, 0.025))]
    )


def _hides(corners: Array, point: Array) -> bool:
    for a, b in zip(corners, np.roll(corners, 1, axis=0), strict=True):
        along = np.stack((point, a - b), axis=1)
        if abs(np.linalg.det(along)) > 1e-9:
            t, s = np.linalg.solve(along, a)
            if 0.0 < t < 0.999 and 0.0 <= s <= 1.0:
                return True
    return False


def picture(shelf: list[Goods], distance: float, options: Any, seed: int) -> Picture:
    """Return what the camera sees of a shelf."""
    height = options.width * 3 // 4
    text = URDF.format(z=LEVEL + EYE, width=options.width, height=height, noise=options.noise)
    mast = RobotPlacement(
        name="mast",
        conversion=convert(parse_urdf(text, Path("mast.urdf")), base="fixed"),
        pose=Pose3.from_xyz_rpy(),
    )
    entry = RackEntry(
        pose=(distance + 0.3, RACK_Y, math.pi), length=LENGTH, depth=0.6, levels=(0.4, 0.8, 1.2)
    )
    wall = StaticBody(
        name="wall",
        T_world_body=Pose3.from_xyz_rpy((distance + 2.0, 0.0, 1.0)),
        shapes=(box((0.1, 9.0, 2.0), (0.0, 0.0, 0.0), (0.86, 0.87, 0.88, 1.0), "plaster"),),
    )
    stock = tuple(
        StaticBody(
            name=f"goods_{number}",
            T_world_body=Pose3.from_pose2(
                goods.front @ Pose2(goods.size[0] / 2.0, 0.0, math.pi), LEVEL + goods.size[2] / 2.0
            ),
            shapes=goods.shapes,
        )
        for number, goods in enumerate(shelf)
    )
    world = World.compose(
        Scene(name="shelf", statics=(rack_body("rack", entry), wall, *stock)), [mast], seed=seed
    )
    try:
        camera = world.robots["mast"].cameras[0]
        seen = camera.look(0, colours=True, depth=True)
        assert seen.depth is not None
        return Picture(
            depth=seen.depth,
            colours=seen.colours,
            matrix=camera.spec.lens.matrix,
            T_base_camera=Pose3.from_xyz_rpy((0.0, 0.0, LEVEL + EYE)) @ T_CAMERA_OPTICAL,
        )
    finally:
        world.close()


@dataclass
class Tally:
    """What was found of what is there."""

    errors: list[tuple[float, ...]]
    """Of position [mm], yaw [degrees], width and height [mm], and depth or nan."""
    there: int = 0
    missed: int = 0
    phantoms: int = 0

    def take(self, found: list[Box], shelf: list[Goods], wanted: list[Goods]) -> None:
        """Compare."""
        left = list(found)
        for goods in wanted:
            self.there += 1
            near = [b for b in left if b.face.distance(goods.front) < 0.03 + goods.size[1] / 4.0]
            if not near:
                self.missed += 1
                continue
            best = min(near, key=lambda b: b.face.distance(goods.front))
            left = [b for b in left if b is not best]
            self.errors.append(
                (
                    1e3 * best.face.distance(goods.front),
                    math.degrees(abs(wrap_angle(best.face.yaw - goods.front.yaw))),
                    1e3 * abs(best.width - goods.size[1]),
                    1e3 * abs(best.height - goods.size[2]),
                    math.nan if best.depth is None else 1e3 * abs(best.depth - goods.size[0]),
                )
            )
        self.phantoms += sum(
            min(goods.front.distance(b.face) for goods in shelf) > 0.03 + b.width / 4.0 for b in left
        )

    def told(self) -> str:
        """Return a line."""
        if not self.errors:
            return f"{self.there} there, none found"
        columns = np.array(self.errors).T
        words = [f"{self.there} there, {self.missed} missed, {self.phantoms} phantoms"]
        for name, values in zip(("position", "yaw", "width", "height", "depth"), columns, strict=True):
            known = values[np.isfinite(values)]
            if len(known):
                middle, most = np.quantile(known, (0.5, 0.9))
                words.append(f"{name} {middle:.1f} {most:.1f} {known.max():.1f} ({len(known)})")
        return "; ".join(words)


def main() -> None:
    """Print medians, 90 % and worst of errors for boxes that stand alone, and for those that touch."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shelves", type=int, default=200, help="pictures (default: 200)")
    parser.add_argument("--width", type=int, default=320, help="of the picture in pixels (default: 320)")
    parser.add_argument("--noise", default="realsense", help="none, realsense or kinect (default: realsense)")
    parser.add_argument("--near", type=float, default=0.45, help="to the shelf's edge, least [m]")
    parser.add_argument("--far", type=float, default=0.95, help="and most [m]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--picture", type=Path, help="draw the last shelf, with what is found, into this file"
    )
    options = parser.parse_args()
    detectors = {"depth": DepthBoxes(BoxesConfig()), "colours and depth": ColourDepthBoxes(BoxesConfig())}
    tallies = {(name, kind): Tally([]) for name in detectors for kind in ("alone", "touching")}
    empty = dict.fromkeys(detectors, 0)
    draw = np.random.default_rng(options.seed)
    spread = math.tan(0.6) * 0.97
    for number in range(options.shelves):
        distance = draw.uniform(options.near, options.far)
        shelf = list(drawn(draw, distance)) if number % 10 else []
        seen = picture(shelf, distance, options, number)
        beside = [g.touches or (i + 1 < len(shelf) and shelf[i + 1].touches) for i, g in enumerate(shelf)]
        for name, detector in detectors.items():
            found = [b for b in detector.detect(seen) if b.is_whole and b.score >= detector.config.min_score]
            if not shelf:
                empty[name] += len(found)
            wanted = [g for g in shelf if is_in_sight(g, shelf, distance, spread, 0.75 * spread)]
            kinds = {id(g): "touching" if b else "alone" for g, b in zip(shelf, beside, strict=True)}
            for kind in ("alone", "touching"):
                mine = [g for g in wanted if kinds[id(g)] == kind]
                rest = [b for b in found if _kind_of(b, shelf, kinds) == kind]
                tallies[name, kind].take(rest, shelf, mine)
    if options.picture:
        draw_picture(seen, list(detectors["colours and depth"].detect(seen)), options.picture)
    for (name, kind), tally in tallies.items():
        sys.stdout.write(f"{name}, {kind}: {tally.told()}\n")
    sys.stdout.write(f"on empty shelves: {empty}\n")


def draw_picture(seen: Picture, boxes: list[Box], file: Path) -> None:
    """Write the picture with a frame around each front: green, or red of what is not whole."""
    from PIL import Image, ImageDraw

    assert seen.colours is not None
    height, width = seen.depth.shape
    scale = 2
    image = Image.fromarray(seen.colours).resize((scale * width, scale * height))
    pen = ImageDraw.Draw(image)
    for found in boxes:
        y, z = found.width / 2.0, found.height / 2.0
        corners = found.front.apply([(0, y, -z), (0, y, z), (0, -y, z), (0, -y, -z), (0, y, -z)])
        at = seen.T_base_camera.inverse().apply(corners) @ seen.matrix.T
        pixels = scale * (at[:, :2] / at[:, 2:]) + 0.5
        colour = (20, 230, 60) if found.is_whole else (240, 30, 30)
        pen.line([tuple(pixel) for pixel in pixels.tolist()], fill=colour, width=3)
        size = f"{1e3 * found.width:.0f} x {1e3 * found.height:.0f}"
        pen.text(tuple((pixels[1] + (6, 4)).tolist()), size, fill=(255, 255, 255), font_size=15)
    image.save(file, quality=88)


def _kind_of(found: Box, shelf: list[Goods], kinds: dict[int, str]) -> str:
    if not shelf:
        return "alone"
    return kinds[id(min(shelf, key=lambda goods: goods.front.distance(found.face)))]


if __name__ == "__main__":
    main()
