"""A mirror beside a robot that is moved by hand, stopped, slowed down, killed and started again, and again.

The robot is `twin plant` in a process of its own, its autonomy and mission run in the mirror. What was done
to it, and when, is known here only; printed are what the mirror told from then on until the next thing was
done, how often its label was another one than it ought to be, second by second, how often it put the virtual
robot elsewhere, and its memory.

python -m benchmarks.measures.live_soak --minutes 60
"""

from __future__ import annotations

import argparse
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.measures.memory import resident_mb

SCENARIO = Path(__file__).parents[2] / "scenarios" / "warehouse_patrol.yaml"
ROUND_S = 300.0
KIDNAPPED_S, STOPPED_S, SLOWED_S, KILLED_S, AGAIN_S = 90.0, 150.0, 210.0, 280.0, 296.0
"""When, in a round; the robot is there some seconds after it was started."""
MOST = 300
"""Letters of a line."""
EARLY_S = 6.0
"""A robot that was there sooner is carried away sooner; the first by as much as it waited for the mirror."""
DEGRADED_S = 0.6
"""After a robot falls silent the label may say `twin` for so long."""
RECOVERED_S = 30.0
"""After a fault is over the label may say less than `twin` for so long."""


@dataclass
class Robot:
    """The stand-in, and what is done to it."""

    endpoint: str
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it again, at the scenario's start; a while later it will be carried away."""
        people = "world.obstacles=[]"
        kidnapped = (
            f"faults=[{{kidnapping: {{at: {KIDNAPPED_S:g} s, to: {{x: -4.5, y: -1.0, yaw: 150 deg}}}}}}]"
        )
        words = ["plant", str(SCENARIO), "--listen", self.endpoint, "--set", people, "--set", kidnapped]
        self.process = subprocess.Popen([sys.executable, "-m", "twin.cli", *words], stdout=subprocess.DEVNULL)

    def send(self, number: int) -> None:
        """Send its process a signal."""
        assert self.process is not None
        self.process.send_signal(number)

    def kill(self) -> None:
        """End it as a cut of its power would."""
        assert self.process is not None
        self.process.kill()
        self.process.wait()


def free_endpoint() -> str:
    """Return where nobody listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def soak(minutes: float) -> None:
    """Run rounds for so long, and print what came of it."""
    from twin.bridge.wire.session import SessionConfig
    from twin.live.mirror.live_source import LiveSource
    from twin.live.mirror.mirror import Mirror
    from twin.scenario.schema import load

    robot = Robot(free_endpoint())
    robot.start()
    started_s = time.monotonic()
    done: list[tuple[float, str]] = []
    seconds: list[tuple[float, str]] = []
    memory: list[float] = []
    told: list[tuple[float, str]] = []
    network = SessionConfig(mode="client", connect=(robot.endpoint,), timeout_s=60.0)
    overrides = {"world.obstacles": "[]", "mission.max_failed": "100000", "mission.distance": "1000 km"}
    scenario = load(SCENARIO, overrides)
    with Mirror(scenario, LiveSource(network), autonomy="all") as mirror:
        (mirrored,) = mirror.robots
        world = mirror.run.run.world
        early_s = time.monotonic() - started_s
        plan = script(robot, minutes * 60.0)

        def tick() -> bool:
            now_s = world.time_ns * 1e-9
            while plan and plan[0][0] <= now_s:
                _, what, do = plan.pop(0)
                do()
                if what:
                    done.append((now_s, what))
            told.extend((now_s, f"{event.what}: {event.text}") for event in mirrored.events)
            mirrored.events.clear()
            if now_s >= len(seconds):
                seconds.append((now_s, mirror.statuses()[0].judgement.label))
            if now_s >= 60.0 * len(memory):
                memory.append(resident_mb())
            return now_s >= minutes * 60.0

        mirror.advance(tick)
    robot.kill()
    earlier_s = [(EARLY_S if at_s > ROUND_S else early_s) * (what == "kidnapped") for at_s, what in done]
    begins = [at_s - early_s for (at_s, _), early_s in zip(done, earlier_s, strict=True)] + [minutes * 60.0]
    for (at_s, what), since_s, until_s in zip(done, begins, begins[1:], strict=False):
        words = [text for told_s, text in told if since_s <= told_s < until_s]
        print(f"{at_s:7.1f} s  {what:10} {'; '.join(dict.fromkeys(words)) or 'NOTHING TOLD'}"[:MOST])
    wrong = [
        (at_s, label, want)
        for at_s, label in seconds
        if (want := expected(at_s, done, early_s)) and label != want
    ]
    print(f"label: {len(seconds)} s, wrong in {len(wrong)}: {wrong[:20]}")
    resets = [f"{at_s:.1f} s {text}" for at_s, text in told if text.startswith("reset: ")]
    lost = sum(text.startswith("pace: ") for _, text in told)
    print(f"put elsewhere {len(resets)} times, lost time {lost} times", *resets, sep="\n  ")
    print("memory [MB], a minute each:", " ".join(f"{each:.0f}" for each in memory))


def script(robot: Robot, length_s: float) -> list[tuple[float, str, Any]]:
    """Return what is done when [s], with a name where something begins."""
    plan: list[tuple[float, str, Any]] = []
    start_s = 0.0
    while start_s < length_s:
        plan.append((start_s + KIDNAPPED_S, "kidnapped", lambda: None))
        plan.append((start_s + STOPPED_S, "stopped", lambda: robot.send(signal.SIGSTOP)))
        plan.append((start_s + STOPPED_S + 3.0, "", lambda: robot.send(signal.SIGCONT)))
        for i in range(20):
            name = "slowed" if i == 0 else ""
            plan.append((start_s + SLOWED_S + i, name, lambda: robot.send(signal.SIGSTOP)))
            plan.append((start_s + SLOWED_S + i + 0.7, "", lambda: robot.send(signal.SIGCONT)))
        plan.append((start_s + KILLED_S, "killed", robot.kill))
        plan.append((start_s + AGAIN_S, "started", robot.start))
        start_s += ROUND_S
    return plan


def expected(at_s: float, done: list[tuple[float, str]], first_early_s: float) -> str | None:
    """Return the label that is right, None where more than one is."""
    since = [(at_s - began_s, what) for began_s, what in done if began_s <= at_s]
    passed_s, what = since[-1] if since else (at_s, "started")
    early_s = first_early_s if at_s < ROUND_S else EARLY_S
    if any(what == "kidnapped" and 0.0 < began_s - at_s < early_s for began_s, what in done):
        return None
    if what == "stopped" and DEGRADED_S < passed_s < 3.0:
        return "shadow"
    if what == "killed" and passed_s > 5.0 + DEGRADED_S:
        return "model"
    if what == "killed" and DEGRADED_S < passed_s < 5.0:
        return "shadow"
    long_s = {"slowed": 20.0, "stopped": 3.0}.get(what, 0.0) + RECOVERED_S
    return "twin" if what != "killed" and passed_s > long_s else None


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0)
    soak(parser.parse_args().minutes)
