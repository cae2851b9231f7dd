# ruff: noqa: E501  (a command is a row)
"""The table of commands; the module of a command is imported when somebody calls it, or asks it for help."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import typer
from typer.main import get_command, get_group

from twin.cli.option_groups import example

_SCENARIOS, _ROBOTS, _GRAPH, _NAVIGATION = "Scenarios", "Robot files", "ROS 2 graph", "Navigation"


@dataclass(frozen=True)
class Command:
    """What a list of commands shows of one, and where it is."""

    panel: str
    summary: str
    """The first sentence of its own help."""
    module: str
    """Below `twin.cli`; in it `app`, a group of commands, if no function is given."""
    function: str = "app"
    example: str = ""
    needs_arguments: bool = False

    def load(self, name: str) -> Any:
        """Return the command itself."""
        found = getattr(import_module(f"twin.cli.{self.module}"), self.function)
        if isinstance(found, typer.Typer):
            return get_group(found)
        alone = typer.Typer(rich_markup_mode="rich", add_completion=False)
        epilog = example(self.example)
        alone.command(name, epilog=epilog, no_args_is_help=self.needs_arguments)(found)
        return get_command(alone)


# fmt: off
TABLE = {
    "run": Command(_SCENARIOS, "Run a scenario to its verdict.", "run", "run", "twin run warehouse --seed 7 --set robots.0.pose.x=1.5", needs_arguments=True),
    "test": Command(_SCENARIOS, "Run scenarios as tests, one for each seed and value that they name.", "run.batch", "run_batch", "twin test scenarios -j 2 --junit results.xml"),
    "diff": Command(_SCENARIOS, "Name the first tick, topic and field in which two runs differ.", "experiments.diff", "diff", "twin diff runs/warehouse/20261121-101500 --set robots.0.pose.x=1.5", needs_arguments=True),
    "shrink": Command(_SCENARIOS, "Reduce a failing scenario to the smallest that fails the same checks, and write it.", "experiments.shrink", "shrink", "twin shrink warehouse --seed 7 -o smallest.yaml", needs_arguments=True),
    "mutate": Command(_SCENARIOS, "Run a scenario with known-bad stacks, and tell which of them its checks catch.", "experiments.mutate", "mutate", "twin mutate warehouse --min-score 0.9", needs_arguments=True),
    "sweep": Command(_SCENARIOS, "Run a scenario with many values and seeds, and say how sure its pass rate is.", "experiments.sweep", "sweep", "twin sweep diff_bot_figure8 --seeds 0:100 --set mission.steps.0.linear=0.1:0.3:0.1", needs_arguments=True),
    "report": Command(_SCENARIOS, "Write a page of a run, or of many: verdict, path, speeds, worst moments, pictures.", "experiments.report", "report", "twin report runs/warehouse/20261121-101500 -o report.html", needs_arguments=True),
    "plant": Command(_SCENARIOS, "Run a scenario's robots in real time as if they were hardware.", "live.plant", "plant", "twin plant warehouse --perturb wheel_radius=0.97,latency=80ms,clock_offset=0.4s", needs_arguments=True),
    "mirror": Command(_SCENARIOS, "Keep virtual robots with physical ones of the same names, and tell how far apart they are.", "live.mirror", "mirror", "twin mirror warehouse --autonomy all", needs_arguments=True),
    "fork": Command(_SCENARIOS, "Run futures of a run, or of a mirror, that goes on, and tell how they end.", "live.fork", "fork", "twin fork --n 8 --goal -5,-3,0 --set friction=0.5"),
    "calibrate": Command(_SCENARIOS, "Estimate wheels, delays and sensors of a physical robot, from a bag or live, and patch the scenario.", "live.calibrate", "calibrate", "twin calibrate hall.yaml drive -o calibrated.yaml", needs_arguments=True),
    "play": Command(_SCENARIOS, "Open a recording in the Rerun viewer.", "play", "play", "twin play runs/warehouse/20261121-101500", needs_arguments=True),
    "new": Command(_SCENARIOS, "Write a small project that runs as it is: a robot, an arena, a scenario, a check, a test, a CI file.", "new", "new", "twin new my_robot", needs_arguments=True),
    "scenarios": Command(_SCENARIOS, "List the scenarios that `twin run` knows by name: those in the folder `scenarios`, and shipped ones.", "listings", "scenarios", "twin scenarios"),
    "arenas": Command(_SCENARIOS, "List the arenas that ship with twin; a scenario names them as `arena`, their poses as `start`.", "listings", "arenas", "twin arenas"),
    "examples": Command(_SCENARIOS, "List the example programs, or say where one is: `python $(twin examples talker)` runs it.", "examples", "examples", "twin examples talker"),
    "schema": Command(_SCENARIOS, "Print the JSON schema of scenario files, for completion and checks in an editor.", "schema", "schema", "twin schema -o scenario.schema.json"),
    "robots": Command(_ROBOTS, "List the robots that ship with twin; a scenario names them as `model`.", "listings", "robots", "twin robots"),
    "check": Command(_ROBOTS, "Name every fault of a robot file, with its line, the number found, and how to mend it.", "model.check", "check", "twin check my_robot.urdf.xacro --arg wheel_radius:=0.06", needs_arguments=True),
    "tree": Command(_ROBOTS, "Print the tree of links in check_urdf's format.", "model.tree", "tree", "twin tree my_robot.urdf", needs_arguments=True),
    "graph": Command(_ROBOTS, "Draw links and joints: Graphviz text as urdf_to_graphviz writes it, or SVG, which needs no Graphviz.", "model.tree", "graph", "twin graph my_robot.urdf -o my_robot.svg", needs_arguments=True),
    "convert": Command(_ROBOTS, "Write robot.xml and assets/, which plain MuJoCo loads, and report.json: what became of every tag.", "model.convert", "convert", "twin convert my_robot.urdf -o my_robot", needs_arguments=True),
    "view": Command(_ROBOTS, "Look at a robot file, and move its joints.", "model.view", "view", "twin view my_robot.urdf --joint lift_joint=0.5", needs_arguments=True),
    "router": Command(_GRAPH, "Run a Zenoh router, as rmw_zenohd, until Ctrl-C.", "ros.router", "router", "twin router --listen tcp/127.0.0.1:7447"),
    "exec": Command(_GRAPH, "Run nodes beside a simulation until it ends, or Ctrl-C.", "exec", "execute", "twin exec my_controller.py:make_node --lockstep", needs_arguments=True),
    "guard": Command(_GRAPH, "Guard a robot: limits, watchdog, emergency stop.", "live.guard", example="twin guard --robot my_robot.urdf --max-speed 0.5"),
    "teleop": Command(_GRAPH, "Drive a robot with keys or a gamepad.", "live.teleop", "teleop", "twin teleop --layout turtlebot3"),
    "foxglove": Command(_GRAPH, "Serve a graph to Foxglove, on this computer.", "ros.foxglove", "foxglove", "twin foxglove --control"),
    "rosbridge": Command(_GRAPH, "Let web clients take part in a graph: rosbridge v2, and the operator's page, on one port.", "ros.rosbridge", "rosbridge", "twin rosbridge --port 9090"),
    "watch": Command(_GRAPH, "Show a run or any ROS 2 graph in the Rerun viewer, live: RViz's job.", "ros.watch", "watch", "twin watch --topics /scan --topics '/camera/*'"),
    "topic": Command(_GRAPH, "Topics: list, look, measure, publish, pass on; as `ros2 topic` and topic_tools.", "ros.topic"),
    "node": Command(_GRAPH, "Nodes: list, look, draw; as `ros2 node` and rqt_graph.", "ros.node"),
    "service": Command(_GRAPH, "Services: list, look, call; as `ros2 service`.", "ros.service"),
    "action": Command(_GRAPH, "Actions: list, look, send goals; as `ros2 action`.", "ros.action"),
    "param": Command(_GRAPH, "Parameters: list, get, set, keep in files; as `ros2 param`.", "ros.param"),
    "tf": Command(_GRAPH, "Transforms: the tree, a frame in another, delays; as tf2_tools.", "ros.tf"),
    "interface": Command(_GRAPH, "Types: list, show, prototypes; as `ros2 interface`.", "ros.interface"),
    "bag": Command(_GRAPH, "Bags: record, play, look, convert; as `ros2 bag`.", "ros.bag"),
    "cloud": Command(_GRAPH, "Point clouds: look at files, convert, thin, move, take apart, publish, save.", "cloud"),
    "map": Command(_NAVIGATION, "Maps: look at them, save, convert, render, draw zones.", "map"),
}
# fmt: on


class OwnCommands(MutableMapping[str, Any]):
    """The commands by name, as click holds them; each is loaded when it is taken."""

    def __init__(self) -> None:
        self._loaded: dict[str, Any] = dict.fromkeys(TABLE)

    def __getitem__(self, name: str) -> Any:
        if self._loaded[name] is None:
            self._loaded[name] = TABLE[name].load(name)
        return self._loaded[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._loaded[name] = command

    def __delitem__(self, name: str) -> None:
        del self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._loaded)

    def __contains__(self, name: object) -> bool:
        return name in self._loaded

    def __len__(self) -> int:
        return len(self._loaded)
