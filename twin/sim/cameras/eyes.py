"""Draws what the cameras of a world see."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, NamedTuple, Self, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray
from xxhash import xxh3_128

from twin.convert.sensors import add_camera
from twin.errors import SimulationError
from twin.models.specs import CameraSpec
from twin.sim.cameras.enclosure import enclosing
from twin.sim.canvas import Canvas
from twin.sim.compose import GROUP_COLLISION, GROUP_PAINT, GROUP_VISUAL

if TYPE_CHECKING:
    from twin.sim.cameras.camera import Camera
    from twin.sim.world import World

_LOG = logging.getLogger("twin.camera")
T = TypeVar("T", np.uint8, np.float32, np.intp)
SHADOW_SIZE = 2048
"""Pixels along the edge of what is drawn from where the light is: in a hall of 20 m, of 1.4 cm each."""
_NO_COLOURS, _NO_DEPTH = np.empty((0, 0, 3), np.uint8), np.empty((0, 0), np.float32)


class Pictures(NamedTuple):
    """All that was drawn of a world so far."""

    digest: str
    """Of the pixels of each, with its camera and the physics step, before lens and noise."""
    drawn: int
    """How many."""
    renderer: str
    """Who drew; another one, or another version of it, may draw other pixels."""

    def and_those_of(self, *others: Pictures) -> Pictures:
        """Return all of them as one."""
        if not others:
            return self
        digest = xxh3_128("".join(each.digest for each in (self, *others)).encode()).hexdigest()
        return Pictures(digest, self.drawn + sum(each.drawn for each in others), self.renderer)


class Eyes:
    """The same world with what is seen only, and one canvas for the images of all its cameras.

    Without MuJoCo's reflections and four samples of each pixel, and without its shadows unless the scene
    wants them: with all that an image takes thirty times as long without a graphics card.
    """

    def __init__(self, world: World, spec: mujoco.MjSpec, cameras: Sequence[Camera]) -> None:
        """Compile what the cameras see of a world, and open a canvas.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        sizes = np.array([camera.source.size for camera in cameras])
        spec.visual.global_.offwidth, spec.visual.global_.offheight = map(int, sizes.max(axis=0))
        spec.visual.quality.offsamples = 0
        spec.visual.quality.shadowsize = SHADOW_SIZE if world.scene.shadows else 0
        for number, camera in enumerate(cameras):
            source, body = camera.source, spec.body(camera.mount.body)
            for side, turn in enumerate(source.turns):
                pose, name = camera.spec.T_link_sensor @ turn, f"camera {number}.{side}"
                add_camera(body, name, pose, source.size, source.focal_lengths, source.centre)
        self._world, self.model = world, spec.compile()
        self._data = mujoco.MjData(self.model)
        self._canvas = Canvas(self.model, *map(int, sizes.max(axis=0)))
        self._process = os.getpid()
        self._scene = mujoco.MjvScene(self.model, self.model.ngeom + 100)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = world.scene.shadows
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0
        self._views = {
            id(camera): [self._view(f"camera {number}.{side}") for side in range(len(camera.source.turns))]
            for number, camera in enumerate(cameras)
        }
        self._enclosed: set[int] = set()
        self._step = -1
        self.drawn = 0
        """How many pictures."""
        self._hash = xxh3_128()
        self.renderer = self._canvas.renderer
        """Who draws, as OpenGL calls it."""
        self._words = ", ".join(_words(camera.spec) for camera in cameras)

    def look(
        self, camera: Camera, *, colours: bool, depth: bool
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return what a camera of the world sees now, at the size of its source; what is not asked is empty.

        Of a source with several views they are below each other.

        Returns:
            Red, green and blue, shape (height, width, 3); z along the optical axis [m], shape (height,
            width), nan where nothing is between its clipping planes.

        Raises:
            SimulationError: The process is a fork of the one that opened the canvas.
        """
        near, far = self._turn_to(camera)
        self._look_around(camera)
        self.drawn += colours + depth
        size, seen, distances = camera.source.size, _NO_COLOURS, _NO_DEPTH
        if colours:
            views = self._views_of(camera, paint=True)
            seen = _below([self._canvas.draw(scene, *size) for scene in views])
        if depth:
            views = self._views_of(camera, paint=False)
            distances = _below([_metres(self._canvas.nearness(scene, *size), near, far) for scene in views])
        self._add(camera, seen, distances)
        return seen, distances

    def look_for_rays(self, camera: Camera, nearness: NDArray[np.float32]) -> None:
        """Find 1 / z [1/m] of what rays would hit, which are collision shapes; 0 where they hit nothing.

        Args:
            camera: Of these eyes.
            nearness: Where it goes, shape (height, width).

        Raises:
            SimulationError: The process is a fork of the one that opened the canvas.
        """
        near, far = self._turn_to(camera)
        self.drawn += 1
        groups, before = self._options.geomgroup, self._options.geomgroup.copy()
        groups[GROUP_VISUAL], groups[GROUP_COLLISION] = 0, 1
        (scene,) = self._views_of(camera, paint=False)
        groups[:] = before
        drawn = self._canvas.nearness(scene, *camera.source.size)
        # OpenGL's depth is linear in 1 / z: 1 at `near`, and 0 at `far`.
        np.multiply(drawn, 1.0 / near - 1.0 / far, out=nearness)
        np.add(nearness, 1.0 / far, out=nearness, where=drawn > 0.0)

    def geoms(self, camera: Camera) -> NDArray[np.intp]:
        """Return the geom that each pixel of the source shows, shape (height, width); -1 where none is.

        Raises:
            SimulationError: The process is a fork of the one that opened the canvas.
        """
        self._turn_to(camera)
        self._look_around(camera)
        self.drawn += 1
        size, views = camera.source.size, self._views_of(camera, paint=True)
        found = _below([_shown(scene)[self._canvas.numbers(scene, *size)] for scene in views])
        self._add(camera, found)
        return found

    def introduce(self) -> Self:
        """Tell, once in a process, what is drawn and who does it."""
        _tell(f"{self._words}: drawn by {self.renderer}; docs/cameras.md tells what that costs a run")
        return self

    @property
    def pictures(self) -> Pictures:
        """What was drawn so far."""
        return Pictures(self._hash.hexdigest(), self.drawn, self.renderer)

    def close(self) -> None:
        """Free what the graphics driver holds. Harmless when repeated."""
        self._canvas.close()

    def _add(self, camera: Camera, *pictures: NDArray[np.generic]) -> None:
        self._hash.update(f"{camera.mount.body} {camera.spec.name} {self._step}".encode())
        for picture in pictures:
            self._hash.update(np.ascontiguousarray(picture).data)

    def _turn_to(self, camera: Camera) -> tuple[float, float]:
        """Have the world as it is now between the clipping planes [m] of a camera; return those."""
        if os.getpid() != self._process:
            raise SimulationError("a fork of a run has no OpenGL, and its cameras see nothing")
        self._take_state()
        near, far = camera.spec.near, camera.spec.far
        clip, extent = self.model.vis.map, self.model.stat.extent
        clip.znear, clip.zfar = near / extent, far / extent
        return near, far

    @cached_property
    def _owners(self) -> list[str]:
        """Whose each geom of the world is: a robot's, or that of a body or static."""
        names, robots = self._world.geom_owners(self._world.model)
        known = list(self._world.robots)
        return [name if robot < 0 else known[robot] for name, robot in zip(names, robots, strict=True)]

    def _look_around(self, camera: Camera) -> None:
        """Tell, once for each camera, that it has come into something that is not of its own robot."""
        if id(camera) in self._enclosed:
            return
        world, name = self._world, camera.mount.robot
        point = self._data.cam_xpos[self._views[id(camera)][0].fixedcamid]
        for geom in enclosing(world.model, world.data, point):
            owner = self._owners[geom]  # mostly the robot that carries it, so this is asked for each picture
            if owner != name:
                self._enclosed.add(id(camera))
                said = f"camera '{camera.spec.name}' of {name} is inside {owner}"
                _LOG.warning("%s: its pictures show what is behind it", said)
                return

    def _views_of(self, camera: Camera, *, paint: bool) -> Iterator[mujoco.MjvScene]:
        """Yield what is to be drawn, view by view; paint has no depth, as it is nothing to rays."""
        self._options.geomgroup[GROUP_PAINT] = paint
        model, options, everything = self.model, self._options, mujoco.mjtCatBit.mjCAT_ALL
        scene, views = self._scene, self._views[id(camera)]
        for view in views:
            mujoco.mjv_updateScene(model, self._data, options, None, view, everything, scene)
            for light in scene.lights[: scene.nlight]:
                if light.headlight:  # which shines where the camera looks, in all its views
                    light.dir = -self._data.cam_xmat[views[0].fixedcamid].reshape(3, 3)[:, 2]
            yield scene

    def _take_state(self) -> None:
        """Have everything where it is in the world."""
        world, data, model = self._world, self._data, self.model
        if self._step == world.step_count:
            return
        self._step = world.step_count
        data.qpos[:] = world.data.qpos
        data.mocap_pos[:], data.mocap_quat[:] = world.data.mocap_pos, world.data.mocap_quat
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)

    def _view(self, name: str) -> mujoco.MjvCamera:
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FIXED
        view.fixedcamid = self.model.camera(name).id
        return view


