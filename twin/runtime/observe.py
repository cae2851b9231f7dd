"""What the checks see each tick: the simulator's truth beside what the robots' nodes believe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from twin.geometry import Pose3
from twin.runtime.derive import GRASP_FRAME
from twin.runtime.missions import MissionHandle
from twin.runtime.robot_stack import RobotStack
from twin.scenario.observation import ContactObservation, Held, Observation, RobotObservation
from twin.sim.contacts import Contact
from twin.sim.world import World


class Observer:
    """Fills an `Observation`; names are bound once."""

    def __init__(
        self, world: World, stacks: Sequence[RobotStack], mission: MissionHandle, goods: Sequence[str]
    ) -> None:
        self._world = world
        self._stacks = stacks
        self._mission = mission
        self._goods = tuple(goods)
        self._last: dict[str, tuple[int, Pose3]] = {}
        self._fingers = {
            f"{stack.name}/{link}": stack.name
            for stack in stacks
            if stack.manipulator is not None
            for link in stack.manipulator.finger_links
        }

    def observe(self) -> Observation:
        """Return the present tick's observation."""
        world, mission = self._world, self._mission
        contacts = world.contacts()
        goods = {name: world.pose(name) for name in self._goods}
        return Observation(
            time_ns=world.time_ns,
            robots={stack.name: self._robot(stack) for stack in self._stacks},
            goods=goods,
            held=self._held(contacts, goods),
            contacts=[
                ContactObservation(
                    robot=contact.body1.partition("/")[0],
                    body=contact.body1.partition("/")[2],
                    other=contact.body2,
                    force_N=contact.force_N,
                )
                for contact in contacts
            ],
            mission_state=mission.state,
            mission_done=mission.done,
            mission_succeeded=mission.succeeded,
            mission_reason=mission.reason,
        )

    def _robot(self, stack: RobotStack) -> RobotObservation:
        pose, now = self._world.pose(stack.handle.base), self._world.time_ns
        then, before = self._last.get(stack.name, (now, pose))
        self._last[stack.name] = (now, pose)
        elapsed = (now - then) * 1e-9
        speed = float(np.hypot(*(pose.xyz - before.xyz)[:2])) / elapsed if elapsed else 0.0
        reading = stack.handle.hardware.read()
        return RobotObservation(
            pose=pose,
            estimate=stack.robot_pose.in_map(),
            odometry=stack.robot_pose.in_odom(),
            speed=speed,
            power_W=float(np.maximum(reading.effort * reading.velocity, 0.0).sum()),
            recoveries=stack.navigator.recoveries if stack.navigator is not None else 0,
        )

    def _held(self, contacts: Sequence[Contact], goods: Mapping[str, Pose3]) -> dict[str, Held]:
        """Return the goods that both fingers of a robot touch."""
        touching: dict[str, set[str]] = {}
        for contact in contacts:
            if contact.body2 in goods and contact.body1 in self._fingers:
                touching.setdefault(contact.body2, set()).add(contact.body1)
        held = {}
        for name, fingers in touching.items():
            if len(fingers) >= 2:
                robot = self._fingers[min(fingers)]
                grasp = self._world.pose(f"{robot}/{GRASP_FRAME}")
                held[name] = Held(robot=robot, T_gripper_good=grasp.inverse() @ goods[name])
        return held
