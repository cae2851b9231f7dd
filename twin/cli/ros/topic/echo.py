"""`twin topic echo`: messages as they come, as YAML or comma-separated values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.option_groups import takes
from twin.cli.ros.endings import endless
from twin.cli.ros.joining import Joining, joins
from twin.cli.ros.topic.options import Filter, NodeName, SubscriptionQos, TopicName
from twin.errors import BridgeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from twin.bridge.graph import EndpointInfo
    from twin.bridge.qos import QoS
    from twin.bridge.topics.raw import RawSample
    from twin.bridge.types.fields import Field
    from twin.cli.ros.topic.process import TopicProcess


@dataclass(frozen=True, kw_only=True)
class EchoStyle:
    """What is printed of a message, and how."""

    csv: Annotated[
        bool, typer.Option("--csv", help="All fields on one line, separated by commas; with -i, that first.")
    ] = False
    field: Annotated[
        str | None, typer.Option(metavar="F", help="Only a part of the message, such as pose.pose.position.")
    ] = None
    full_length: Annotated[bool, typer.Option("--full-length", "-f", help="Cut no arrays and texts.")] = False
    truncate_length: Annotated[
        int,
        typer.Option("--truncate-length", "-l", min=0, metavar="N", help="Where to cut arrays and texts."),
    ] = 128
    no_arr: Annotated[bool, typer.Option("--no-arr", help="Only type and length of arrays.")] = False
    no_str: Annotated[bool, typer.Option("--no-str", help="Only the length of texts.")] = False
    flow_style: Annotated[bool, typer.Option("--flow-style", help="Lists on one line.")] = False
    raw: Annotated[bool, typer.Option("--raw", help="The bytes as they travel (CDR).")] = False
    message_info: Annotated[
        bool, typer.Option("--include-message-info", "-i", help="Times and sequence numbers too.")
    ] = False
    no_lost: Annotated[
        bool, typer.Option("--no-lost-messages", help="Do not report messages that were lost.")
    ] = False
    clear: Annotated[bool, typer.Option("--clear", "-c", help="Clear the screen before a message.")] = False

    def __post_init__(self) -> None:
        if self.field is not None and not self.path:
            valid = "names separated by dots, such as pose.pose"
            raise BridgeError(f"Invalid field value '{self.field}'; valid: {valid}")

    @property
    def path(self) -> list[str]:
        """Names of the field and what is around it; none for the whole message."""
        return [part for part in (self.field or "").split(".") if part]


@joins
@takes("style", EchoStyle)
@takes("choice", SubscriptionQos)
@endless
def echo(
    topic: TopicName,
    message_type: Annotated[
        str | None, typer.Argument(metavar="TYPE", help="If nobody publishes yet.", show_default=False)
    ] = None,
    filter_expr: Filter = None,
    once: Annotated[bool, typer.Option("--once", help="One message, then end.")] = False,
    timeout: Annotated[
        float | None, typer.Option(min=0.001, metavar="S", help="End after so many seconds.")
    ] = None,
    *,
    style: EchoStyle,
    choice: SubscriptionQos,
    node_name: NodeName = None,
    joining: Joining,
) -> None:
    """Print messages."""
    from twin.cli.ros.topic.filter import compile_filter
    from twin.cli.ros.topic.process import Listener, open_topics

    accepts = compile_filter(filter_expr) if filter_expr else None
    with open_topics(joining, node_name=node_name) as process:
        name = process.topic(topic)
        if message_type is None:
            endpoints = process.wait_for_topic(name, timeout)
            cls = None if style.raw and accepts is None else process.message_class(endpoints)
            listener = Listener.of_topic(process, name, endpoints, cls)
        else:
            listener = Listener.of_type(process, name, message_type)
        printer = EchoPrinter(process, listener, style, accepts, once=once)
        listener.listen(chosen_qos(choice, process.graph.publishers(name)), printer.on_sample)
        process.live.spin(lambda: printer.is_done, timeout)


def chosen_qos(choice: SubscriptionQos, publishers: tuple[EndpointInfo, ...]) -> QoS:
    """Return what is asked for, or what all publishers offer."""
    from dataclasses import replace

    from twin.bridge.tools.relay import qos_for_all

    qos = choice.qos()
    if choice.is_given or not publishers:
        return qos
    matching = qos_for_all(publishers)
    for given, best, worst in (
        ([p.qos.reliability for p in publishers], "reliable", "best_effort"),
        ([p.qos.durability for p in publishers], "transient_local", "volatile"),
    ):
        if best in given and worst in given:
            policy = "Reliability" if best == "reliable" else "Durability"
            typer.echo(
                f"Some, but not all, publishers are offering QoS{policy}Policy.{best.upper()}. Falling "
                f"back to QoS{policy}Policy.{worst.upper()} as it will connect to all publishers",
                err=True,
            )
    return replace(qos, reliability=matching.reliability, durability=matching.durability)


class EchoPrinter:
    """Prints samples, and says when some were lost."""

    def __init__(
        self,
        process: TopicProcess,
        listener: Any,
        style: EchoStyle,
        accepts: Callable[[Any], bool] | None,
        *,
        once: bool = False,
    ) -> None:
        self._process = process
        self._decode = listener.decode
        self._style = style
        self._accepts = accepts
        self._sequences: dict[bytes, int] = {}
        self._lost = 0
        self._once = once
        self.is_done = False
        """Whether one was printed that shall be the only one: several may have come before this is asked."""

    def on_sample(self, sample: RawSample) -> None:
        """Print a sample, if the filter lets it through."""
        style = self._style
        if self.is_done:
            return
        if not style.no_lost:
            self._count_lost(sample)
        if style.raw and self._accepts is None:
            value: Any = sample.payload
            field = None
        else:
            value = self._decode(sample)
            if value is None:
                return
            value, field = self._selected(value)
            if self._accepts is not None and not self._accepts(value):
                return
            value = sample.payload if style.raw else value
        self.is_done = self._once
        if style.clear:
            typer.echo("\x1b[H\x1b[2J")
        typer.echo(self._text(sample, value, field), nl=False)

    def _selected(self, message: Any) -> tuple[Any, Field | None]:
        """Return the part that --field names; None as field if it is a whole message."""
        from twin.bridge.types.fields import fields_of

        value, field = message, None
        for name in self._style.path:
            fields = {each.name: each for each in fields_of(value.__msgtype__)} if _is_message(value) else {}
            if name not in fields:
                owner = value.__msgtype__ if _is_message(value) else type(value).__name__
                valid = f"; valid: {', '.join(fields)}" if fields else ""
                raise BridgeError(
                    f"Invalid field '{'.'.join(self._style.path)}': {owner} has no field '{name}'{valid}"
                )
            field = fields[name]
            value = getattr(value, field.attribute)
        return value, None if _is_message(value) else field

    def _text(self, sample: RawSample, value: Any, field: Field | None) -> str:
        from twin.bridge.messages.as_text import message_to_csv, message_to_yaml, to_yaml
        from twin.cli.ros.topic.values import value_text

        style = self._style
        info = self._info(sample) if style.message_info else {}
        if not _is_message(value):
            head = f"---Got new message, message info:---\n{info}\n---Message data:---\n" if info else ""
            return f"{head}{value if field is None else value_text(value, field)}\n---\n"
        length = None if style.full_length else style.truncate_length
        cut: Any = {"truncate_length": length, "no_arr": style.no_arr, "no_str": style.no_str}
        if style.csv:
            return ",".join([*map(str, info.values()), message_to_csv(value, **cut)]) + "\n"
        head = f"{to_yaml(dict(sorted(info.items())))}---\n" if info else ""
        return f"{head}{message_to_yaml(value, **cut, flow_style=style.flow_style)}---\n"

    def _info(self, sample: RawSample) -> dict[str, int]:
        """Return rclpy's message info; like rmw_zenoh it does not number what is received."""
        return {
            "source_timestamp": sample.source.time_ns,
            "received_timestamp": self._process.now_ns,
            "publication_sequence_number": sample.source.sequence,
            "reception_sequence_number": 0,
        }

    def _count_lost(self, sample: RawSample) -> None:
        number, before = sample.source.sequence, self._sequences.get(sample.source.gid)
        self._sequences[sample.source.gid] = number
        change = 0 if before is None else number - before - 1
        if change > 0:
            self._lost += change
            typer.echo(
                f"A message was lost!!!\n\ttotal count change:{change}\n\ttotal count: {self._lost}---\n",
                nl=False,
            )


def _is_message(value: Any) -> bool:
    return hasattr(value, "__msgtype__")
