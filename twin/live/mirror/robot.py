"""One virtual robot beside the physical one whose namespace it shares, but for `/twin` before its own."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from twin.bridge.msgs import JointState, Odometry, PoseStamped, TFMessage, Twist, ns
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.topics import Publisher
from twin.geometry import Pose2
from twin.live.guard.client import GuardClient
from twin.live.guard.gate import Velocity
from twin.live.mirror.claim import Claim
from twin.live.mirror.divergence import DivergenceNode
from twin.live.mirror.follower import Difference, Follower, FollowerConfig
from twin.live.mirror.holding import Holding
from twin.live.mirror.label import Evidence, LabelConfig, judge
from twin.live.mirror.obedience import Obedience
from twin.live.mirror.relocalising import Relocalising
from twin.live.mirror.source import ClockChange, Source
from twin.live.mirror.status import Status
from twin.live.mirror.told import Told
from twin.live.mirror.underway import Underway
from twin.nodes.guard.verdict import Verdict
from twin.nodes.messages import pose_stamped
from twin.runtime.stacks.robot import RobotStack
from twin.sim.world import World

_PENDING = 200
_MOST_EVENTS = 10_000
_AGAIN_NS = 10_000_000_000
"""What comes with each message is told so often."""
_PRESSES_N = 10.0
"""A gripper whose drive exerts more holds something."""
_SQUEEZE = 0.1
"""The virtual one then closes by so much more [m] than fits, as hard as the physical one."""
_STUCK = 0.06
"""A virtual robot that is so far from the physical one [m], and touches something, may be held by it ..."""
_STUCK_TICKS = 5
"""... and is if it does for so long."""
_WORLD = "map"
COMMANDED = "commanded"
"""Topic, in the virtual robot's namespace, of what autonomy here commands if a guard is to pass it on."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened, for whoever watches."""

    stamp_ns: int
    """By the robot's clock."""
    what: str
    """A name: `reset`, `clock`, `pace`, `values`, `grip`, `model`, `alarm`, `localisation`."""
    text: str


