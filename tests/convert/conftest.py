"""A robot alone on a plane, stepped with the physics options of `twin.sim`."""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from twin.convert import convert
from twin.geometry import Pose2, Pose3
from twin.models.description import RobotDescription

DT = 0.002


class BareWorld:
    """A plane, one robot named `r`, optionally a tote on a box."""

    def __init__(
        self, description: RobotDescription, *, tote: Pose3 | None = None, tote_mass: float = 2.5
    ) -> None:
        self.conversion = convert(description, timestep=DT)
        self.description = description
        spec = mujoco.MjSpec()
        spec.option.timestep = DT
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 100.0
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20, 20, 1], friction=[0.8, 0.005, 1e-4]
        )
        if tote is not None:
            self._add_tote(spec, tote, tote_mass)
        frame = spec.worldbody.add_frame()
        spec.attach(self.conversion.spec.copy(), prefix="r/", frame=frame)
        spec.body(f"r/{description.root}").pos = [0, 0, self.conversion.spawn_height]
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def _add_tote(self, spec: mujoco.MjSpec, tote: Pose3, mass: float) -> None:
        x, y, z = tote.xyz
        top = z - 0.09
        box = mujoco.mjtGeom.mjGEOM_BOX
        solref = [0.004, 1.0]
        # narrower than the tote, so that the fingers pass beside it
        spec.worldbody.add_geom(
            name="shelf", type=box, size=[0.1, 0.1, top / 2], pos=[x, y, top / 2], solref=solref
        )
        body = spec.worldbody.add_body(name="tote", pos=tote.xyz, quat=tote.quat_wxyz)
        body.add_freejoint()
        body.add_geom(
            name="tote",
            type=box,
            size=[0.15, 0.12, 0.09],
            mass=mass,
            solref=solref,
            friction=[0.8, 0.005, 1e-4],
        )

    def step(self, seconds: float) -> None:
        mujoco.mj_step(self.model, self.data, round(seconds / DT))

    def command(self, joint: str, value: float) -> None:
        self.data.ctrl[self.model.actuator(f"r/{joint}").id] = value

    def position(self, joint: str) -> float:
        return float(self.data.qpos[self.model.joint(f"r/{joint}").qposadr[0]])

    def place(self, positions: dict[str, float]) -> None:
        """Put joints, and the actuators that hold them, at positions; followers as well."""
        from twin.models.kinematics import joint_positions

        for name, value in joint_positions(self.description, positions).items():
            if self.description.joints[name].type == "fixed":
                continue
            self.data.qpos[self.model.joint(f"r/{name}").qposadr[0]] = value[0]
            if name in self.description.commands:
                self.command(name, value[0])
        mujoco.mj_forward(self.model, self.data)

    def pose(self, link: str | None = None) -> Pose3:
        """Return `T_world_link`; of the root by default."""
        body = self.data.body(f"r/{link or self.description.root}")
        return Pose3(body.xpos.copy(), body.xquat.copy())

    def travel(self, seconds: float, *, v: float = 0.0, w: float = 0.0, ramp: float = 0.5) -> float:
        """Drive by ideal wheel speeds with trapezoidal ramps, then stand still; return the angle turned.

        `seconds` is the time at full speed plus one ramp, so that the ideal distance is v · seconds.
        """
        drive = self.description.drive
        assert drive is not None
        turned, last = 0.0, self.pose().to_pose2().yaw
        control = 0.02
        for tick in range(round((seconds + ramp + 1.0) / control)):
            now = tick * control
            scale = max(0.0, min(1.0, now / ramp, (seconds + ramp - now) / ramp))
            for side, joints in ((-1, drive.left_joints), (1, drive.right_joints)):
                speed = scale * (v + side * w * drive.wheel_separation / 2) / drive.wheel_radius
                for joint in joints:
                    self.command(joint, speed)
            self.step(control)
            yaw = self.pose().to_pose2().yaw
            turned += (yaw - last + math.pi) % (2 * math.pi) - math.pi
            last = yaw
        return turned

    def move(self, joint: str, goal: float) -> None:
        """Ramp a position command at the joint's velocity limit, then wait for it to settle."""
        start = float(self.data.ctrl[self.model.actuator(f"r/{joint}").id])
        speed = self.description.joints[joint].limit.velocity
        assert speed is not None
        ticks = max(1, math.ceil(abs(goal - start) / speed / 0.02))
        for tick in range(1, ticks + 1):
            self.command(joint, start + (goal - start) * tick / ticks)
            self.step(0.02)
        self.step(0.5)

    def T_grasp_tote(self) -> Pose3:
        tote = self.data.body("tote")
        return self.pose("grasp_frame").inverse() @ Pose3(tote.xpos.copy(), tote.xquat.copy())

    def self_contacts(self) -> list[tuple[str, str]]:
        """Return the pairs of the robot's bodies that touch each other."""
        pairs = []
        for contact in self.data.contact[: self.data.ncon]:
            names = [self.model.body(self.model.geom_bodyid[geom]).name for geom in contact.geom]
            if contact.dist < 0.0 and all(name.startswith("r/") for name in names):
                pairs.append((names[0], names[1]))
        return pairs


def straight_error(world: BareWorld) -> float:
    """Drive 5 m forward; return how far from there the robot ends [m]."""
    world.step(0.5)
    start = world.pose().to_pose2()
    world.travel(10.0, v=0.5)
    goal = start @ Pose2(5.0, 0.0, 0.0)
    return goal.distance(world.pose().to_pose2())


def spin_error(world: BareWorld) -> float:
    """Turn a full circle on the spot; return how far the angle misses it [rad]."""
    world.step(0.5)
    return world.travel(2 * math.pi, w=1.0) - 2 * math.pi


@pytest.fixture
def bare_world() -> Callable[..., BareWorld]:
    return BareWorld


@pytest.fixture
def driving() -> tuple[Callable[[BareWorld], float], Callable[[BareWorld], float]]:
    return straight_error, spin_error


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)
