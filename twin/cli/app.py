"""The table of commands. Command modules import the heavy libraries only inside their functions."""

from __future__ import annotations

import errno
import os
import sys
from typing import Annotated

import typer

from twin.cli import examples, exec, listings, new, play, run, schema
from twin.cli.console import guard_terminal, print_error
from twin.cli.interrupted import raise_swallowed
from twin.cli.map import app as map_app
from twin.cli.model import check, convert, tree, view
from twin.cli.option_groups import example
from twin.cli.other_commands import Commands
from twin.cli.ros import action, bag, interface, node, param, router, service, tf, topic
from twin.cli.run import batch
from twin.errors import TwinError

app = typer.Typer(
    name="twin",
    cls=Commands,
    help="A digital twin for mobile robots: robot files, physics, autonomy, recordings, verdicts, ROS 2.",
    epilog=example("twin run warehouse"),
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_SCENARIOS, _ROBOTS, _GRAPH, _NAVIGATION = "Scenarios", "Robot files", "ROS 2 graph", "Navigation"

_COMMANDS = (
    ("run", run.run, _SCENARIOS, "twin run warehouse --seed 7 --set robots.0.pose.x=1.5"),
    ("test", batch.run_batch, _SCENARIOS, "twin test scenarios --junit results.xml"),
    ("play", play.play, _SCENARIOS, "twin play runs/warehouse/20261121-101500"),
    ("new", new.new, _SCENARIOS, "twin new my_robot"),
    ("scenarios", listings.scenarios, _SCENARIOS, "twin scenarios"),
    ("arenas", listings.arenas, _SCENARIOS, "twin arenas"),
    ("examples", examples.examples, _SCENARIOS, "twin examples talker"),
    ("schema", schema.schema, _SCENARIOS, "twin schema -o scenario.schema.json"),
    ("robots", listings.robots, _ROBOTS, "twin robots"),
    ("check", check.check, _ROBOTS, "twin check my_robot.urdf.xacro --arg wheel_radius:=0.06"),
    ("tree", tree.tree, _ROBOTS, "twin tree my_robot.urdf"),
    ("graph", tree.graph, _ROBOTS, "twin graph my_robot.urdf -o my_robot.svg"),
    ("convert", convert.convert, _ROBOTS, "twin convert my_robot.urdf -o my_robot"),
    ("view", view.view, _ROBOTS, "twin view my_robot.urdf --joint lift_joint=0.5"),
    ("router", router.router, _GRAPH, "twin router --listen tcp/127.0.0.1:7447"),
    ("exec", exec.execute, _GRAPH, "twin exec my_controller.py:make_node --lockstep"),
)

_GROUPS = (
    ("topic", topic.app),
    ("node", node.app),
    ("service", service.app),
    ("action", action.app),
    ("param", param.app),
    ("tf", tf.app),
    ("interface", interface.app),
    ("bag", bag.app),
)

_NEED_ARGUMENTS = ("run", "new", "exec", "play", "check", "tree", "graph", "convert", "view")

for _name, _function, _panel, _example in _COMMANDS:
    app.command(
        _name,
        epilog=example(_example),
        no_args_is_help=_name in _NEED_ARGUMENTS,
        rich_help_panel=_panel,
    )(_function)


for _name, _group in _GROUPS:
    app.add_typer(_group, name=_name, rich_help_panel=_GRAPH)

app.add_typer(map_app, name="map", rich_help_panel=_NAVIGATION)


def _tell_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"twin {version('twin')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_tell_version, help="Say which twin this is.")
    ] = False,
) -> None:
    pass


def run_app() -> None:
    """Run the command line and exit: 0 pass, 1 a check failed, 2 a mistake or a bug, 130 interrupted."""
    if sys.stdout is None:  # started with `>&-`
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - used until the process ends
    guard_terminal()
    try:
        app()
    except TwinError as fault:
        print_error(fault)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as fault:
        raise_swallowed()  # Ctrl-C inside of __set_name__ becomes a RuntimeError
        _tell(fault)
        sys.exit(2)  # Python's own exit code for a bug, 1, means a failed check here


def _tell(fault: Exception) -> None:
    """Tell of a full disk or an impossible name in a sentence; of a bug with its traceback."""
    if isinstance(fault, OSError) and fault.errno == errno.ENAMETOOLONG:
        print_error(TwinError(f"{fault.filename}: {fault.strerror}"))
        return
    if not isinstance(fault, OSError) or fault.errno not in _FULL:
        import traceback

        traceback.print_exception(fault)
        return
    what = fault.filename or "a file that was written"
    print_error(TwinError(f"{fault.strerror}: {what} is not whole; make room"))
    # What is still buffered goes nowhere; otherwise the interpreter complains when it flushes at its end.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
