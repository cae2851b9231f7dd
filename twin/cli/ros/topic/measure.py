"""`twin topic hz`, `bw`, `delay`: how often, how much, how late."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.ros.endings import endless
from twin.cli.ros.joining import Joining, joins
from twin.cli.ros.topic.options import Filter, TopicName, Window
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.tools.statistics import Bandwidth, RateStatistics, Spread
    from twin.bridge.topics.raw import RawSample
    from twin.cli.ros.topic.process import TopicProcess

_SECOND_NS = 1_000_000_000


@joins
@endless
def hz(
    topics: Annotated[
        list[str], typer.Argument(metavar="TOPIC", help="Such as /chatter.", show_default=False)
    ],
    window: Window = 10_000,
    filter_expr: Filter = None,
    wall_time: Annotated[
        bool, typer.Option("--wall-time", help="Measure in wall time whatever --use-sim-time says.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Print the average publishing rate, every second."""
    from twin.bridge.tools.statistics import RateStatistics
    from twin.cli.ros.topic.filter import compile_filter
    from twin.cli.ros.topic.process import open_topics

    accepts = compile_filter(filter_expr) if filter_expr else None
    with open_topics(joining.by_wall_time if wall_time else joining) as process:
        rates: dict[str, RateStatistics] = {}
        for topic in topics:
            name = process.topic(topic)
            rates[name] = RateStatistics(window)
            _count(process, name, rates[name], accepts)
            if len(topics) > 1:
                typer.echo(f"Subscribed to [{name}]")
        if len(rates) > 1:
            _every_second(process, lambda: _table(rates))
        while True:
            process.live.spin_once()
            for rate in rates.values():
                if (report := rate.report()) is not None:
                    typer.echo(spread_text("average rate", rate_hz(report), report))


@joins
@endless
def bw(topic: TopicName, window: Window = 100, *, joining: Joining) -> None:
    """Print the bandwidth that a topic uses, every second."""
    from twin.bridge.tools.statistics import BandwidthStatistics
    from twin.cli.ros.topic.process import open_topics

    with open_topics(joining) as process:
        statistics = BandwidthStatistics(window)
        name = process.topic(topic)
        _listen(
            process, name, lambda sample, _: statistics.add(process.now_ns, len(sample.payload)), decode=False
        )
        typer.echo(f"Subscribed to [{name}]")
        _every_second(process, lambda: bandwidth_text(statistics.report(process.now_ns)))


@joins
@endless
def delay(topic: TopicName, window: Window = 10_000, *, joining: Joining) -> None:
    """Print how old messages are by the stamps in their headers, every second."""
    from twin.bridge.msgs import ns
    from twin.bridge.tools.statistics import DelayStatistics
    from twin.bridge.types.fields import fields_of
    from twin.cli.ros.topic.process import open_topics

    with open_topics(joining) as process:
        statistics = DelayStatistics(window)
        name = process.topic(topic)

        def on_message(_: RawSample, message: Any) -> None:
            if statistics.add(process.now_ns, ns(message.header.stamp)):
                typer.echo("time has reset, resetting counters")

        cls = _listen(process, name, on_message)
        if "header" not in {field.name for field in fields_of(cls.__msgtype__)}:
            raise BridgeError(f"msg does not have header: {name} carries {cls.__msgtype__}")

        def report() -> str:
            spread = statistics.report()
            if spread is None:
                return "" if statistics.is_empty else "no new messages"
            return spread_text("average delay", spread.mean * 1e-9, spread)

        _every_second(process, report)


def _listen(
    process: TopicProcess, name: str, callback: Callable[[RawSample, Any], Any], *, decode: bool = True
) -> Any:
    """Call back for every message of a topic, as soon as it exists; return its class."""
    from twin.bridge.qos import SENSOR_DATA
    from twin.cli.ros.topic.process import Listener

    endpoints = process.wait_for_topic(name)
    cls = process.message_class(endpoints) if decode else None
    listener = Listener.of_topic(process, name, endpoints, cls)

    def on_sample(sample: RawSample) -> None:
        message = listener.decode(sample) if decode else None
        if message is not None or not decode:
            callback(sample, message)

    listener.listen(SENSOR_DATA, on_sample)
    return cls


def _count(
    process: TopicProcess, name: str, rate: RateStatistics, accepts: Callable[[Any], bool] | None
) -> None:
    def on_message(_: RawSample, message: Any) -> None:
        if (accepts is None or accepts(message)) and rate.add(process.now_ns):
            typer.echo("time has reset, resetting counters")

    _listen(process, name, on_message, decode=accepts is not None)


def _every_second(process: TopicProcess, report: Callable[[], str]) -> None:
    """Print a report, if there is one, again and again."""

    def tell() -> None:
        if text := report():
            typer.echo(text)

    process.node.create_timer(_SECOND_NS, tell)
    process.live.spin()


def rate_hz(spread: Spread) -> float:
    """Return how often something comes whose gaps [ns] these are."""
    return 1e9 / spread.mean if spread.mean > 0 else 0.0


def spread_text(title: str, value: float, spread: Spread) -> str:
    """Return a mean, and the spread of the times [ns] behind it in seconds."""
    return (
        f"{title}: {value:.3f}\n\tmin: {spread.minimum * 1e-9:.3f}s max: {spread.maximum * 1e-9:.3f}s "
        f"std dev: {spread.std_dev * 1e-9:.5f}s window: {spread.window}"
    )


_HEADER = ("topic", "rate", "min_delta", "max_delta", "std_dev", "window")


def _row(name: str, spread: Spread) -> tuple[str, ...]:
    return (
        name,
        f"{rate_hz(spread):.3f}",
        f"{spread.minimum * 1e-9:.3f}",
        f"{spread.maximum * 1e-9:.3f}",
        f"{spread.std_dev * 1e-9:.5f}",
        str(spread.window),
    )


def _table(rates: dict[str, RateStatistics]) -> str:
    reports = {name: rate.report(at_least_ns=1) for name, rate in rates.items()}
    rows = [_row(name, report) for name, report in reports.items() if report is not None]
    if not rows:
        return ""
    widths = [max(map(len, column)) for column in zip(_HEADER, *rows, strict=True)]
    head = "   ".join(word.center(width) for word, width in zip(_HEADER, widths, strict=True))
    lines = ["   ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) for row in rows]
    return "\n".join([head, "=" * (sum(widths) + 3 * (len(widths) - 1)), *lines, ""])


def bandwidth_text(bandwidth: Bandwidth | None) -> str:
    """Return a bandwidth in the unit that suits it; nothing if it is not known yet."""
    if bandwidth is None:
        return ""
    rate = bandwidth.bytes_per_s
    divisor, unit, digits = (1, "B", 0) if rate < 1e3 else (1e3, "KB", 2) if rate < 1e6 else (1e6, "MB", 2)
    speed, mean, low, high = (
        f"{value / divisor:.{digits}f} {unit}"
        for value in (rate, bandwidth.mean, bandwidth.minimum, bandwidth.maximum)
    )
    return f"{speed}/s from {bandwidth.messages} messages\n\tMessage size mean: {mean} min: {low} max: {high}"
