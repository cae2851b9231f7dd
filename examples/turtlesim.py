"""Turtles on a sheet: `python examples/turtlesim.py --rerun turtle.rrd`, driven by /turtle1/cmd_vel."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from turtle_node import TurtleOnBus
from turtle_world import SIZE, STEP_NS, Sheet

from twin.bridge import live, types
from twin.bridge.bus import Bus
from twin.bridge.msgs import ParameterDescriptor, new
from twin.bridge.srvs import Empty

Kill, Spawn = types.ServiceType("turtlesim/srv/Kill"), types.ServiceType("turtlesim/srv/Spawn")
IntegerRange = types.get("rcl_interfaces/msg/IntegerRange")

BACKGROUND = {"background_r": (69, "Red"), "background_g": (86, "Green"), "background_b": (255, "Blue")}
FRAMES = 3
"""So many steps are one frame of the drawing."""


class TurtleSim:
    """The node /turtlesim."""

    def __init__(self, bus: Bus, drawing: Any) -> None:
        self.node = bus.create_node("turtlesim")
        for name, (value, word) in BACKGROUND.items():
            text = f"{word} channel of the background color"
            limits = new(ParameterDescriptor, description=text, integer_range=[IntegerRange(0, 255, 1)])
            self.node.declare_parameter(name, value, limits)
        text = "If true, then turtles will be holonomic"
        self.node.declare_parameter("holonomic", False, new(ParameterDescriptor, description=text))
        self.node.create_service(Empty, "clear", self.on_clear)
        self.node.create_service(Empty, "reset", self.on_reset)
        self.node.create_service(Spawn, "spawn", self.on_spawn)
        self.node.create_service(Kill, "kill", self.on_kill)
        self.node.create_timer(STEP_NS, self.on_timer)
        self.log, self.drawing, self.steps = self.node.get_logger(), drawing, 0
        self.sheet, self.turtles = Sheet(), dict[str, TurtleOnBus]()
        self.log.info(f"Starting turtlesim with node name {self.node.fully_qualified_name}")
        self.spawn("", SIZE / 2.0, SIZE / 2.0, 0.0)

    def spawn(self, name: str, x: float, y: float, theta: float) -> str:
        """Add a turtle and return its name; empty if there is one of this name."""
        count = 1
        while not name:
            name = f"turtle{count}" if f"turtle{count}" not in self.turtles else ""
            count += 1
        if name in self.turtles:
            self.log.error(f"A turtle named [{name}] already exists")
            return ""
        self.turtles[name] = TurtleOnBus(self.node, name, self.sheet, x, y, theta)
        self.log.info(f"Spawning turtle [{name}] at x=[{x:f}], y=[{y:f}], theta=[{theta:f}]")
        return name

    def on_timer(self) -> None:
        """Move everything on by 16 ms."""
        r, g, b = (self.node.get_parameter(name).value for name in BACKGROUND)
        for turtle in self.turtles.values():
            turtle.update((r, g, b))
        if self.drawing and self.steps % FRAMES == 0:
            here = {name: each.turtle for name, each in self.turtles.items()}
            self.drawing.show(here, self.sheet, (r, g, b), self.node.now_ns)
        self.steps += 1

    def on_spawn(self, request: Any) -> Any:
        """Add a turtle."""
        return Spawn.Response(self.spawn(request.name, request.x, request.y, request.theta))

    def on_kill(self, request: Any) -> Any:
        """Take a turtle away."""
        if request.name in self.turtles:
            self.turtles.pop(request.name).destroy()
        else:
            self.log.error(f"Tried to kill turtle [{request.name}], which does not exist")
        return Kill.Response(0)

    def on_clear(self, request: Any) -> Any:
        """Clean the sheet."""
        self.log.info("Clearing turtlesim.")
        self.sheet.clear()
        return Empty.Response(0)

    def on_reset(self, request: Any) -> Any:
        """Start again with one turtle."""
        self.log.info("Resetting turtlesim.")
        while self.turtles:
            self.turtles.popitem()[1].destroy()
        self.sheet.clear()
        self.spawn("", SIZE / 2.0, SIZE / 2.0, 0.0)
        return Empty.Response(0)


@contextmanager
def recorded(file: Path | None) -> Iterator[Any]:
    """Open a drawing, if there is a file for it."""
    if file is None:
        yield None
        return
    from turtle_drawing import Drawing  # Rerun is loaded only if wanted

    drawing = Drawing(file)
    try:
        yield drawing
    finally:
        drawing.close()


def make(bus: Bus, *, rerun: str = "") -> Iterator[None]:
    """Simulate turtles on a sheet; write what happens to a Rerun file if one is named."""
    with recorded(Path(rerun) if rerun else None) as drawing:
        TurtleSim(bus, drawing)
        while True:
            yield


if __name__ == "__main__":
    live.run(make)
