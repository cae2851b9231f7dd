"""A bus for processes that run by the wall clock: commands, and nodes of their own beside a run."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import zenoh

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.cdr import codec
from twin.bridge.clock import Clock
from twin.bridge.keys import topic_key
from twin.bridge.msgs import Clock as ClockMsg
from twin.bridge.msgs import ns
from twin.bridge.session import SessionConfig, direct
from twin.errors import BridgeError

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
"""Where rmw_zenoh expects a router."""
_LONGEST_WAIT_S = 0.1


class LiveBus:
    """A bus whose nodes run as soon as something arrives or a timer is due; see `join`."""

    def __init__(self, bus: Bus, clock: Clock, *, use_sim_time: bool) -> None:
        self.bus = bus
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
        self._lock = threading.Lock()
        self._now_ns = 0
        name = self._codec.msgtype
        key = topic_key(bus.domain_id, "/clock", types.dds_name(name), types.rihs01(name))
        self._subscriber = bus.session.declare_subscriber(key, direct(self._on_sample))

    @property
    def now_ns(self) -> int:
        """[ns]."""
        with self._lock:
            return self._now_ns

    def _on_sample(self, sample: zenoh.Sample) -> None:
        try:
            now_ns = ns(self._codec.decode(sample.payload.to_bytes()).clock)
        except Exception as error:  # whatever the bytes were, they are not our bug
            self._bus.external.refuse("payload", "/clock", f"not a {self._codec.msgtype}: {error}")
            return
        with self._lock:
            self._now_ns = now_ns
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
) -> Iterator[LiveBus]:
    """Join a ROS graph, as a Zenoh client that opens no listener, and leave it at the end.

    Args:
        connect: Endpoints of a run, a router or any rmw_zenoh peer; None: where rmw_zenoh expects a router.
        listen: Endpoints where others may connect; then the process is a peer that needs nobody.
        config: Zenoh configuration file, as rmw_zenoh's ZENOH_SESSION_CONFIG_URI, which is the default.
        domain_id: Default: ROS_DOMAIN_ID, or 0.
        use_sim_time: Whether the clock follows `/clock` instead of the wall clock.
        timeout_s: How long to try to connect [s].

    Raises:
        BridgeError: nobody answers, or an endpoint, the file or ROS_DOMAIN_ID cannot be used.
    """
    file = config or _path(os.environ.get("ZENOH_SESSION_CONFIG_URI"))
    if connect is None:
        connect = () if listen or file else (DEFAULT_ENDPOINT,)
    session = SessionConfig(
        mode="peer" if listen else "client",
        listen=tuple(listen),
        connect=tuple(connect),
        file=file,
        timeout_s=timeout_s,
    )
    clock = Clock()
    with Bus.of(session, clock, domain_id=domain_id_of(domain_id)) as bus:
        yield LiveBus(bus, clock, use_sim_time=use_sim_time)


def _path(text: str | None) -> Path | None:
    return Path(text) if text else None


def domain_id_of(given: int | None) -> int:
    """Return the domain that was given, else ROS_DOMAIN_ID.

    Raises:
        BridgeError: ROS_DOMAIN_ID is no number from 0 to 232.
    """
    if given is not None:
        return given
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not text.isdecimal() or int(text) > 232:
        raise BridgeError(f"ROS_DOMAIN_ID is {text!r}; valid is a number from 0 to 232")
    return int(text)
