"""`twin tf`: who is whose parent, where frames are, how late transforms come."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.drawing_file import Output, check_ending, write_drawing
from twin.cli.ros.endings import endless
from twin.cli.ros.joining import Joining, on_graph
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.live import LiveBus
    from twin.bridge.msgs import TransformStamped
    from twin.bridge.tf import TransformBuffer, TransformListener
    from twin.bridge.tf.report import FrameInfo

app = typer.Typer(
    no_args_is_help=True, help="Transforms: the tree, a frame in another, delays; as tf2_tools."
)

WaitTime = Annotated[float, typer.Option("--wait-time", "-t", min=0.0, help="How many seconds to listen.")]


@on_graph(app, "tree", "twin tf tree")
def tree(wait_time: WaitTime = 2.0, *, joining: Joining) -> None:
    """Show the frames as a tree, with broadcaster and rate."""
    from twin.bridge.tf.report import text_tree

    with joining.open() as process:
        infos, _ = _listen(process, wait_time)
    typer.echo(text_tree(infos), nl=False)


@on_graph(app, "frames", "twin tf frames -o frames.svg")
def frames(output: Output = None, wait_time: WaitTime = 5.0, *, joining: Joining) -> None:
    """Draw the tree: Graphviz text as view_frames writes it, or SVG, which needs no Graphviz."""
    check_ending(output)
    from twin.bridge.tf.report import graphviz, svg

    with joining.open() as process:
        infos, now_ns = _listen(process, wait_time)
    write_drawing(output, {".gv": lambda: graphviz(infos, now_ns), ".svg": lambda: svg(infos, now_ns)})


@on_graph(app, "echo", "twin tf echo map base_link --once")
@endless
def echo(
    source_frame: Annotated[
        str, typer.Argument(metavar="SOURCE_FRAME", help="Frame in which the other one is shown.")
    ],
    target_frame: Annotated[str, typer.Argument(metavar="TARGET_FRAME", help="Frame whose pose is shown.")],
    rate: Annotated[float, typer.Argument(metavar="RATE", min=1e-3, help="How often, in Hz.")] = 1.0,
    once: Annotated[bool, typer.Option("--once", help="End after the first.")] = False,
    timeout: Annotated[
        float | None,
        typer.Option(
            "--timeout", min=0.0, help="End if there is none for so many seconds.", show_default="never"
        ),
    ] = None,
    *,
    joining: Joining,
) -> None:
    """Show a frame in another one again and again; the words and the order of frames are tf2_echo's."""
    with joining.open() as process:
        buffer = _listener(process, "tf2_echo").buffer
        _await(process, buffer, source_frame, target_frame, timeout)
        while True:
            _show(process, buffer, source_frame, target_frame)
            if once:
                return
            process.spin(timeout_s=1.0 / rate)


@on_graph(app, "monitor", "twin tf monitor --once --duration 3")
@endless
def monitor(
    source_frame: Annotated[
        str | None, typer.Argument(metavar="SOURCE_FRAME", help="First frame of a chain.")
    ] = None,
    target_frame: Annotated[
        str | None, typer.Argument(metavar="TARGET_FRAME", help="Last frame of a chain.")
    ] = None,
    duration: Annotated[float, typer.Option(min=0.01, help="Seconds between two reports.")] = 10.0,
    once: Annotated[bool, typer.Option("--once", help="End after the first report.")] = False,
    *,
    joining: Joining,
) -> None:
    """Report delay and rate of every frame and broadcaster, or of a chain; the words are tf2_monitor's."""
    if (source_frame is None) != (target_frame is None):
        raise BridgeError("tf monitor takes two frames, or none for all")
    from twin.bridge.tf.report import TransformStatistics, net_delay

    with joining.open() as process:
        clock, statistics = process.bus.clock, TransformStatistics()
        listener = _listener(process, "tf2_monitor")
        buffer = listener.buffer
        listener.on_message.append(lambda message, who: statistics.add(message, str(who), clock.now_ns))
        chain: list[str] | None = None
        name = "all frames"
        if source_frame is not None and target_frame is not None:
            _await(process, buffer, source_frame, target_frame, None)
            chain, name = buffer.chain(target_frame, source_frame), f"{source_frame} -> {target_frame}"
        typer.echo(f"Gathering data on {name} for {duration:g} seconds...")
        while True:
            delays: list[int] = []
            if source_frame is None or target_frame is None:
                process.spin(timeout_s=duration)
                typer.echo("\n\n\nRESULTS: for all Frames")
            else:
                for _ in range(20):
                    process.spin(timeout_s=duration / 20)
                    _, stamp_ns = buffer.lookup_stamped(source_frame, target_frame)
                    delays.append(clock.now_ns - stamp_ns)
                typer.echo(f"\n\n\nRESULTS: for {source_frame} to {target_frame}")
                typer.echo(f"Chain is: {' -> '.join(chain or ())}\n{net_delay(delays)}")
            typer.echo(statistics.report(chain), nl=False)
            if once:
                return


