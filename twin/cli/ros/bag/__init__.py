"""`twin bag`: record topics, play them, look at bags and convert them; as `ros2 bag`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from twin.cli.option_groups import example
from twin.cli.ros.bag.rerun import Bag, rerun
from twin.cli.ros.joining import Joining, joins

app = typer.Typer(no_args_is_help=True, help="Bags: record, play, look, convert; as `ros2 bag`.")

_NS = 1e9

Topics = Annotated[list[str] | None, typer.Option("--topics", metavar="TOPIC", help="Only this; repeatable.")]
Regex = Annotated[str, typer.Option("--regex", "-e", help="Topics whose whole name matches.")]
Exclude = Annotated[str, typer.Option("--exclude-regex", "-x", help="Not topics whose whole name matches.")]
Compression = Annotated[str, typer.Option(help="none, zstd, or with mcap lz4.")]

app.command(no_args_is_help=True, epilog=example("twin bag rerun drive/bag nodes.py:make"))(rerun)


@app.command(no_args_is_help=True, epilog=example("twin bag record -a -o drive"))
@joins
def record(
    topics: Annotated[list[str] | None, typer.Argument(metavar="TOPIC", show_default=False)] = None,
    everything: Annotated[bool, typer.Option("--all", "-a", help="All topics, also those to come.")] = False,
    regex: Regex = "",
    exclude: Exclude = "",
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="DIR", help="Folder of the bag.", show_default="rosbag2_<time>"
        ),
    ] = None,
    storage: Annotated[str, typer.Option("--storage", help="mcap or sqlite3.")] = "mcap",
    compression: Compression = "none",
    hidden: Annotated[bool, typer.Option("--include-hidden-topics", help="Those of actions too.")] = False,
    *,
    joining: Joining,
) -> None:
    """Record topics until Ctrl-C or SIGTERM; a killed recorder loses at most the last second."""
    from twin.bridge.bags.compression import COMPRESSIONS, one_of
    from twin.bridge.bags.recorder import Recorder, RecorderConfig
    from twin.bridge.bags.topic_choice import TopicChoice
    from twin.bridge.bags.writer import STORAGES, BagConfig
    from twin.bridge.wire.interrupts import noted_signals
    from twin.cli.run.folders import bag_folder

    if not (topics or everything or regex):
        raise typer.BadParameter("name topics, or give --all or --regex")
    names = () if everything else tuple(name if name.startswith("/") else f"/{name}" for name in topics or ())
    config = RecorderConfig(
        topics=TopicChoice(topics=names, regex="" if everything else regex, exclude=exclude),
        hidden=hidden,
        use_sim_time=joining.use_sim_time,
        bag=BagConfig(
            storage=one_of(STORAGES, storage, "storage of bags"),
            compression=one_of(COMPRESSIONS, compression, "compression"),
        ),
    )
    folder = output or bag_folder()
    with joining.open() as process, noted_signals() as signals:
        recorder = Recorder(process.bus, folder, config)
        _tell([f"recording to {folder}; Ctrl-C ends it"])
        try:
            while not signals:
                process.spin_once()
                recorder.update()
        finally:
            recorder.close()
    _tell(_losses(recorder))
    typer.echo(f"{recorder.count} messages on {len(recorder.topics)} topics in {folder}")


@app.command(no_args_is_help=True, epilog=example("twin bag play drive --clock"))
@joins
def play(
    bag: Bag,
    rate: Annotated[float, typer.Option("--rate", "-r", help="Bag seconds per second.")] = 1.0,
    topics: Topics = None,
    regex: Regex = "",
    exclude: Exclude = "",
    loop: Annotated[bool, typer.Option("--loop", "-l", help="Begin again at the end.")] = False,
    remap: Annotated[
        list[str] | None, typer.Option("--remap", "-m", metavar="OLD:=NEW", help="Another name; repeatable.")
    ] = None,
    clock: Annotated[bool, typer.Option("--clock", help="Publish /clock from the bag's time.")] = False,
    clock_hz: Annotated[float, typer.Option("--clock-hz", help="How often.")] = 40.0,
    delay: Annotated[
        float, typer.Option("--delay", "-d", help="Wait so many seconds before each round.")
    ] = 0.0,
    start_offset: Annotated[
        float, typer.Option("--start-offset", help="Begin so many seconds into the bag.")
    ] = 0.0,
    duration: Annotated[
        float | None, typer.Option("--playback-duration", help="Play so many seconds of the bag.")
    ] = None,
    until: Annotated[
        float | None,
        typer.Option("--playback-until-sec", help="Play until this time, in seconds since the epoch."),
    ] = None,
    start_paused: Annotated[
        bool, typer.Option("--start-paused", "-p", help="Wait for ~/resume of /rosbag2_player.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Publish the messages of a bag in the rhythm in which they were received."""
    from twin.bridge.bags.player import Player, PlayerConfig
    from twin.bridge.bags.reader import BagReader
    from twin.bridge.bags.topic_choice import TopicChoice
    from twin.bridge.wire.interrupts import noted_signals

    config = PlayerConfig(
        rate=rate,
        loop=loop,
        start_offset_ns=_ns(start_offset, "--start-offset"),
        duration_ns=None if duration is None else _ns(duration, "--playback-duration"),
        until_ns=None if until is None else _ns(until, "--playback-until-sec"),
        topics=TopicChoice(topics=tuple(topics or ()), regex=regex, exclude=exclude),
        remap=_remappings(remap or []),
        clock_hz=clock_hz if clock else None,
        delay_s=delay,
        start_paused=start_paused,
    )
    with BagReader(bag) as reader:
        _tell(reader.notices)
        with joining.open() as process, noted_signals() as signals:
            player = Player(reader, process, config)
            _tell(f"{topic} is left out: the hash of its type is not known" for topic in player.left_out)
            player.play(lambda: bool(signals))


