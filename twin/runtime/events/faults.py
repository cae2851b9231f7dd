"""What goes wrong during a run happens here: where hardware would fail, never inside a node."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from twin.bridge.bus import Bus
from twin.errors import ScenarioError, nearest
from twin.nodes.sensor_publishers import SensorPublisher
from twin.runtime.stacks.robot import RobotStack
from twin.scenario.faults import Displacement, EncoderFault, FaultEntry, Kidnapping, LidarFault, OdometryJump
from twin.sensors.failing import FailingLidar
from twin.sensors.lidar import Lidar
from twin.sim.world import World


class _Event(NamedTuple):
    """Something that happens to the hardware at a time."""

    time_ns: int
    text: str
    """For the log."""
    happen: Callable[[], None]


class FaultSchedule:
    """Lets faults happen at their time and tells them in the log of `/faults`."""

    def __init__(
        self, world: World, bus: Bus, stacks: Mapping[str, RobotStack], faults: Sequence[FaultEntry]
    ) -> None:
        """Prepare the hardware.

        Raises:
            ScenarioError: A robot lacks what is to fail.
        """
        self._world = world
        events = [event for fault in faults for event in _events(fault, stacks)]
        self._events = sorted(events, key=lambda event: event.time_ns)
        self._logger = bus.create_node("faults").get_logger() if events else None

    def update(self, *, tell: bool = True) -> None:
        """Let happen what is due at the world's time, and tell it; takes effect with the next step."""
        while self._events and self._events[0].time_ns <= self._world.time_ns:
            event = self._events.pop(0)
            event.happen()
            if self._logger is not None and tell:
                self._logger.warn(event.text)


def _events(entry: FaultEntry, stacks: Mapping[str, RobotStack]) -> Iterator[_Event]:
    fault = entry.config
    if isinstance(fault, Displacement):
        return  # the world is built so
    assert isinstance(fault, LidarFault | Kidnapping | OdometryJump | EncoderFault)
    stack = stacks[fault.robot] if fault.robot is not None else next(iter(stacks.values()))
    start_ns = round(fault.at * 1e9)
    match fault:
        case LidarFault():
            lidar = _failing_lidar(stack, fault.sensor)
            what = f"lidar '{fault.sensor}' of {stack.name}"
            yield _Event(start_ns, f"{what}: {fault.kind}", partial(setattr, lidar, "failure", fault.kind))
            if fault.duration is not None:
                end_ns = round((fault.at + fault.duration) * 1e9)
                yield _Event(end_ns, f"{what} works again", partial(setattr, lidar, "failure", None))
        case Kidnapping():
            to = stack.standing(fault.to.pose)
            text = f"{stack.name} is carried to ({fault.to.x:g}, {fault.to.y:g})"
            if not stack.handle.is_free:
                raise ScenarioError(f"robot '{stack.name}' cannot be carried away: its base is not free")
            yield _Event(start_ns, text, partial(stack.handle.carry, to))
        case OdometryJump():
            yield _Event(start_ns, f"odometry of {stack.name} jumps", _miscount(stack, fault))
        case EncoderFault():
            hardware = stack.handle.hardware
            if fault.joint not in hardware.encoders:
                known = nearest(fault.joint, hardware.encoders)
                raise ScenarioError(f"robot '{stack.name}' has no encoder at joint '{fault.joint}'; {known}")
            text = f"the encoder of {stack.name}'s {fault.joint} counts {fault.factor:g} times what it should"
            yield _Event(start_ns, text, partial(hardware.misread, fault.joint, fault.factor))


def _failing_lidar(stack: RobotStack, topic: str) -> FailingLidar:
    """Return the stand-in for a lidar; put it in its place if that has not been done."""
    lidars: dict[str, SensorPublisher] = {
        publisher.sensor.spec.topic: publisher
        for publisher in stack.sensors
        if isinstance(publisher.sensor, Lidar | FailingLidar)
    }
    if topic not in lidars:
        raise ScenarioError(f"robot '{stack.name}' has no lidar '{topic}'; {nearest(topic, lidars)}")
    publisher = lidars[topic]
    if isinstance(publisher.sensor, Lidar):
        publisher.sensor = FailingLidar(publisher.sensor)
    assert isinstance(publisher.sensor, FailingLidar)
    return publisher.sensor


def _miscount(stack: RobotStack, fault: OdometryJump) -> Callable[[], None]:
    drive = stack.drive
    if drive is None:
        raise ScenarioError(f"robot '{stack.name}' has no drive whose odometry could jump")
    config, half_track = drive.config, drive.controller.track / 2.0
    angles = {}
    for joints, side in ((config.left_joints, -1.0), (config.right_joints, 1.0)):
        angle = (fault.distance + side * fault.yaw * half_track) / config.drive.wheel_radius
        angles.update(dict.fromkeys(joints, angle))

    def miscount() -> None:
        for joint, angle in angles.items():
            stack.handle.hardware.miscount(joint, angle)

    return miscount