@on_graph(app, "throttle", "twin tf throttle map base_link laser --rate 2")
@endless
def throttle(
    target_frame: Annotated[
        str, typer.Argument(metavar="TARGET_FRAME", help="The parent in what is published.")
    ],
    source_frames: Annotated[list[str], typer.Argument(metavar="SOURCE_FRAME", help="The children.")],
    rate: Annotated[float, typer.Option(help="At most so often, in Hz.")] = 10.0,
    trans_thres: Annotated[float, typer.Option(help="Only after moving farther, in m; 0: always.")] = 0.0,
    angular_thres: Annotated[
        float, typer.Option(help="Only after turning farther, in rad; 0: always.")
    ] = 0.0,
    *,
    joining: Joining,
) -> None:
    """Publish frames in another one on /tf_throttled, seldom: for a slow link or a web page."""
    from twin.nodes.tf_throttle import TfThrottleNode

    parameters = {
        "target_frame": target_frame,
        "source_frames": source_frames,
        "rate": rate,
        "trans_thres": trans_thres,
        "angular_thres": angular_thres,
    }
    with joining.open() as process:
        TfThrottleNode(process.bus, parameters=parameters)
        typer.echo(f"{', '.join(source_frames)} in {target_frame} -> /tf_throttled")
        process.spin()


def _listener(process: LiveBus, name: str) -> TransformListener:
    from twin.bridge.tf import TransformBuffer, TransformListener

    return TransformListener(TransformBuffer(), process.bus.create_node(name))


def _listen(process: LiveBus, wait_time_s: float) -> tuple[tuple[FrameInfo, ...], int]:
    """Return what is known of the frames after a while, and the time then [ns]."""
    from twin.bridge.tf.report import frame_infos

    buffer = _listener(process, "view_frames").buffer
    process.spin(timeout_s=wait_time_s)
    infos = frame_infos(buffer)
    if not infos:
        raise BridgeError(f"No tf data received within {wait_time_s:g} s; is somebody publishing on /tf?")
    return infos, process.bus.clock.now_ns


def _await(
    process: LiveBus, buffer: TransformBuffer, source: str, target: str, timeout_s: float | None
) -> None:
    """Wait until a frame is known in another; say every second what is missing."""
    waited = 0.0
    while not buffer.can_transform(source, target):
        left = 1.0 if timeout_s is None else min(1.0, timeout_s - waited)
        if left <= 0.0:
            why = _why(buffer, source, target)
            raise BridgeError(f"no transform {source} -> {target} within {timeout_s:g} s: {why}")
        if process.spin(lambda: buffer.can_transform(source, target), timeout_s=left):
            return
        waited += left
        typer.echo(f"Waiting for transform {source} ->  {target}: {_why(buffer, source, target)}", err=True)


def _why(buffer: TransformBuffer, source: str, target: str) -> str:
    try:
        buffer.lookup(source, target)
    except BridgeError as error:
        return str(error)
    return "there now"


def _show(process: LiveBus, buffer: TransformBuffer, source: str, target: str) -> None:
    from twin.bridge.tf import TransformError

    try:
        found = buffer.lookup_transform(source, target)
    except TransformError as error:
        typer.echo(f"Failure at {process.bus.clock.now_ns * 1e-9:.9f}")
        typer.echo(f"Exception thrown:{error}")
        typer.echo(f"The current list of frames is:\n{buffer.all_frames_as_string()}")
        return
    typer.echo(_described(found))


def _described(found: TransformStamped) -> str:
    """Return a transform as tf2_echo shows it."""
    from twin.geometry import matrix_from_quat_wxyz, rpy_from_quat_wxyz

    stamp, t, q = found.header.stamp, found.transform.translation, found.transform.rotation
    quat_wxyz = (q.w, q.x, q.y, q.z)
    rpy = rpy_from_quat_wxyz(quat_wxyz).tolist()
    matrix = matrix_from_quat_wxyz(quat_wxyz).tolist()
    rows = [[*row, p] for row, p in zip(matrix, (t.x, t.y, t.z), strict=True)]
    return "\n".join(
        [
            f"At time {stamp.sec}.{stamp.nanosec:09d}",
            f"- Translation: [{_row((t.x, t.y, t.z))}]",
            f"- Rotation: in Quaternion (xyzw) [{_row((q.x, q.y, q.z, q.w))}]",
            f"- Rotation: in RPY (radian) [{_row(rpy)}]",
            f"- Rotation: in RPY (degree) [{_row(map(math.degrees, rpy))}]",
            "- Matrix:",
            *("".join(f" {value:6.3f}" for value in row) for row in [*rows, [0.0, 0.0, 0.0, 1.0]]),
        ]
    )


def _row(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)
