"""A bus for processes that run by the wall clock: commands, and nodes of their own beside a run."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import zenoh

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import codec
from twin.bridge.clock import Clock
from twin.bridge.msgs import Clock as ClockMsg
from twin.bridge.msgs import ns
from twin.bridge.node.options import NodeOptions
from twin.bridge.programs import ros_args
from twin.bridge.programs.console_log import show_log
from twin.bridge.programs.ros_args import parser_of, split
from twin.bridge.wire import Wire
from twin.bridge.wire.admission import Admission, read
from twin.bridge.wire.interrupts import noted_signals
from twin.bridge.wire.naming import Interface
from twin.bridge.wire.session import direct, session_to_join
from twin.errors import TwinError

_LONGEST_WAIT_S = 0.1


class LiveBus:
    """A bus whose nodes run as soon as something arrives or a timer is due; see `join`."""

    def __init__(self, bus: Bus, clock: Clock, *, use_sim_time: bool) -> None:
        self.bus = bus
        bus.use_sim_time = use_sim_time
        self._clock = clock
        self._sim_time: SimTime | None = SimTime(bus) if use_sim_time else None
        self._advance()

    def spin_once(self, timeout_s: float = _LONGEST_WAIT_S) -> None:
        """Wait for samples from outside or the next timer, at most so long [s], then run every node once."""
        self._advance()
        due = [wait for node in self.bus.nodes if (wait := node.wait_ns) is not None]
        if self._sim_time is None:
            timeout_s = min([timeout_s, *(wait * 1e-9 for wait in due)])
        elif 0 in due:
            timeout_s = 0.0
        if timeout_s > 0.0:
            self.bus.external.wait(timeout_s)
        self._advance()
        self.bus.admit()
        self.bus.spin()

    def spin(self, until: Callable[[], bool] = lambda: False, timeout_s: float | None = None) -> bool:
        """Run until a condition holds; False if so much wall time [s] went by before."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        while not until():
            left = _LONGEST_WAIT_S if end is None else end - time.monotonic()
            if left <= 0.0:
                return False
            self.spin_once(min(left, _LONGEST_WAIT_S))
        return True

    def _advance(self) -> None:
        self._clock.now_ns = time.time_ns() if self._sim_time is None else self._sim_time.now_ns


class SimTime:
    """The latest time on `/clock`; zero until somebody publishes it, as in rclpy."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._codec = codec(ClockMsg)
        self.now_ns = 0
        name = self._codec.msgtype
        clock = Interface("/clock", types.dds_name(name), types.rihs01(name))
        self._admission = Admission(bus.external, clock)
        self._subscribers = [
            bus.session.declare_subscriber(key, direct(self._on_sample)) for key in bus.naming.heard(clock)
        ]

    def _on_sample(self, sample: zenoh.Sample) -> None:
        if self._admission.source(sample) is None:
            return
        message = read(self._bus.external, "/clock", self._codec, sample.payload.to_bytes())
        if message is None:
            return
        self.now_ns = ns(message.clock)
        self._bus.external.wake()


@contextmanager
def join(
    connect: Sequence[str] | None = None,
    *,
    listen: Sequence[str] = (),
    config: Path | None = None,
    domain_id: int | None = None,
    use_sim_time: bool = False,
    timeout_s: float = 3.0,
    wire: Wire = "rmw_zenoh",
) -> Iterator[LiveBus]:
    """Join a ROS graph, as a Zenoh client that opens no listener, and leave it at the end.

    Args:
        connect: Endpoints of a run, a router or any rmw_zenoh peer; None: TWIN_CONNECT, or where rmw_zenoh
            expects a router.
        listen: Endpoints where others may connect; then the process is a peer that needs nobody.
        config: Zenoh configuration file; None: ZENOH_SESSION_CONFIG_URI, as rmw_zenoh.
        domain_id: Default: ROS_DOMAIN_ID, or 0.
        use_sim_time: Whether the clock follows `/clock` instead of the wall clock.
        timeout_s: How long to try to connect [s].
        wire: How keys and tokens are spelled; what comes in may be spelled in every way.

    Raises:
        BridgeError: nobody answers, or an endpoint, the file or ROS_DOMAIN_ID cannot be used.
    """
    session = session_to_join(
        connect, listen=listen, config=config, domain_id=domain_id, timeout_s=timeout_s, wire=wire
    )
    clock = Clock()
    with Bus.of(session, clock) as bus:
        yield LiveBus(bus, clock, use_sim_time=use_sim_time)


def run(make: Callable[..., Any], arguments: Sequence[str] | None = None) -> None:
    """Be a program: join a graph, create nodes with `make(bus)`, run them until Ctrl-C; log on stderr.

    If `make` is a generator function, it is a task: each `yield` waits for what comes next, and the program
    is over when it returns. What `make` takes after the bus are the program's arguments, see `parser_of`;
    after --ros-args come those of ROS (`-p name:=value`, `-r from:=to`). A user's mistake is one line on
    stderr and exit code 2.

    Args:
        make: Factory of the nodes.
        arguments: Of the command line; None: those of the process.
    """
    show_log()
    parser = parser_of(make)
    try:
        ros = ros_args.parse(sys.argv[1:] if arguments is None else arguments)
        joining, own = split(parser.parse_args(ros.rest))
        with join(**joining) as process, noted_signals() as received:
            process.bus.node_options = NodeOptions(arguments=ros)
            process.bus.starting()
            steps = make(process.bus, **own)
            process.bus.started()
            if isinstance(steps, Generator):
                with closing(steps):
                    process.spin(lambda: bool(received) or next(steps, received) is received)
            else:
                process.spin(lambda: bool(received))
    except TwinError as fault:
        parser.exit(2, f"error: {fault}\n")
    except KeyboardInterrupt:
        parser.exit(130)
