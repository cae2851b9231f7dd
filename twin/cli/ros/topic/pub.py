"""`twin topic pub`: messages from YAML."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.option_groups import takes
from twin.cli.ros.endings import endless
from twin.cli.ros.joining import Joining, joins
from twin.cli.ros.topic.options import NodeName, PublisherQos, TopicName
from twin.cli.ros.yaml_values import text_of, values_of
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.topics import Publisher
    from twin.cli.ros.topic.process import TopicProcess

_CONNECTED_S = 1.0
"""How long Zenoh may need to route to a subscription that is in the graph [s]."""


@dataclass(frozen=True, kw_only=True)
class PublishPlan:
    """How often, and when to begin and end."""

    rate: Annotated[
        float, typer.Option("--rate", "-r", min=1e-6, metavar="HZ", help="Messages per second.")
    ] = 1.0
    once: Annotated[bool, typer.Option("--once", "-1", help="One message, then end.")] = False
    times: Annotated[
        int,
        typer.Option("--times", "-t", min=0, metavar="N", help="So many, then end.", show_default="no end"),
    ] = 0
    print_every: Annotated[
        int, typer.Option("--print", "-p", min=0, metavar="N", help="Print every N-th message.")
    ] = 1
    """0: never."""
    wait: Annotated[
        int | None,
        typer.Option(
            "--wait-matching-subscriptions",
            "-w",
            min=0,
            metavar="N",
            help="Wait for so many subscriptions.",
            show_default="1 with --once or --times, else 0",
        ),
    ] = None
    max_wait_time_secs: Annotated[
        float | None, typer.Option(min=0.001, metavar="S", help="Wait so many seconds for subscriptions.")
    ] = None
    keep_alive: Annotated[
        float, typer.Option(min=0.0, metavar="S", help="Stay so many seconds after the last message.")
    ] = 0.1

    def __post_init__(self) -> None:
        if self.once and self.times:
            raise BridgeError("--once and --times exclude each other")
        if self.max_wait_time_secs is not None and not self.wait_for:
            raise BridgeError(
                "--max-wait-time-secs option is only effective with --wait-matching-subscriptions, --once or "
                "--times"
            )

    @property
    def count(self) -> int:
        """How many messages; 0: until Ctrl-C."""
        return 1 if self.once else self.times

    @property
    def wait_for(self) -> int:
        """How many subscriptions."""
        return int(self.count > 0) if self.wait is None else self.wait


@joins
@takes("plan", PublishPlan)
@takes("choice", PublisherQos)
@partial(endless, ends_by_itself=lambda given: given["plan"].count > 0)
def pub(
    topic: TopicName,
    message_type: Annotated[
        str, typer.Argument(metavar="TYPE", help="Such as std_msgs/msg/String.", show_default=False)
    ],
    values: Annotated[
        str | None,
        typer.Argument(metavar="VALUES", help="YAML: '{linear: {x: 0.1}}'; a header may be 'auto'."),
    ] = None,
    stdin: Annotated[bool, typer.Option("--stdin", help="Read the values from standard input.")] = False,
    *,
    plan: PublishPlan,
    choice: PublisherQos,
    node_name: NodeName = None,
    joining: Joining,
) -> None:
    """Publish a message once, some times or at a rate."""
    from twin.bridge.messages.as_text import message_repr
    from twin.cli.ros.topic.process import open_topics

    given = values_of(text_of(values, stdin))
    with open_topics(joining, node_name=node_name) as process:
        name = process.topic(topic)
        cls = _message_class(process, name, message_type)
        make = _maker(process, cls, given)
        publisher = process.node.create_publisher(cls, name, choice.qos())
        publish_as_planned(process, publisher, make, plan, message_repr)


def publish_as_planned(
    process: TopicProcess,
    publisher: Publisher[Any],
    make: Callable[[], Any],
    plan: PublishPlan,
    describe: Callable[[Any], str],
) -> None:
    """Publish what `make` returns as often as planned; `describe` is for what is printed."""
    _wait_for_subscriptions(process, publisher, plan)
    typer.echo("publisher: beginning loop")
    count = 0

    def publish() -> None:
        nonlocal count
        count += 1
        message = make()
        if plan.print_every and count % plan.print_every == 0:
            typer.echo(f"publishing #{count}: {describe(message)}\n")
        publisher.publish(message)

    publish()
    if plan.count != 1:
        timer = process.node.create_timer(round(1e9 / plan.rate), publish)
        process.live.spin(lambda: 0 < plan.count <= count)
        timer.cancel()
    process.live.spin(timeout_s=plan.keep_alive)


def _message_class(process: TopicProcess, name: str, typename: str) -> type[Any]:
    """Return the class of a type, learnt from those who use the topic if it is not known here."""
    from twin.bridge import types

    full = types.full_name(typename)
    if types.parts(full).kind != "msg":
        raise BridgeError(f"{full} is no message; topics carry package/msg/Name")
    endpoints = process.endpoints(name)
    same = [e for e in endpoints if e.type == full]
    if endpoints and not same:
        typer.echo(
            f"WARNING: {name} carries {endpoints[0].type}, not {full}: nobody there will hear it", err=True
        )
    return process.message_class(same) if same else types.get(full)


def _maker(process: TopicProcess, cls: type[Any], values: dict[str, Any]) -> Callable[[], Any]:
    """Return what makes the next message: a new one only if it is stamped."""
    from twin.bridge.messages.from_values import message_from_dict

    message = message_from_dict(cls, values, now_ns=process.now_ns)
    if not _is_stamped(values):
        return lambda: message
    return lambda: message_from_dict(cls, values, now_ns=process.now_ns)


def _is_stamped(values: Any) -> bool:
    if isinstance(values, dict):
        return any(map(_is_stamped, values.values()))
    return any(map(_is_stamped, values)) if isinstance(values, list) else values in ("auto", "now")


def _wait_for_subscriptions(process: TopicProcess, publisher: Publisher[Any], plan: PublishPlan) -> None:
    def count() -> int:
        found = process.graph.subscriptions(publisher.name)
        return sum(endpoint.type == publisher.codec.msgtype for endpoint in found)

    waited_s = 0.0
    while count() < plan.wait_for:
        if plan.max_wait_time_secs is not None and waited_s >= plan.max_wait_time_secs:
            raise BridgeError(
                f"Timed out waiting for subscribers: Expected {plan.wait_for} subcribers but only got "
                f"{count()} subscribers"
            )
        typer.echo(f"Waiting for at least {plan.wait_for} matching subscription(s)...")
        step_s = min(1.0, plan.max_wait_time_secs or 1.0)
        process.live.spin(lambda: count() >= plan.wait_for, timeout_s=step_s)
        waited_s += step_s
    # A publisher that nobody waits for may still be on its way to somebody.
    process.live.spin(lambda: publisher.has_subscribers, timeout_s=_CONNECTED_S if plan.wait_for else 0.1)
