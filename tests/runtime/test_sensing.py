"""When sensors fire: against the definition, and on a robot."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.geometry import Pose3, rotate_wxyz
from twin.models import load as load_robot
from twin.models.description import RobotDescription
from twin.nodes.sensor_publishers import SensorPublisher
from twin.runtime.run import Run
from twin.runtime.sensing import SensorSchedule
from twin.scenario.schema import Scenario
from twin.sensors.contact import ContactSpec

STEP_NS = 2_000_000
RATES = {200.0: (200, 1), 62.0: (62, 1), 30.0: (30, 1), 7.0: (7, 1), 33.3: (333, 10), 499.0: (499, 1)}
"""As whole numbers: numerator and denominator."""

MakeScenario = Callable[[str], Scenario]
MakeRun = Callable[..., Run]


@pytest.fixture
def bus() -> Iterator[Bus]:
    """A bus that nobody else is on."""
    with Bus.open(Clock()) as bus:
        yield bus


class Device:
    """A bumper that notes when it is sampled."""

    def __init__(self, rate_hz: float, name: str, log: list[tuple[int, str]]) -> None:
        self.spec = ContactSpec(name=name, link="base_link", topic=name, rate_hz=rate_hz)
        self._log = log

    def sample(self, time_ns: int) -> Any:
        self._log.append((time_ns, self.spec.name))
        return None


def by_the_definition(rate_hz: float, until_ns: int) -> list[int]:
    """Step by step: the first step at or after each due time."""
    numerator, denominator = RATES[rate_hz]
    times, k = [], 1
    for now_ns in range(STEP_NS, until_ns + 1, STEP_NS):
        if now_ns * numerator >= k * 10**9 * denominator:
            times.append(now_ns)
            k += 1
    return times


def test_sensors_fire_at_the_first_step_at_or_after_their_due_time(bus: Bus) -> None:
    log: list[tuple[int, str]] = []
    names = {f"r{robot}_{rate:g}".replace(".", "_"): rate for robot in (1, 2) for rate in RATES}
    publishers = [SensorPublisher(bus, Device(rate, name, log)) for name, rate in names.items()]
    schedule = SensorSchedule(publishers, STEP_NS)
    end_ns = 100 * 10**9
    while schedule.next_step * STEP_NS <= end_ns:
        schedule.fire(schedule.next_step)
    expected = {name: by_the_definition(rate, end_ns) for name, rate in names.items()}
    for name, rate in names.items():
        times = [time_ns for time_ns, fired in log if fired == name]
        assert times == expected[name], name
        assert abs(len(times) - 100 * rate) <= 1, "the mean rate is exact"
    order = list(names)
    assert log == sorted(log, key=lambda entry: (entry[0], order.index(entry[1]))), "in time, then in order"
    assert len(log) == len(set(log)), "none fires twice"


@pytest.fixture(scope="module")
def diff_bot() -> RobotDescription:
    """The robot as it ships."""
    return load_robot("diff_bot")


def uneven_robot(
    diff_bot: RobotDescription,
    tmp_path: Path,
    *,
    lidar: float = 33.3,
    imu: float = 200.0,
    bumper: float = 62.0,
) -> Path:
    """The robot with an exact lidar and a bumper, all at rates of their own."""
    rates = iter((lidar, imu))
    urdf = re.sub("(<update_rate>)[0-9.]+", lambda tag: f"{tag[1]}{next(rates)}", diff_bot.urdf)
    urdf = urdf.replace("<stddev>0.01</stddev>", "<stddev>0</stddev>")
    contact = f"<sensor name='bumper' type='contact'><update_rate>{bumper}</update_rate></sensor>"
    path = tmp_path / "uneven.urdf"
    path.write_text(
        urdf.replace("</robot>", f"<gazebo reference='base_link'>{contact}</gazebo></robot>"),
        encoding="utf-8",
    )
    return path


def uneven_run(
    scenario: MakeScenario, make_run: MakeRun, path: Path, taps: list[Any], extra: str = ""
) -> Run:
    text = f"""