def _words(spec: CameraSpec) -> str:
    return f"camera '{spec.name}', {spec.lens.width} x {spec.lens.height} at {spec.rate_hz:g} Hz"


@cache
def _tell(line: str) -> None:
    """Tell once in a process, not to /rosout: who looks changes no run."""
    _LOG.info(line)


def _below(views: list[NDArray[T]]) -> NDArray[T]:
    return views[0] if len(views) == 1 else np.concatenate(views)


def _shown(scene: mujoco.MjvScene) -> NDArray[np.intp]:
    """Return the geom that each number of a picture stands for; -1 of 0, which is none."""
    shown = np.full(scene.ngeom + 1, -1, np.intp)
    for geom in scene.geoms[: scene.ngeom]:
        if geom.segid >= 0 and geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
            shown[geom.segid + 1] = geom.objid
    return shown


def _metres(nearness: NDArray[np.float32], near: float, far: float) -> NDArray[np.float32]:
    """Return z [m] of a depth buffer; nan where it is the far plane's.

    OpenGL's is hyperbolic: 1 at `near` and 0 at `far`, as MuJoCo turns it around for precision's sake.
    """
    z = nearness.astype(np.float64)
    z *= far - near
    z += near
    np.divide(near * far, z, out=z)
    z[nearness <= 0.0] = np.nan
    return z.astype(np.float32)
