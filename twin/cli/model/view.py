"""`twin view`: a robot in the Rerun viewer, and a page with a slider for every joint."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from twin.cli.model.options import RobotFile, reads_robot
from twin.errors import ModelError
from twin.models.options import ReadOptions


class Layer(StrEnum):
    """What can be seen of a robot."""

    VISUAL = "visual"
    COLLISION = "collision"
    FRAMES = "frames"
    JOINT_AXES = "joint_axes"
    INERTIA = "inertia"
    CENTRE_OF_MASS = "centre_of_mass"


@reads_robot
def view(
    file: RobotFile,
    joint: Annotated[
        list[str] | None,
        typer.Option(
            "--joint", metavar="NAME=VALUE", help="Position of a joint, in rad or m; may be repeated."
        ),
    ] = None,
    show: Annotated[
        list[Layer],
        typer.Option(help="A layer to see at first; may be repeated. The viewer can switch each of them."),
    ] = [Layer.VISUAL],  # noqa: B006
    save: Annotated[
        Path | None,
        typer.Option(metavar="FILE.rrd", help="Write a recording instead of opening anything."),
    ] = None,
    web: Annotated[
        bool, typer.Option("--web", help="Show the robot in the page too, instead of a window of its own.")
    ] = False,
    port: Annotated[int, typer.Option(help="Port of the page with the sliders.", min=0, max=65535)] = 9091,
    no_open: Annotated[bool, typer.Option("--no-open", help="Only print the address of the page.")] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Read the file again whenever it is written.")
    ] = False,
    *,
    read: ReadOptions,
) -> None:
    """Look at a robot file, and move its joints.

    Ctrl-C ends it, and so does closing the viewer. Exit code 0, or 2 for a file with errors.
    """
    from twin.cli.console import stderr
    from twin.cli.interrupted import sigterm_is_ctrl_c, was_interrupted
    from twin.files.writing import check_file
    from twin.models import load
    from twin.recording.view.posture import Posture
    from twin.recording.view.robot_view import save as save_recording

    if save is not None:
        check_file(save, "--save")
    description = load(file, read)
    posture = Posture(description)
    posture.set(joint_values(joint or ()))
    layers = [layer.value for layer in show]
    if save is not None:
        save_recording(save, posture, description, layers)
        return
    from twin.recording.view.live_view import LiveViewConfig, live_view

    sigterm_is_ctrl_c()  # ends the viewer too
    config = LiveViewConfig(web=web, port=port, open_page=not no_open, watch=watch, show=layers, read=read)
    try:
        code = live_view(
            file,
            description,
            posture,
            config,
            on_ready=lambda url: stderr().print(f"open {url}"),
            interrupted=was_interrupted,
        )
    except Exception:
        if not was_interrupted():  # while a module in C was imported, or a thread started
            raise
        code = 0
    raise typer.Exit(code)


def joint_values(words: Sequence[str]) -> dict[str, float]:
    """Return the numbers of `NAME=VALUE` words; raises ModelError for a word of another form."""
    values = {}
    for word in words:
        name, _, text = word.rpartition("=")
        try:
            values[name] = float(text)
        except ValueError:
            name = ""
        if not name:
            raise ModelError(
                f"--joint {word}: must be NAME=VALUE in rad or m, such as --joint lift_joint=0.5"
            )
    return values
