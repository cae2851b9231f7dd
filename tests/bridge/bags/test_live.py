"""Recording a graph and playing into one, by the wall clock; two sessions in this process."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.bridge.bags import helpers as bags
from tests.processes import free_endpoint
from twin.bridge import live
from twin.bridge.bags.player import Player, PlayerConfig
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.recorder import Recorder, RecorderConfig
from twin.bridge.bags.topic_choice import TopicChoice
from twin.bridge.cdr.codec import codec
from twin.bridge.live import LiveBus
from twin.bridge.msgs import Clock, LaserScan, String, TFMessage, Twist, new, ns, stamp
from twin.bridge.node.options import BARE
from twin.bridge.node.services import GetTypeDescription
from twin.bridge.qos import LATCHED, SENSOR_DATA, QoS
from twin.bridge.topics.raw_publisher import RawPublisher
from twin.bridge.types import ServiceType
from twin.bridge.types.description import describe
from twin.errors import RecordingError

Both = tuple[LiveBus, LiveBus]


@pytest.fixture
def both() -> Iterator[Both]:
    """A process that listens, and one that is connected to it."""
    endpoint = free_endpoint()
    with ExitStack() as stack:
        here = stack.enter_context(live.join([], listen=[endpoint], domain_id=0))
        yield here, stack.enter_context(live.join([endpoint], domain_id=0))


def wait(condition: Callable[[], bool], *spinning: LiveBus) -> None:
    deadline = time.monotonic() + 100
    while not condition():
        assert time.monotonic() < deadline, "the other side did nothing"
        for process in spinning:
            process.spin_once(0.002)


class Recording:
    """A recorder at work, and a graph to record."""

    def __init__(self, both: Both, folder: Path, config: RecorderConfig | None = None) -> None:
        self.here, self.there = both
        self.recorder = Recorder(self.there.bus, folder, config)

    def until(self, condition: Callable[[], bool]) -> None:
        def step() -> bool:
            self.recorder.update()
            return condition()

        wait(step, self.here, self.there)


def test_all_topics_are_recorded_with_their_qos(both: Both, tmp_path: Path) -> None:
    here, _ = both
    node = here.bus.create_node("talker")
    node.create_publisher(String, "robot_description", LATCHED).publish(String("<robot/>"))
    recording = Recording(both, tmp_path / "bag")
    scans = node.create_publisher(LaserScan, "scan", SENSOR_DATA)  # comes later
    hidden = node.create_publisher(String, "dock/_action/state", 1)
    recording.until(lambda: scans.has_subscribers and recording.recorder.count >= 1)
    before = time.time_ns()
    for number in range(20):
        here.spin_once(0.0)
        scans.publish(bags.scan(number))
        hidden.publish(String("x"))
    recording.until(lambda: recording.recorder.count >= 21)
    recording.recorder.close()
    recording.recorder.close()
    with BagReader(tmp_path / "bag") as bag:
        assert bag.notices == ()
        assert "/dock/_action/state" not in bag.topics
        (latched,) = bag.messages(["/robot_description"])
        assert codec(String).decode(latched.data).data == "<robot/>"
        assert latched.publish_ns < latched.log_ns  # received later than it was published
        assert bag.topics["/robot_description"].latched
        (qos,) = bag.topics["/scan"].qos
        assert (qos.history, qos.depth, qos.reliability) == ("keep_last", 5, "best_effort")
        got = list(bag.messages(["/scan"]))
        assert [m.data for m in got] == [codec(LaserScan).encode(bags.scan(n)) for n in range(20)]
        assert [m.sequence for m in got] == list(range(1, 21))
        assert all(before <= m.publish_ns <= m.log_ns <= time.time_ns() for m in got)
        assert bag.topics["/scan"].type_hash.startswith("RIHS01_64c19")


@pytest.mark.parametrize(
    ("choice", "want"),
    [
        (TopicChoice(topics=("/a/x",)), {"/a/x"}),
        (TopicChoice(regex="/a/.*"), {"/a/x", "/a/y"}),
        (TopicChoice(regex="/a/.*", exclude=".*y"), {"/a/x"}),
        (TopicChoice(exclude="/a/.*"), {"/b"}),
    ],
)
def test_topics_are_chosen(both: Both, tmp_path: Path, choice: TopicChoice, want: set[str]) -> None:
    here, _ = both
    node = here.bus.create_node("talker")
    publishers = [node.create_publisher(String, name, LATCHED) for name in ("a/x", "a/y", "b")]
    for publisher in publishers:
        publisher.publish(String(publisher.name))
    recording = Recording(both, tmp_path / "bag", RecorderConfig(topics=choice))
    recording.until(lambda: recording.recorder.count >= len(want))
    recording.recorder.close()
    with BagReader(tmp_path / "bag") as bag:
        assert set(bag.topics) - {"/rosout", "/parameter_events"} == want


def test_what_cannot_be_kept_is_dropped_and_counted(both: Both, tmp_path: Path) -> None:
    here, there = both
    config = RecorderConfig(topics=TopicChoice(topics=("/big",)), max_waiting_bytes=5000)
    recorder = Recorder(there.bus, tmp_path / "bag", config)
    publisher = here.bus.create_node("talker").create_publisher(String, "big")
    wait(lambda: publisher.has_subscribers, here)
    for _ in range(20):
        publisher.publish(String("x" * 991))  # 1000 bytes
    wait(lambda: recorder.dropped == 15, here)
    recorder.close()
    assert recorder.count == 5


def test_a_second_type_on_a_topic_is_refused_and_counted(both: Both, tmp_path: Path) -> None:
    here, _ = both
    recording = Recording(both, tmp_path / "bag", RecorderConfig(topics=TopicChoice(topics=("/x",))))
    node = here.bus.create_node("talker")
    text, twist = node.create_publisher(String, "x"), node.create_publisher(Twist, "x")
    recording.until(lambda: text.has_subscribers and twist.has_subscribers)
    text.publish(String("first"))
    recording.until(lambda: recording.recorder.count == 1)
    twist.publish(new(Twist))
    recording.until(lambda: recording.recorder.refused["/x"] == 1)
    recording.recorder.close()
    with BagReader(tmp_path / "bag") as bag:
        assert bag.topics["/x"].type == "std_msgs/msg/String"
        assert bag.info.count == 1


def test_simulated_time_is_the_time_of_receiving(both: Both, tmp_path: Path) -> None:
    here, there = both
    sim = LiveBus(there.bus, there.bus.clock, use_sim_time=True)
    node = here.bus.create_node("talker")
    node.create_publisher(String, "description", LATCHED).publish(String("early"))
    clock, chatter = node.create_publisher(Clock, "/clock", 1), node.create_publisher(String, "chatter")
    choice = TopicChoice(topics=("/description", "/chatter"))
    recorder = Recorder(there.bus, tmp_path / "bag", RecorderConfig(topics=choice, use_sim_time=True))
    wait(lambda: chatter.has_subscribers and clock.has_subscribers, here)
    for number in range(1, 4):
        clock.publish(Clock(stamp(number * 10**9)))
        wait(lambda t=number * 10**9: there.bus.clock.now_ns == t, sim)  # type: ignore[misc]
        recorder.update()
        chatter.publish(String(str(number)))
        wait(lambda n=number: (recorder.update(), recorder.count == n + 1)[1], sim)  # type: ignore[misc]
    recorder.close()
    with BagReader(tmp_path / "bag") as bag:
        assert [m.log_ns for m in bag.messages(["/chatter"])] == [10**9, 2 * 10**9, 3 * 10**9]
        assert [m.log_ns for m in bag.messages(["/description"])] == [10**9]


def test_a_bag_is_played_in_its_rhythm(both: Both, tmp_path: Path) -> None:
    here, there = both
    path = bags.make_bag(tmp_path / "bag", start_ns=5 * 10**9)
    got: list[tuple[str, object]] = []
    node = here.bus.create_node("listener")
    for name, (cls, qos) in bags.TOPICS.items():
        node.create_subscription(cls, name, lambda m, n=name: got.append((n, m)), qos)
    with BagReader(path) as bag:
        player = Player(bag, there, PlayerConfig(rate=10.0))
        start = time.monotonic()

        def stop() -> bool:
            here.spin_once(0.0)
            return False

        player.play(stop)
        took = time.monotonic() - start
        wait(lambda: len(got) == 2 * bags.COUNT + 1, here)
    assert [codec(type(m)).encode(m) for n, m in got if n == "/scan"] == [
        codec(LaserScan).encode(bags.scan(n)) for n in range(bags.COUNT)
    ]
    assert player.played == 2 * bags.COUNT + 1
    seconds = bags.COUNT * bags.PERIOD_NS * 1e-9 / 10.0
    assert took > seconds * 0.9


def test_a_late_start_brings_what_was_latched_and_the_clock(both: Both, tmp_path: Path) -> None:
    here, there = both
    path = bags.make_bag(tmp_path / "bag", start_ns=5 * 10**9)
    static: list[TFMessage] = []
    chatter: list[str] = []
    clock: list[int] = []
    node = here.bus.create_node("listener")
    node.create_subscription(TFMessage, "/tf_static", static.append, LATCHED)
    node.create_subscription(String, "/renamed", lambda m: chatter.append(m.data), QoS(depth=100))
    node.create_subscription(Clock, "/clock", lambda m: clock.append(ns(m.clock)), QoS(depth=100))
    config = PlayerConfig(
        start_offset_ns=2 * 10**9,
        duration_ns=5 * 10**8,
        remap={"/chatter": "renamed"},
        rate=2.0,
        clock_hz=100.0,
        topics=TopicChoice(exclude="/scan"),
    )
    with BagReader(path) as bag:
        Player(bag, there, config).play(lambda: (here.spin_once(0.0), False)[1])
    wait(lambda: len(chatter) >= 5 and bool(static), here)
    assert chatter == [f"Hello World: {n}" for n in range(20, 25)]
    assert len(static) == 1
    assert clock[0] >= 7 * 10**9
    assert clock == sorted(clock)
    assert 5 < len(clock) < 60


def test_playing_is_paused_and_sped_up_by_services(both: Both, tmp_path: Path) -> None:
    here, there = both
    path = bags.make_bag(tmp_path / "bag")
    node = here.bus.create_node("remote")

    def call(name: str, kind: str, **fields: object) -> object:
        service = ServiceType(f"rosbag2_interfaces/srv/{kind}")
        client = node.create_client(service, f"/rosbag2_player/{name}")
        wait(lambda: client.service_is_ready, here, there)
        request = new(service.Request)
        for key, value in fields.items():
            setattr(request, key, value)
        future = client.call_async(request)
        wait(lambda: future.done, here, there)
        return future.result

    with BagReader(path) as bag:
        player = Player(bag, there, PlayerConfig(start_paused=True))
        assert call("is_paused", "IsPaused").paused  # type: ignore[attr-defined]
        at = player.now_ns
        assert call("set_rate", "SetRate", rate=50.0).success  # type: ignore[attr-defined]
        assert not call("set_rate", "SetRate", rate=0.0).success  # type: ignore[attr-defined]
        assert call("get_rate", "GetRate").rate == 50.0  # type: ignore[attr-defined]
        assert player.now_ns == at
        call("resume", "Resume")
        assert not player.paused
        call("toggle_paused", "TogglePaused")
        assert player.paused
        call("toggle_paused", "TogglePaused")
        player.play(lambda: (here.spin_once(0.0), False)[1])
        assert player.played == 2 * bags.COUNT + 1


def test_a_loop_goes_on_until_it_is_stopped(both: Both, tmp_path: Path) -> None:
    _, there = both
    path = bags.make_bag(tmp_path / "bag", count=2)
    with BagReader(path) as bag:
        player = Player(bag, there, PlayerConfig(loop=True, rate=100.0))
        player.play(lambda: player.played >= 12)
        assert player.played == 12


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"start_offset_ns": 10**12}, "a start offset of 1000 s is after its end; it is 2.9"),
        ({"topics": TopicChoice(topics=("/scam",))}, "there is no topic /scam; did you mean '/scan'"),
        ({"rate": 0.0}, "a rate of 0; valid is more than zero"),
    ],
)
def test_what_cannot_be_played_is_told(
    both: Both, tmp_path: Path, config: dict[str, object], words: str
) -> None:
    with (
        BagReader(bags.make_bag(tmp_path / "bag")) as bag,
        pytest.raises(RecordingError, match=words),
    ):
        Player(bag, both[1], PlayerConfig(**config))  # type: ignore[arg-type]


def test_no_regular_expression_is_told() -> None:
    with pytest.raises(RecordingError, match=r"'\(' is not a regular expression"):
        TopicChoice(regex="(")


def test_what_was_said_before_a_silence_is_on_the_disk(both: Both, tmp_path: Path) -> None:
    here, _ = both
    here.bus.create_node("talker").create_publisher(String, "x", LATCHED).publish(String("only once"))
    recording = Recording(both, tmp_path / "bag", RecorderConfig(topics=TopicChoice(topics=("/x",))))

    def survives() -> bool:
        with BagReader(tmp_path / "bag") as bag:  # as if the recorder had been killed
            return bag.info.count == 1

    recording.until(survives)
    recording.recorder.close()


@pytest.mark.parametrize("answer", ["none", "another type"])
def test_a_type_that_nobody_tells_is_recorded_without_its_definition(
    both: Both, tmp_path: Path, answer: str
) -> None:
    here, _ = both
    node = here.bus.create_node("talker", options=BARE)
    if answer == "another type":
        description = describe("std_msgs/msg/String")
        node.create_service(
            GetTypeDescription,
            "~/get_type_description",
            lambda request: new(GetTypeDescription.Response, successful=True, type_description=description),
        )
    odd = RawPublisher(node, "/odd", "unheard_of_msgs/msg/Odd", "RIHS01_" + "0" * 64, LATCHED)
    odd.publish(b"\0\1\0\0\1\0\0\0")
    recording = Recording(both, tmp_path / "bag", RecorderConfig(topics=TopicChoice(topics=("/odd",))))
    recording.until(lambda: recording.recorder.count == 1)
    assert recording.recorder.undefined == ("/odd",)
    recording.recorder.close()
