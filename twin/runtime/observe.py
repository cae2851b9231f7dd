"""What the checks see each tick: the simulator's truth beside what the robots' nodes believe."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from twin.geometry import Pose3
from twin.runtime.defaults.from_description import GRASP_FRAME
from twin.runtime.on_demand import ON_DEMAND
from twin.runtime.payload import Payload
from twin.runtime.stacks.missions import AnyMission
from twin.runtime.stacks.robot import RobotStack
from twin.scenario.observation import ContactObservation, Held, Observation, RobotObservation
from twin.sim.contacts import Contact
from twin.sim.world import World

_MOVED, _TURNED = 0.01, 0.05
"""What has settled on the floor has come less far than this [m] and turned by less [rad]."""
_COS_HALF_TURNED = math.cos(_TURNED / 2.0)


class Observer:
    """Gathers what must not be missed at every control tick, and fills an `Observation` now and then."""

    def __init__(
        self,
        world: World,
        stacks: Sequence[RobotStack],
        mission: AnyMission,
        goods: Sequence[str],
        needs: Collection[str] = (),
    ) -> None:
        """Bind to a run; `needs` are the fields of `RobotObservation` that are only computed if asked for."""
        self._world = world
        self._stacks = stacks
        self._mission = mission
        self._goods = tuple(goods)
        self._needed = {name: reader(world, stacks) for name, reader in ON_DEMAND.items() if name in needs}
        self._last: dict[str, tuple[int, Pose3]] = {}
        self._payload = Payload(world, self._goods)
        self._contacts: dict[tuple[str, str], Contact | ContactObservation] = {}
        """The hardest since the last observation of each pair that touches, those of what is carried too."""
        self._start = world.body_poses()
        self._roots = [name.partition("/")[0] for name in world.body_names]
        self._still = np.ones(len(self._roots), dtype=bool)
        self._still_poses = b""
        self._moved: frozenset[str] = frozenset()
        self._fingers = {
            f"{stack.name}/{link}": stack.name
            for stack in stacks
            if stack.manipulator is not None
            for link in stack.manipulator.finger_links
        }

    def gather(self) -> None:
        """Note the contacts of the present control tick."""
        hardest = self._contacts
        for contact in self._world.contacts():
            pair = contact.body1, contact.body2
            if pair not in hardest or contact.force_N > hardest[pair].force_N:
                hardest[pair] = contact
        for carried in self._payload.contacts():
            pair = f"{carried.robot}/{carried.body}", carried.other
            if pair not in hardest or carried.force_N > hardest[pair].force_N:
                hardest[pair] = carried

    def observe(self) -> Observation:
        """Return the present state, with the contacts since the last observation."""
        world, mission = self._world, self._mission
        goods = {name: world.pose(name) for name in self._goods}
        observation = Observation(
            time_ns=world.time_ns,
            robots={stack.name: self._robot(stack) for stack in self._stacks},
            goods=goods,
            held=self._held(goods),
            contacts=tuple(map(_observed, self._contacts.values())),
            moved=self._note_moved(),
            mission_state=mission.state,
            mission_done=mission.done,
            mission_succeeded=mission.succeeded,
            mission_reason=mission.reason,
        )
        self._contacts.clear()
        return observation

    def _robot(self, stack: RobotStack) -> RobotObservation:
        pose, now = self._world.pose(stack.handle.base), self._world.time_ns
        then, before = self._last.get(stack.name, (now, pose))
        self._last[stack.name] = (now, pose)
        elapsed = (now - then) * 1e-9
        speed = math.dist(pose.xyz[:2].tolist(), before.xyz[:2].tolist()) / elapsed if elapsed else 0.0
        navigator = stack.navigator
        return RobotObservation(
            pose=pose,
            estimate=stack.robot_pose.in_map(),
            odometry=stack.robot_pose.in_odom(),
            speed=speed,
            goals=navigator.goals if navigator is not None else 0,
            recoveries=navigator.recoveries if navigator is not None else 0,
            recovering=navigator is not None and navigator.recovering,
            goal=navigator.goal if navigator is not None else None,
            map=stack.slam.map if stack.slam is not None else None,
            **{name: read(stack.name) for name, read in self._needed.items()},
        )

    def _note_moved(self) -> frozenset[str]:
        xyz, quat_wxyz = self._world.body_poses()
        poses = xyz[self._still].tobytes() + quat_wxyz[self._still].tobytes()
        if poses == self._still_poses and self._world.savings.unchanged_truth:
            return self._moved
        self._still_poses = poses
        xyz -= self._start[0]
        came = np.einsum("ij,ij->i", xyz, xyz) > _MOVED**2
        turned = np.abs(np.einsum("ij,ij->i", quat_wxyz, self._start[1])) < _COS_HALF_TURNED
        new = (came | turned) & self._still
        if new.any():
            self._still &= ~new
            self._moved |= {self._roots[i] for i in np.flatnonzero(new)}
        return self._moved

    def holders(self) -> dict[str, str]:
        """Return which robot holds each good that both its fingers touch."""
        touching: dict[str, set[str]] = {}
        for contact in self._world.contacts():
            if contact.body2 in self._goods and contact.body1 in self._fingers:
                touching.setdefault(contact.body2, set()).add(contact.body1)
        return {name: self._fingers[min(fingers)] for name, fingers in touching.items() if len(fingers) >= 2}

    def _held(self, goods: Mapping[str, Pose3]) -> dict[str, Held]:
        held = {}
        for name, robot in self.holders().items():
            grasp = self._world.pose(f"{robot}/{GRASP_FRAME}")
            held[name] = Held(robot=robot, T_gripper_good=grasp.inverse() @ goods[name])
        return held


def _observed(contact: Contact | ContactObservation) -> ContactObservation:
    if isinstance(contact, ContactObservation):
        return contact
    robot, _, body = contact.body1.partition("/")
    return ContactObservation(robot=robot, body=body, other=contact.body2, force_N=contact.force_N)
