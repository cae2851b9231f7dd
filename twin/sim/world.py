"""The world: a scene and robots in one compiled MuJoCo model, and the only caller of `mj_step`."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from twin.errors import ScenarioError, nearest
from twin.files.writing import write_whole
from twin.geometry import Array, Pose2, Pose3
from twin.savings import ALL, Savings
from twin.sim.compose import FLOOR, build_spec, static_geom
from twin.sim.contacts import Contact, ContactReader, Touch
from twin.sim.divergence import DivergenceGuard
from twin.sim.hardware import Hardware
from twin.sim.physics import Physics
from twin.sim.robot import RobotHandle, RobotPlacement
from twin.sim.scene import Scene
from twin.sim.sensors import Mount, create_sensor
from twin.sim.shapes import BodyShape, shapes
from twin.sim.work import StepMeter, StepWatch, WorkMeter

if TYPE_CHECKING:
    from twin.sim.alterations import Alterations
    from twin.sim.cameras.camera import Camera
    from twin.sim.cameras.eyes import Eyes, Pictures
    from twin.sim.cameras.labels import TrueEyes


class World:
    """Owns model and data. Build one with `compose`.

    After `step`, positions are those of the present time (MuJoCo leaves them one substep old), so rays and
    poses are exact; what depends on velocities is refreshed when a sensor asks for it. Neither changes what
    the next step does.
    """

    def __init__(
        self,
        scene: Scene,
        robots: Sequence[RobotPlacement],
        physics: Physics,
        seed: int,
        *,
        crash_folder: Path | None,
        visuals: bool,
        savings: Savings,
    ) -> None:
        self._placements = tuple(robots)
        self.scene, self.physics, self.seed, self.crash_folder = scene, physics, seed, crash_folder
        self.savings = savings
        """What is not done over again."""
        self.model = build_spec(scene, robots, physics, visuals=visuals).compile()
        self.data = mujoco.MjData(self.model)
        self.timestep_ns = physics.timestep_ns
        self.step_count = 0
        """Physics steps since the start."""
        self._motion_step = self._contact_step = -1
        self._contacts: list[Contact] | None = None
        self._work_meter: StepMeter | None = None
        mujoco.mj_forward(self.model, self.data)

        self._guard = DivergenceGuard(self.model, self.data)
        self._statics = {static.name: static.T_world_body for static in scene.statics}
        self._bind_bodies()
        self._contact_reader = ContactReader(self.model, *self.geom_owners(self.model), savings)
        self.robots: Mapping[str, RobotHandle] = MappingProxyType(
            {placement.name: self._bind_robot(placement) for placement in robots}
        )

    @classmethod
    def compose(
        cls,
        scene: Scene,
        robots: Sequence[RobotPlacement],
        physics: Physics | None = None,
        seed: int = 0,
        *,
        crash_folder: Path | None = None,
        visuals: bool = False,
        savings: Savings = ALL,
    ) -> World:
        """Build and compile.

        Args:
            scene: Floor, scenery and goods.
            robots: Their elements get the prefix `<name>/`.
            physics: Options; None takes the defaults.
            seed: Of all noise in this world.
            crash_folder: Where to write the last states if the physics diverges; None writes nothing.
            visuals: Compile the robots' visual geoms too, for rendering; they cost a tenth of each step, as
                they are part of the bounding trees that collisions are found with.
            savings: What is not done over again.

        Raises:
            ScenarioError: Two things have the same name.
            ModelError: A sensor is faster than the physics.
        """
        physics = physics or Physics()
        return cls(scene, robots, physics, seed, crash_folder=crash_folder, visuals=visuals, savings=savings)

    # -- time ------------------------------------------------------------------------------------------------

    @property
    def time_ns(self) -> int:
        """Simulated time since the start [ns]."""
        return self.step_count * self.timestep_ns

    def step(self, n: int = 1) -> None:
        """Advance by `n` physics steps with constant commands.

        Raises:
            SimulationError: The physics diverged; names joint or body, time, and the file of the last states.
        """
        model, data, step, meter = self.model, self.data, mujoco.mj_step, self._work_meter
        self._guard.remember()
        if meter is None:
            step(model, data, n)
        else:
            meter.begin(n)
            for _ in range(n):
                step(model, data)
                meter.note()
        self.step_count += n
        self._guard.check(self.crash_folder)
        mujoco.mj_kinematics(model, data)

    def refresh_motion(self) -> None:
        """Bring MuJoCo's body velocities and accelerations (cvel, cacc) to the present time, once a step."""
        if self._motion_step == self.step_count:
            return
        self._motion_step = self.step_count
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_comVel(self.model, self.data)
        mujoco.mj_rnePostConstraint(self.model, self.data)

    # -- truth -----------------------------------------------------------------------------------------------

    def body_poses(self) -> tuple[Array, Array]:
        """Return xyz, shape (n, 3) [m], and quat_wxyz, shape (n, 4), of `body_names` in the world frame."""
        return self._xpos[self._body_ids], self._xquat[self._body_ids]

    def pose(self, body: str) -> Pose3:
        """Return the true pose of a link `<robot>/<link>`, of goods or of a static in the world frame.

        Raises:
            ScenarioError: No such body.
        """
        index = self._index.get(body)
        if index is not None:
            return Pose3(self._xpos[index].copy(), self._xquat[index].copy())
        if body in self._statics:
            return self._statics[body]
        raise ScenarioError(f"no body '{body}' in the world; {nearest(body, [*self._index, *self._statics])}")

    def place(self, name: str, T_world_body: Pose3) -> None:
        """Put a placed body of the scene somewhere; takes effect with the next step.

        Raises:
            ScenarioError: The scene has no such placed body.
        """
        mocap_id = self._placed.get(name)
        if mocap_id is None:
            raise ScenarioError(f"no placed body '{name}' in the scene; {nearest(name, self._placed)}")
        self.data.mocap_pos[mocap_id] = T_world_body.xyz
        self.data.mocap_quat[mocap_id] = T_world_body.quat_wxyz

    def shift(self, body: str, motion: Pose2) -> None:
        """Move goods or the root link of a robot in the plane, with the motion that it has; its joints stay.

        Args:
            body: With a free joint; another is not moved.
            motion: T_world_world, applied to the pose that it has.
        """
        free = self._free_joint(self.model.body(body).id)
        if free is None:
            return
        qpos, dof = free
        pose, speed = self.data.qpos[qpos : qpos + 7], self.data.qvel[dof : dof + 2]
        moved = Pose3.from_pose2(motion) @ Pose3(pose[:3].copy(), pose[3:].copy())
        pose[:3], pose[3:] = moved.xyz, moved.quat_wxyz
        speed[:] = Pose2(0.0, 0.0, motion.yaw).apply(speed)

    @contextmanager
    def elsewhere(self, body: str, T_world_body: Pose3) -> Iterator[None]:
        """Let goods or the root link of a robot be somewhere else while somebody looks, between two steps.

        Raises:
            ValueError: It has no free joint.
        """
        free = self._free_joint(self.model.body(body).id)
        if free is None:
            raise ValueError(f"'{body}' has no free joint")
        pose = self.data.qpos[free[0] : free[0] + 7]
        before = pose.copy()
        pose[:3], pose[3:] = T_world_body.xyz, T_world_body.quat_wxyz
        self.refresh_poses()
        try:
            yield
        finally:
            pose[:] = before
            self.refresh_poses()

    def contacts(self) -> list[Contact]:
        """Return what robots touch except for the floor and themselves, as of the last physics step."""
        reader = self._reader()
        if self._contacts is None:
            self._contacts = reader.read(self.data)
        return self._contacts

    def touches(self, body: str) -> list[Touch]:
        """Return what touches goods or a link, the floor too, point by point, as of the last physics step."""
        return self._reader().touches(self.data, body)

    def neighbours(self, body: str) -> list[str]:
        """Return the names of what `touches` would tell of, or of more; it costs less."""
        return self._reader().neighbours(self.data, body)

    def _reader(self) -> ContactReader:
        """Return who knows the contacts of the last physics step."""
        if self._contact_step != self.step_count:
            self._contact_step, self._contacts = self.step_count, None
            self._contact_reader.look(self.data)
        return self._contact_reader

    def weight(self, body: str) -> float:
        """Return the weight of goods or of a link with all that hangs on it [N]."""
        gravity = float(np.linalg.norm(self.model.opt.gravity))
        return float(self.model.body_subtreemass[self._index[body]]) * gravity

    def use_threads(self, count: int) -> None:
        """Let so many threads share each step with this one: same results, sooner where robots are apart."""
        mujoco.mju_threadpool(self.data, count)

    def go_to(self, step_count: int, qpos: Array, qvel: Array, effort: Array, placed: Array) -> None:
        """Be at a state that the same world had in another process.

        Args:
            step_count: Physics steps since the start.
            qpos: MuJoCo's positions.
            qvel: Its velocities.
            effort: Its `qfrc_actuator`.
            placed: xyz and quat_wxyz of placed bodies, shape (7 n,).
        """
        data, bodies = self.data, self.model.nmocap
        self.step_count, data.time = step_count, step_count * self.model.opt.timestep
        data.qpos[:], data.qvel[:], data.qfrc_actuator[:] = qpos, qvel, effort
        data.mocap_pos[:] = placed[: 3 * bodies].reshape(-1, 3)
        data.mocap_quat[:] = placed[3 * bodies :].reshape(-1, 4)

    def refresh_poses(self) -> None:
        """Bring poses to the present positions, as they are after each step."""
        mujoco.mj_kinematics(self.model, self.data)

    @cached_property
    def alterations(self) -> Alterations:
        """What changes the physics while a run goes on."""
        from twin.sim.alterations import Alterations

        return Alterations(self.model, self.data)

    def measure_work(self) -> None:
        """Add up the work of actuators from now on; it costs a little of each step."""
        self._work_meter = WorkMeter(self.model, self.data, tuple(self.robots))

    def watch_steps(self, callback: Callable[[], None]) -> None:
        """Call back after every single physics step from now on."""
        self._work_meter = StepWatch(callback, self._work_meter)

    def work(self, robot: str) -> float:
        """Return the mechanical work of a robot's actuators, as far as it was measured [J].

        The force on each joint times its true velocity, summed over the physics steps where it is positive:
        braking gives nothing back.
        """
        return 0.0 if self._work_meter is None else self._work_meter.work(robot)

    def shapes(self) -> list[BodyShape]:
        """Return everything there is to draw except for the floor."""
        return list(shapes(self.scene, self._placements))

    def model_to_see(self) -> mujoco.MjModel:
        """Return the same world with what is seen only, to draw it at this one's `qpos` and `mocap_pos`."""
        return self.spec_to_see().compile()

    def spec_to_see(self) -> mujoco.MjSpec:
        """Return the model to see before it is compiled, for those who add something to it."""
        from twin.sim.looks.dress import dressed

        return dressed(self.scene, self._placements, self.physics)

    def spec_of_shapes(self) -> mujoco.MjSpec:
        """Return the model to see, each shape by itself and without textures, before it is compiled."""
        return build_spec(self.scene, self._placements, self.physics)

    @cached_property
    def eyes(self) -> Eyes:
        """What draws what cameras see.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        from twin.sim.cameras.eyes import Eyes

        cameras = [camera for camera in self._cameras if not camera.spec.truth]
        return Eyes(self, self.spec_to_see(), cameras).introduce()

    @cached_property
    def true_eyes(self) -> TrueEyes:
        """What knows which things cameras see.

        Raises:
            SimulationError: Nothing can be drawn on this computer.
        """
        from twin.sim.cameras.labels import TrueEyes

        return TrueEyes(self, [camera for camera in self._cameras if camera.spec.truth])

    @property
    def pictures(self) -> Pictures | None:
        """What was drawn for cameras so far: what they see, and which things; None if nobody looked."""
        eyes, true_eyes = self.__dict__.get("eyes"), self.__dict__.get("true_eyes")
        each = [] if eyes is None else [eyes.pictures]
        each += [] if true_eyes is None else [true_eyes.eyes.pictures]
        return each[0].and_those_of(*each[1:]) if each else None

    @property
    def _cameras(self) -> list[Camera]:
        return [camera for robot in self.robots.values() for camera in robot.cameras]

    def close(self) -> None:
        """Free what the graphics driver holds for cameras. Harmless when repeated."""
        eyes, true_eyes = self.__dict__.pop("eyes", None), self.__dict__.pop("true_eyes", None)
        if eyes is not None:
            eyes.close()
        if true_eyes is not None:
            true_eyes.eyes.close()

    def geom_owners(self, model: mujoco.MjModel) -> tuple[list[str], list[int]]:
        """Return for each geom the name of its body or static, and its robot (-1: none, -2: the floor).

        `model` is the world's own, or one with the same scene and robots.
        """
        owners = [model.body(body).name for body in model.geom_bodyid]
        robot_of = {placement.name: i for i, placement in enumerate(self._placements)}
        robots = [robot_of.get(body.partition("/")[0], -1) if "/" in body else -1 for body in owners]
        for static in self.scene.statics:
            for index in range(len(static.shapes)):
                owners[model.geom(static_geom(static.name, index)).id] = static.name
        owners[model.geom(FLOOR).id], robots[model.geom(FLOOR).id] = FLOOR, -2
        return owners, robots

    def state_digest(self) -> bytes:
        """Return the SHA-256 of positions, velocities, activations, kinematic poses and time."""
        data, digest = self.data, hashlib.sha256()
        for part in (data.qpos, data.qvel, data.act, data.mocap_pos, data.mocap_quat):
            digest.update(part.tobytes())
        digest.update(self.time_ns.to_bytes(8, "little"))
        return digest.digest()

    def save_model(self, folder: Path) -> Path:
        """Write the world as `world.xml` with its meshes in `assets/`, for any MuJoCo tool."""
        folder.mkdir(parents=True, exist_ok=True)
        spec = self.spec_of_shapes()
        for name, content in spec.assets.items():
            asset = folder / "assets" / name
            asset.parent.mkdir(parents=True, exist_ok=True)
            asset.write_bytes(content if isinstance(content, bytes) else content.encode())
        spec.meshdir = spec.texturedir = "assets"
        file = folder / "world.xml"
        write_whole(file, spec.to_xml())
        return file

    # -- binding ---------------------------------------------------------------------------------------------

    def _bind_bodies(self) -> None:
        names = [self.model.body(i).name for i in range(self.model.nbody)]
        ids = [i for i in range(1, self.model.nbody) if names[i]]
        self._index = {names[i]: i for i in ids}
        self.body_names = tuple(self._index)
        """The bodies that can move, in the order of `body_poses`: links as `<robot>/<link>`, and goods."""
        self._body_ids = np.array(ids, dtype=np.intp)
        self._xpos, self._xquat = self.data.xpos, self.data.xquat  # views, made once, as in `Hardware`
        self._placed = {body.name: int(self.model.body(body.name).mocapid[0]) for body in self.scene.placed}

    def _bind_robot(self, placement: RobotPlacement) -> RobotHandle:
        name, description = placement.name, placement.conversion.description
        sensors = tuple(
            create_sensor(spec, Mount(world=self, robot=name, link=spec.link, source=description.source))
            for spec in description.sensors
        )
        hardware = Hardware(
            self.model,
            self.data,
            robot=name,
            description=description,
            seed=self.seed,
            command_latency=placement.command_latency,
            savings=self.savings,
        )
        root = self.model.body(f"{name}/{description.root}")
        return RobotHandle(
            name=name,
            description=description,
            hardware=hardware,
            sensors=sensors,
            cameras=self._bind_cameras(placement) if description.cameras else (),
            data=self.data,
            mocap_id=int(root.mocapid[0]),
            free_joint=self._free_joint(root.id),
        )

    def _bind_cameras(self, placement: RobotPlacement) -> tuple[Camera, ...]:
        from twin.sim.cameras.camera import Camera

        name, description = placement.name, placement.conversion.description
        return tuple(
            Camera(spec, Mount(world=self, robot=name, link=spec.link, source=description.source))
            for spec in description.cameras
        )

    def _free_joint(self, body: int) -> tuple[int, int] | None:
        """Return where the free joint of a body is in qpos and in qvel; None: it has none."""
        joint = int(self.model.body_jntadr[body])
        if joint < 0 or self.model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
            return None
        return int(self.model.jnt_qposadr[joint]), int(self.model.jnt_dofadr[joint])