@app.command(no_args_is_help=True, epilog=example("twin bag info drive"))
def info(bag: Bag) -> None:
    """Say what is in a bag, of ROS 2 or ROS 1."""
    from twin.bridge.bags.reader import BagReader
    from twin.bridge.bags.report import report

    with BagReader(bag) as reader:
        _tell(reader.notices)
        typer.echo(report(reader), nl=False)


@app.command(no_args_is_help=True, epilog=example("twin bag convert drive -o drive.bag"))
def convert(
    bag: Bag,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR|FILE",
            help="The new bag: a folder, or a .bag file.",
            show_default=False,
        ),
    ],
    storage: Annotated[
        str, typer.Option("--storage", "-s", help="mcap, sqlite3 or rosbag1.", show_default="mcap, or by -o")
    ] = "",
    topics: Topics = None,
    regex: Regex = "",
    exclude: Exclude = "",
    compression: Compression = "none",
) -> None:
    """Write a bag into another storage; one that was cut off becomes whole."""
    from twin.bridge.bags import convert as converter
    from twin.bridge.bags.compression import COMPRESSIONS, one_of
    from twin.bridge.bags.topic_choice import TopicChoice

    target = storage or ("rosbag1" if output.suffix == ".bag" else "mcap")
    done = converter.convert(
        bag,
        output,
        storage=one_of(converter.TARGETS, target, "storage of bags"),
        topics=TopicChoice(topics=tuple(topics or ()), regex=regex, exclude=exclude),
        compression=one_of(COMPRESSIONS, compression, "compression"),
    )
    _tell(done.notices)
    typer.echo(f"{done.messages} messages on {done.topics} topics in {output}")


def _losses(recorder: Any) -> Iterator[str]:
    if recorder.dropped:
        yield f"{recorder.dropped} messages were dropped: they came faster than they could be written"
    for topic, count in sorted(recorder.refused.items()):
        yield f"{count} messages on {topic} are left out: they are of another type than its first"
    for topic in recorder.undefined:
        yield f"the definition of {topic}'s type is not known here: the bag has its messages without it"


def _tell(notices: Iterable[str]) -> None:
    from twin.cli.console import stderr

    for notice in notices:
        stderr().print(notice, markup=False, highlight=False, soft_wrap=True)


def _ns(seconds: float, option: str) -> int:
    if not 0.0 <= seconds < 1e11:
        raise typer.BadParameter(f"{option} {seconds:g}: must be a number of seconds, not less than 0")
    return round(seconds * _NS)


def _remappings(rules: list[str]) -> dict[str, str]:
    pairs = [rule.split(":=") for rule in rules]
    wrong = [rule for rule, pair in zip(rules, pairs, strict=True) if len(pair) != 2 or not all(pair)]
    if wrong:
        raise typer.BadParameter(f"--remap {wrong[0]}: must be OLD:=NEW, such as /scan:=/front/scan")
    return {old if old.startswith("/") else f"/{old}": new for old, new in pairs}