name: uneven
duration: 1 s
world: {{obstacles: [{{name: wall, size: [0.1, 4, 1], pose: {{x: 2}}}}]}}
robots: [{{model: {path}, name: bot}}]
mission: {{type: velocity_profile, robot: bot, steps: [{{duration: 1 s, linear: 0.5}}]}}
checks: [{{odometry_drift: {{max: 1 m}}}}]
{extra}
"""
    return make_run(scenario(text), taps=taps)


def test_a_robot_of_uneven_rates(
    scenario: MakeScenario, make_run: MakeRun, tmp_path: Path, diff_bot: RobotDescription
) -> None:
    times: dict[str, list[int]] = {"/imu": [], "/bumper": [], "/scan": [], "/clock": []}
    stamps: dict[str, list[int]] = {topic: [] for topic in times}
    notes: list[str] = []
    errors: list[float] = []

    def tap(sample: Any) -> None:
        if sample.topic == "/rosout":
            notes.append(sample.message.msg)
        if sample.topic not in times:
            return
        times[sample.topic].append(sample.time_ns)
        header = getattr(sample.message, "header", None)
        if header is not None:
            stamps[sample.topic].append(header.stamp.sec * 10**9 + header.stamp.nanosec)
        if sample.topic == "/scan":
            errors.append(abs(float(sample.message.ranges[180]) - ahead()))

    T_root_lidar = (
        diff_bot.joints["base_joint"].T_parent_joint @ diff_bot.joints["lidar_joint"].T_parent_joint
    )

    def ahead() -> float:
        """To the wall, from the state itself."""
        qpos = run.world.data.qpos
        lidar = Pose3(qpos[:3].copy(), qpos[3:7].copy()) @ T_root_lidar
        return float((1.95 - lidar.xyz[0]) / rotate_wxyz(lidar.quat_wxyz, (1.0, 0.0, 0.0))[0])

    fault = "faults: [{lidar: {kind: stop, at: 0.5 s, duration: 0.25 s}}]"
    run = uneven_run(scenario, make_run, uneven_robot(diff_bot, tmp_path), [tap], fault)
    while run.world.time_ns < 10**9:
        run.tick()
    assert times["/imu"] == stamps["/imu"] == by_the_definition(200.0, 10**9)
    assert times["/bumper"] == by_the_definition(62.0, 10**9)
    scans = by_the_definition(33.3, 10**9)
    broken = [t for t in scans if 500_000_000 < t <= 760_000_000]
    assert times["/scan"] == stamps["/scan"] == [t for t in scans if t not in broken]
    assert 7 <= len(broken) <= 9, "the lidar was silent for a quarter of a second"
    assert times["/clock"] == [20_000_000 * k for k in range(1, 51)], "nodes run once a control period"
    assert max(errors) < 1e-4, "rays start where the robot is at that step, not at the end of the tick"
    lateness = [note for note in notes if note.startswith("sampled at")]
    assert [note.rpartition(": ")[2] for note in lateness] == ["lidar", "imu", "bumper"], "each is told once"
    assert lateness[1] == (
        "sampled at 200 Hz on average, but up to 1 ms late, "
        "as the period is no whole number of physics steps (2 ms): imu"
    )


def test_rates_of_sensors_change_nothing_else(
    scenario: MakeScenario, make_run: MakeRun, tmp_path: Path, diff_bot: RobotDescription
) -> None:
    def end(**rates: float) -> tuple[bytes, list[Any]]:
        samples: list[Any] = []
        tap = lambda sample: samples.append((sample.topic, sample.time_ns, bytes(sample.payload)))  # noqa: E731
        run = uneven_run(scenario, make_run, uneven_robot(diff_bot, tmp_path, **rates), [tap])
        while run.world.time_ns < 10**9:
            run.tick()
        return run.world.state_digest(), samples

    state, samples = end()
    assert (state, samples) == end(), "the same run twice is the same run"
    plain, _ = end(lidar=10, imu=50, bumper=50)
    assert plain == state, "the physics and the control are those of a robot with other rates"