class MirroredRobot:
    """`/twin/mirror`: hears the physical robot, moves the virtual one after it, tells how far it was."""

    def __init__(
        self,
        stack: RobotStack,
        world: World,
        *,
        held: Callable[[], dict[str, str]],
        guard: str | None = None,
        config: FollowerConfig | None = None,
    ) -> None:
        """Hear the robot of the stack's namespace.

        Args:
            stack: The virtual robot's nodes.
            world: It is in.
            held: Which robot holds each good.
            guard: Name of the guard's node, behind the robot's namespace, through which autonomy here
                commands the robot; None: it does by `cmd_vel`.
            config: How hard it follows.
        """
        context = stack.context
        self.stack, self.follower, self.obedience = stack, Follower(config), Obedience()
        self.node = node = context.bus.create_node("mirror", context.hardware_namespace)
        self.difference: Difference | None = None
        """The latest, before it was corrected."""
        self.heard_ns: int | None = None
        """When the latest data came, by the robot's clock."""
        self.events: deque[Event] = deque(maxlen=_MOST_EVENTS)
        """The latest."""
        self._world, self._held = world, held
        self._stepped_ns: int | None = None
        localisation = context.config.localisation
        self._is_localised_here = (
            context.layout.autonomy != "none" and localisation is not None and localisation.type != "none"
        )
        self._pending: deque[tuple[int, Pose2, Pose2 | None]] = deque(maxlen=_PENDING)
        """Time, pose in the odometry's frame, and in the map if the robot is localised."""
        self._T_odom_driven: Pose2 | None = None
        """From where the virtual robot would be without corrections, to the physical one's odometry."""
        self._driven = Pose2(0.0, 0.0, 0.0)
        """Where it would be."""
        self._stuck: dict[str, int] = {}
        """For how many ticks the virtual robot has touched what, while it was left behind."""
        self._invalid_ns: int | None = None
        """When it was told last of a transform that is no pose."""
        self._latest_ns = -1
        self._physical: Pose2 | None = None
        self._joints: dict[str, float] = {}
        self._grip = stack.manipulator.gripper_joint if stack.manipulator is not None else None
        self._grip_N = 0.0
        """What the physical gripper's drive exerts."""
        self._holding = Holding()
        commands = stack.handle.description.commands
        self._positions = {name for name, command in commands.items() if command.interface == "position"}
        space = context.namespace
        node.create_subscription(TFMessage, f"{space}/tf", self._on_tf, 100, frozen=True)
        node.create_subscription(
            JointState, f"{space}/joint_states", self._on_joints, SENSOR_DATA, frozen=True
        )
        node.create_subscription(Odometry, f"{space}/odom", self._on_odometry, 10, frozen=True)
        self._commands = node.create_subscription(
            Twist, f"{space}/cmd_vel", self._on_command, 10, frozen=True
        )
        self._relayed = node.create_publisher(Twist, "cmd_vel", 10)
        self._tick_s = context.control_period_ns * 1e-9
        self._underway = Underway[Twist](self._relay)
        self.guard: GuardClient | None = None
        if guard is not None:
            self.guard = GuardClient(node, guard=f"{space}/{guard}")
            node.create_subscription(Twist, COMMANDED, self._send, 10, frozen=True)
        self.told = Told(node, space)
        self._pose = node.create_publisher(PoseStamped, "pose", 10)
        self._claim = Claim.of(stack, world)
        self.divergence = DivergenceNode(node, stack, self._claim, self.tell)
        self._relocalising = Relocalising(node, space) if self._is_localised_here else None
        node.create_task(self._run())

    def status(self, now_ns: int, source: Source) -> Status:
        """Return how it is mirrored at a time of the robot's clock [ns]."""
        difference, heard_ns = self.difference, self.heard_ns
        clock = source.reading(self.stack.name)
        self.divergence.monitor.clock_bound_s = bound_s = clock.bound_s or 0.0
        # The virtual robot's drive hears in the next tick what is relayed in this one.
        self._underway.takes_s = max(0.0, bound_s - self._tick_s)
        acknowledged, commands = self._obeyed() if source.is_live else (False, "a bag obeys no commands")
        guarded = self.guard.status if self.guard is not None and self.guard.is_present else None
        evidence = Evidence(
            age_s=None if heard_ns is None else max(0.0, (now_ns - heard_ns) * 1e-9),
            position=None if difference is None else difference.position,
            yaw=None if difference is None else difference.yaw,
            clock_bound_s=clock.bound_s,
            clock=clock.text,
            acknowledged=acknowledged,
            commands=commands,
            doubts=(*(() if guarded is None else guarded.warnings), *self.divergence.doubts),
        )
        return Status(
            robot=self.stack.name,
            judgement=judge(evidence),
            evidence=evidence,
            virtual=self._world.pose(self.stack.handle.base).to_pose2(),
            physical=self._physical,
            clock_offset_s=clock.offset_s,
            delay_s=self.told.delay_s,
            resets=self.follower.resets,
            alarms=self.divergence.words,
            told=dict(self.told.words),
        )

    @property
    def odometry(self) -> Pose2 | None:
        """What the physical odometry tells of the start of this tick, when drives read their encoders, too.

        It is what was heard last, and what the virtual robot has driven since; None: nothing was heard.
        """
        return None if self._T_odom_driven is None else self._T_odom_driven @ self._driven

    def clock_changed(self, change: ClockChange) -> None:
        """Begin anew, where the virtual robot is, if the robot's clock was set; tell of it."""
        if change.what != "pace":
            by_ns = change.set_by_ns if change.robot is None else 0  # of several robots none has our clock
            self.follower.forget()
            self.obedience.forget()
            self._underway.forget()
            self.divergence.clock_set(by_ns)
            self._pending.clear()
            self._latest_ns = -1
            self._stepped_ns = None
            if self.heard_ns is not None:
                self.heard_ns += by_ns  # it was as long ago as before
        if change.what != "met":
            self.tell(change.what, change.text)

    def _run(self) -> Any:
        while True:
            self._step()
            yield

    def _step(self) -> None:
        now_ns, world, base = self.node.now_ns, self._world, self.stack.handle.base
        self._underway.update(now_ns)
        virtual = world.pose(base).to_pose2()
        self.follower.note(now_ns, virtual)
        self._driven = self.follower.correction.inverse() @ virtual
        self.divergence.place(now_ns, virtual, self._driven)
        if self._relocalising is not None:
            asked = self._relocalising.update(now_ns, self.divergence.monitor.lost)
            if asked:
                self.tell("localisation", asked)
        while self._pending and self._pending[0][0] <= now_ns:
            self._measure(*self._pending.popleft())
        elapsed_s = 0.0 if self._stepped_ns is None else (now_ns - self._stepped_ns) * 1e-9
        self._stepped_ns = now_ns
        resets = self.follower.resets
        moved = self.follower.step(virtual, elapsed_s)
        if self.follower.resets > resets:
            self.tell("reset", f"put {virtual.distance(moved):.2f} m away, where the physical robot is")
            self.stack.handle.carry(self.stack.standing(virtual))
        self._let_through()
        motion = moved @ virtual.inverse()
        if motion.distance(Pose2(0.0, 0.0, 0.0)) > 0.0 or motion.yaw != 0.0:
            world.shift(base, motion)
            for good in self._carried():
                world.shift(good, motion)
        self._follow_joints()
        self._pose.publish(pose_stamped(moved, _WORLD, now_ns))

    def _carried(self) -> list[str]:
        return [good for good, robot in self._held().items() if robot == self.stack.name]

    def _follow_joints(self) -> None:
        """Let joints moved by position be where the physical ones are, and the gripper press as hard."""
        hardware = self.stack.handle.hardware
        for joint, position in self._joints.items():
            if joint != self._grip:
                hardware.command(joint, position)
                continue
            presses = abs(self._grip_N) > _PRESSES_N
            hardware.limit_effort(joint, abs(self._grip_N) if presses else math.inf)
            hardware.command(joint, position + math.copysign(_SQUEEZE, self._grip_N) if presses else position)
            carried = self._carried()
            text = self._holding.update(
                self.node.now_ns, physical=presses, virtual=carried[0] if carried else None
            )
            if text is not None:
                self.tell("grip", text)

    def _let_through(self) -> None:
        """Take away what stops the virtual robot where the physical one goes on."""
        if self.difference is None or self.difference.position < _STUCK:
            self._stuck.clear()
            return
        robot, goods = f"{self.stack.name}/", {good.name for good in self._world.scene.goods}
        for contact in self._world.contacts():
            if not contact.body1.startswith(robot) or contact.body2 in goods:
                continue
            self._stuck[contact.body2] = self._stuck.get(contact.body2, 0) + 1
            if self._stuck[contact.body2] == _STUCK_TICKS:
                self.tell("model", f"{contact.body2} is in the way, but not in that of the physical robot")
            if self._stuck[contact.body2] >= _STUCK_TICKS:
                self._world.alterations.let_through(solid for _, solid in contact.geoms)

    def _measure(self, stamp_ns: int, odometry: Pose2, physical: Pose2 | None) -> None:
        follower = self.follower
        virtual = follower.virtual_at(stamp_ns)
        if virtual is not None:
            self._T_odom_driven = odometry @ virtual.inverse() @ follower.correction
        if physical is None:
            return
        is_doubted = self.divergence.monitor.doubts_localisation
        difference = self.follower.measured(stamp_ns, physical, is_doubted=is_doubted)
        if difference is None:
            return
        self.difference, self._physical = difference, physical
        self.divergence.difference(difference)

    def _on_tf(self, message: TFMessage) -> None:
        frames = self.stack.frames
        for item in message.transforms:
            if (item.header.frame_id, item.child_frame_id) != (frames.odom, frames.base):
                continue
            stamp_ns = ns(item.header.stamp)
            pose = _planar(item.transform)
            if pose is None:
                now_ns = self.node.now_ns
                if self._invalid_ns is None or not 0 <= now_ns - self._invalid_ns < _AGAIN_NS:
                    self._invalid_ns = now_ns
                    self.tell("values", f"a transform from {frames.odom} to {frames.base} that is no pose")
                continue
            self.heard_ns = self.node.now_ns
            if stamp_ns <= self._latest_ns:
                continue  # repeated, or overtaken
            self._latest_ns = stamp_ns
            self.told.late((self.node.now_ns - stamp_ns) * 1e-9)
            T_map_odom = self.stack.robot_pose.relative(frames.map, frames.odom)
            if T_map_odom is not None and self._claim is not None:
                self._claim.say(stamp_ns, T_map_odom @ pose)
            if T_map_odom is None and not self._is_localised_here:
                T_map_odom = self.stack.context.start
            self._pending.append((stamp_ns, pose, None if T_map_odom is None else T_map_odom @ pose))

    def _on_joints(self, message: JointState) -> None:
        for name, position in zip(message.name, message.position, strict=False):
            if name in self._positions and math.isfinite(position):
                self._joints[name] = position
        for name, effort in zip(message.name, message.effort, strict=False):
            if name == self._grip and math.isfinite(effort):
                self._grip_N = effort

    def _send(self, message: Twist) -> None:
        assert self.guard is not None
        self.guard.send(Velocity(message.linear.x, message.linear.y, message.angular.z))

    def _obeyed(self) -> tuple[bool, str]:
        """Return whether the robot does what is commanded from here, and in words."""
        if self.guard is None:
            return self.obedience.obeyed is True, self.obedience.text
        if not self.guard.is_present or self.guard.status is None:
            return False, "the robot's guard does not answer"
        if self.guard.status.is_stopped:
            return False, self.guard.status.words
        if self.guard.latest is None:
            return False, "nothing has been commanded through the guard"
        verdict, trip_s = self.guard.latest.said.verdict, self.guard.latest.round_trip_s
        if verdict is not Verdict.ACCEPTED:
            return False, f"the guard refuses what is commanded from here: {verdict}"
        return True, f"acknowledged by the guard, the latest in {1e3 * trip_s:.0f} ms"

    def _on_command(self, message: Twist) -> None:
        now_ns, source = self.node.now_ns, self._commands.source
        is_own = source is not None and source.gid in self._own_commands
        if is_own:
            self.obedience.command(now_ns, message.linear.x, message.angular.z)
        if not self._flows():
            return
        if is_own:
            self._underway.send(now_ns, message)
        else:  # it comes from the robot, which has it already
            self._relay(message)

    def _relay(self, message: Twist) -> None:
        self._relayed.publish(message, frozen=True)

    def _flows(self) -> bool:
        """Return whether commands reach the physical robot, as far as can be told: it is heard.

        What does not reach it is kept from the virtual one, too; without a physical one, that is commanded.
        """
        return self.heard_ns is None or self.node.now_ns - self.heard_ns < LabelConfig.fresh_s * 1e9

    @cached_property
    def _own_commands(self) -> set[bytes]:
        """Return who commands the physical robot from this process."""
        ends = [end for node in self.node.bus.nodes for end in node.endpoints]
        return {end.gid for end in ends if isinstance(end, Publisher) and end.name == self._commands.name}

    def _on_odometry(self, message: Odometry) -> None:
        twist = message.twist.twist
        self.obedience.motion(self.node.now_ns, twist.linear.x, twist.angular.z)

    def tell(self, what: str, text: str) -> None:
        """Note an event, and log it."""
        self.events.append(Event(stamp_ns=self.node.now_ns, what=what, text=text))
        self.node.get_logger().warn(f"{what}: {text}")


def _planar(transform: Any) -> Pose2 | None:
    t, q = transform.translation, transform.rotation
    if not all(map(math.isfinite, (t.x, t.y, t.z, q.x, q.y, q.z, q.w))) or q.z * q.z + q.w * q.w < 0.5:
        return None
    return Pose2(t.x, t.y, 2.0 * math.atan2(q.z, q.w))
