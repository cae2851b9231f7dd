"""What clients of rosbridge cost: twenty of them, each with all topics of a patrol, and a stop in the midst.

The run, the bridge and the clients are processes of their own on this computer. Printed are whether the run
keeps real time, memory and CPU time of the bridge, that of a plain broadcast of the same frames to as many
clients, and how long an emergency stop takes to the graph while a thousand messages a second come on top,
next to an echo on the same way before anybody else was there.

python -m benchmarks.measures.web_cost --seconds 600
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import multiprocessing
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

from tests.processes import free_endpoint, program, wait_for_listener
from twin.bridge import live
from twin.bridge.msgs import Clock as ClockMsg
from twin.bridge.msgs import Header, String

SCENARIO = Path(__file__).parents[2] / "scenarios" / "warehouse_patrol.yaml"
CLIENTS = 20
LOAD_HZ = 1000
ECHOES, STOPS = 100, 50
MOST_RATIO, MOST_STOP_RATIO = 2.0, 5.0
KEPT_S = 30.0
"""What is compared with a plain broadcast."""
_SETTLE_S = 5.0


Frames = list[tuple[float, str | bytes]]
"""And when they came [s]."""


def clients(address: str, topics: list[str], keep: Event, over: Event, out: Any) -> None:
    """Be so many clients, who hear all topics and read all that comes; give what one heard while it keeps.

    They do no more than a client must, so that most of this computer is left for what is measured.
    """
    from websockets.client import ClientProtocol
    from websockets.frames import Frame, Opcode
    from websockets.uri import parse_uri

    uri, kept = parse_uri(address), Frames()

    async def one(number: int) -> None:
        protocol = ClientProtocol(uri, max_size=None)
        reader, writer = await asyncio.open_connection(uri.host, uri.port)
        protocol.send_request(protocol.connect())
        asked = False
        while not over.is_set():
            writer.write(b"".join(protocol.data_to_send()))
            try:
                data = await asyncio.wait_for(reader.read(1 << 20), 0.5)
            except TimeoutError:
                continue
            if not data:
                break
            protocol.receive_data(data)
            events = protocol.events_received()
            if not asked:
                asked = True
                for topic in topics:
                    protocol.send_text(json.dumps({"op": "subscribe", "topic": topic}).encode())
            for event in events if number == 0 and keep.is_set() else ():
                if isinstance(event, Frame) and event.opcode in (Opcode.TEXT, Opcode.BINARY):
                    data = bytes(event.data)
                    kept.append((time.perf_counter(), data.decode() if event.opcode is Opcode.TEXT else data))
        writer.close()

    async def all_of_them() -> None:
        await asyncio.gather(*(one(number) for number in range(CLIENTS)))

    asyncio.run(all_of_them())
    out.put(kept)


def broadcast(frames: Frames, ready: Any, ended: Any) -> None:
    """Send frames to all who are connected, when they are due, as plainly as can be; tell the CPU time."""
    from websockets.asyncio.server import broadcast as send
    from websockets.asyncio.server import serve
    from websockets.exceptions import ConnectionClosed

    async def main() -> None:
        async def listen(connection: Any) -> None:
            with contextlib.suppress(ConnectionClosed):
                async for _ in connection:
                    pass

        async with serve(listen, "127.0.0.1", 0, compression=None) as server:
            ready.put(server.sockets[0].getsockname()[1])
            while len(server.connections) < CLIENTS:
                await asyncio.sleep(0.05)
            await asyncio.sleep(1.0)
            began_s, cpu_s = time.perf_counter(), time.process_time()
            for at_s, frame in frames:
                late_s = time.perf_counter() - began_s
                if at_s - frames[0][0] > late_s:
                    await asyncio.sleep(at_s - frames[0][0] - late_s)
                send(server.connections, frame)
            await asyncio.sleep(0.5)
            ended.put(time.process_time() - cpu_s)

    asyncio.run(main())


def cpu_s(pid: int) -> float:
    """Return the CPU time of a process with all its threads [s]."""
    values = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(values[11]) + int(values[12])) / os.sysconf("SC_CLK_TCK")


def memory_mb(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="utf-8").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class Graph:
    """A node of this process, by which is known when something arrives in the graph."""

    def __init__(self, process: live.LiveBus, endpoint: str) -> None:
        self.process, self.endpoint = process, endpoint
        self.node = process.bus.create_node("measure")
        self.arrived: list[float] = []
        self.clock_ns = 0
        self.node.create_subscription(Header, "/measure/echo", self._on_message, 100)
        self.node.create_subscription(Header, "/guard/stop", self._on_message, 100)
        self.node.create_subscription(ClockMsg, "/clock", self._on_clock, 10)

    def _on_message(self, message: Header) -> None:
        self.arrived.append(time.perf_counter())

    def _on_clock(self, message: ClockMsg) -> None:
        self.clock_ns = message.clock.sec * 1_000_000_000 + message.clock.nanosec

    def ways(self, client: Any, topic: str, times: int) -> list[float]:
        """Return how long messages of a client take to the graph [ms], one after the other."""
        found = []
        for _ in range(times):
            self.arrived.clear()
            sent_s = time.perf_counter()
            client.send(json.dumps({"op": "publish", "topic": topic, "msg": {}}))
            if not self.process.spin(lambda: self.arrived, 30.0):
                raise SystemExit(f"nothing arrives on {topic}")
            found.append(1e3 * (self.arrived[0] - sent_s))
            self.process.spin(lambda: False, 0.02)
        return found


@dataclass(frozen=True, kw_only=True)
class Costs:
    """What was measured."""

    topics: int
    frames: int
    """That one client got while they were kept."""
    pace: float
    """Simulated time in real time."""
    memory_mb: tuple[float, ...]
    """Of the bridge, from the time when all clients were there."""
    bridge_s: float
    plain_s: float
    """CPU time of the bridge, and of a plain broadcast of the same frames."""
    echo_ms: tuple[float, ...]
    stops_ms: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """CPU time of the bridge to that of a plain broadcast."""
        return self.bridge_s / self.plain_s

    @property
    def stop_ratio(self) -> float:
        """How long a stop takes under load to how long an echo does without."""
        return statistics.median(self.stops_ms) / statistics.median(self.echo_ms)


def measure(seconds: float) -> Costs:
    """Run all of it."""
    endpoint = free_endpoint()
    port = free_endpoint().rpartition(":")[2]
    patrol = ["--set", "mission.distance=1000 km", "--set", f"duration={seconds + 600:g} s"]
    patrol += ["--set", "mission.max_failed=100000", "--pace", "1", "--no-record", "--listen", endpoint]
    with tempfile.TemporaryDirectory() as folder:
        words = ["--connect", endpoint, "--port", port, "--max-rate", "10000", "--audit", f"{folder}/audit"]
        with started("run", str(SCENARIO), *patrol):
            wait_for_listener(endpoint)
            with program("rosbridge", *words) as bridge, live.join([endpoint]) as process:
                wait_for_listener(f"tcp/127.0.0.1:{port}")
                return beside(bridge.pid, f"ws://127.0.0.1:{port}", Graph(process, endpoint), seconds)


def started(*words: str) -> Any:
    """Run a command of `twin` that is ended, whatever it says of that."""

    class Program:
        def __enter__(self) -> None:
            command = [sys.executable, "-m", "twin.cli", *words]
            self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        def __exit__(self, *_: object) -> None:
            self.process.terminate()
            self.process.wait()

    return Program()


def beside(pid: int, address: str, graph: Graph, seconds: float) -> Costs:
    """Measure beside a bridge of a process."""
    from websockets.sync.client import connect

    spawn = multiprocessing.get_context("spawn")
    with connect(address, compression=None) as operator:
        for topic in ("/measure/echo", "/guard/stop"):
            operator.send(json.dumps({"op": "advertise", "topic": topic, "type": "std_msgs/Header"}))
        graph.process.spin(lambda: graph.clock_ns, 120.0)
        graph.process.spin(lambda: False, _SETTLE_S)
        echo = graph.ways(operator, "/measure/echo", ECHOES)
        operator.send(json.dumps({"op": "call_service", "service": "/rosapi/topics", "id": "topics"}))
        while (answer := json.loads(operator.recv())).get("id") != "topics":
            pass
        topics = [topic for topic in answer["values"]["topics"] if not topic.startswith("/measure")]
        out, keep, over = spawn.Queue(), spawn.Event(), spawn.Event()
        crowd = spawn.Process(target=clients, args=(address, [*topics, "/load"], keep, over, out))
        crowd.start()
        graph.process.spin(lambda: False, 2 * _SETTLE_S)
        spent_s = cpu_s(pid)
        keep.set()
        graph.process.spin(lambda: False, KEPT_S)
        keep.clear()
        bridge_s = cpu_s(pid) - spent_s
        memory, began_s, began_ns = [memory_mb(pid)], time.perf_counter(), graph.clock_ns
        for _ in range(10):
            graph.process.spin(lambda: False, (seconds - KEPT_S) / 10.0)
            memory.append(memory_mb(pid))
        pace = (graph.clock_ns - began_ns) * 1e-9 / (time.perf_counter() - began_s)
        stops = under_load(graph, operator, spawn)
        over.set()
        kept = get(out)
        crowd.join()
    return Costs(
        topics=len(topics),
        frames=len(kept),
        pace=pace,
        memory_mb=tuple(memory),
        bridge_s=bridge_s,
        plain_s=plainly(kept, spawn),
        echo_ms=tuple(echo),
        stops_ms=tuple(stops),
    )


def under_load(graph: Graph, operator: Any, spawn: Any) -> list[float]:
    """Press stop again and again while a thousand messages a second go to all clients [ms]."""
    crowd = spawn.Process(target=talk, args=(graph.endpoint,))
    crowd.start()
    graph.process.spin(lambda: False, _SETTLE_S)
    stops = graph.ways(operator, "/guard/stop", STOPS)
    crowd.terminate()
    crowd.join()
    return stops


def talk(endpoint: str) -> None:
    """Publish a thousand messages a second until the process is ended."""
    with live.join([endpoint]) as process:
        node = process.bus.create_node("crowd")
        publisher = node.create_publisher(String, "/load", 100)
        node.create_timer(
            10_000_000, lambda: [publisher.publish(String("x" * 100)) for _ in range(LOAD_HZ // 100)]
        )
        process.spin(lambda: False, 1e6)


def plainly(frames: Frames, spawn: Any) -> float:
    """Return the CPU time of a plain broadcast of the frames [s]."""
    ready, ended, out = spawn.Queue(), spawn.Queue(), spawn.Queue()
    keep, over = spawn.Event(), spawn.Event()
    server = spawn.Process(target=broadcast, args=(frames, ready, ended))
    server.start()
    address = f"ws://127.0.0.1:{get(ready)}"
    crowd = spawn.Process(target=clients, args=(address, [], keep, over, out))
    crowd.start()
    spent_s = get(ended, frames[-1][0] - frames[0][0] + 120.0)
    over.set()
    get(out)
    crowd.join()
    server.terminate()
    server.join()
    return spent_s


def get(queue: Any, seconds: float = 120.0) -> Any:
    """Return what a process sends."""
    return queue.get(timeout=seconds)


def show(costs: Costs) -> None:
    """Print it; exit with 1 if a bar is missed."""
    print(f"{costs.topics} topics, {CLIENTS} clients")
    print(
        f"the run keeps {costs.pace:.3f} of real time; "
        f"each client gets {costs.frames / KEPT_S:.0f} frames a second"
    )
    print("memory of the bridge [MB]:", " ".join(f"{each:.0f}" for each in costs.memory_mb))
    print(
        f"CPU time: {costs.bridge_s:.2f} s, {costs.ratio:.2f} times a plain broadcast's "
        f"{costs.plain_s:.2f} s (at most {MOST_RATIO:g})"
    )
    print(f"an echo, idle: median {statistics.median(costs.echo_ms):.2f} ms")
    print(
        f"a stop under load: median {statistics.median(costs.stops_ms):.2f} ms, largest "
        f"{max(costs.stops_ms):.1f}; {costs.stop_ratio:.2f} times the echo (at most {MOST_STOP_RATIO:g})"
    )
    raise SystemExit(costs.ratio > MOST_RATIO or costs.stop_ratio > MOST_STOP_RATIO)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=600.0)
    show(measure(parser.parse_args().seconds))
