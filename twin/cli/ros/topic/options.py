"""Options that several commands about topics share: names, quality of service."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from twin.bridge.qos import QoS

TopicName = Annotated[str, typer.Argument(metavar="TOPIC", help="Such as /chatter.", show_default=False)]
NodeName = Annotated[
    str | None,
    typer.Option("--node-name", "-n", metavar="NAME", help="Name of the node.", show_default="a hidden one"),
]
Filter = Annotated[
    str | None,
    typer.Option("--filter", metavar="EXPR", help='Only messages m for which this is true: "m.data > 3".'),
]
Window = Annotated[int, typer.Option("--window", "-w", min=1, metavar="N", help="Messages to average over.")]


# rclpy's presets and policies.
Profile = Literal[
    "default",
    "system_default",
    "sensor_data",
    "services_default",
    "parameters",
    "parameter_events",
    "action_status_default",
]
History = Literal["keep_last", "keep_all", "system_default"]
Reliability = Literal["reliable", "best_effort", "system_default"]
Durability = Literal["volatile", "transient_local", "system_default"]


@dataclass(frozen=True, kw_only=True)
class SubscriptionQos:
    """What the options of a subscription say about quality of service."""

    qos_profile: Annotated[Profile, typer.Option(help="Quality of service.")] = "sensor_data"
    qos_depth: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Samples kept.", show_default="the profile's")
    ] = None
    qos_history: Annotated[
        History | None, typer.Option(help="Keep all samples, or so many.", show_default="the profile's")
    ] = None
    qos_reliability: Annotated[
        Reliability | None, typer.Option(help="Override.", show_default="what all publishers offer")
    ] = None
    qos_durability: Annotated[
        Durability | None, typer.Option(help="Override.", show_default="what all publishers offer")
    ] = None

    @property
    def is_given(self) -> bool:
        """Whether more than the profile is asked for."""
        choices = (self.qos_depth, self.qos_history, self.qos_reliability, self.qos_durability)
        return any(choice is not None for choice in choices)

    def qos(self) -> QoS:
        """Return the profile with what overrides it."""
        from twin.bridge.qos import LATCHED, PARAMETER_EVENTS, SENSOR_DATA, SYSTEM_DEFAULT, QoS

        presets: dict[Profile, QoS] = {
            "system_default": SYSTEM_DEFAULT,
            "sensor_data": SENSOR_DATA,
            "parameters": PARAMETER_EVENTS,
            "parameter_events": PARAMETER_EVENTS,
            "action_status_default": LATCHED,
        }
        preset = presets.get(self.qos_profile, QoS())
        reliability = self.qos_reliability or preset.reliability
        durability = self.qos_durability or preset.durability
        return QoS(
            depth=self.qos_depth or preset.depth,
            history="keep_all" if self.qos_history == "keep_all" else "keep_last",
            reliability="best_effort" if reliability == "best_effort" else "reliable",
            durability="transient_local" if durability == "transient_local" else "volatile",
        )


@dataclass(frozen=True, kw_only=True)
class PublisherQos(SubscriptionQos):
    """What the options of a publisher say about it."""

    qos_profile: Annotated[Profile, typer.Option(help="Quality of service.")] = "default"
    qos_reliability: Annotated[
        Reliability | None, typer.Option(help="Override.", show_default="the profile's")
    ] = None
    qos_durability: Annotated[
        Durability | None,
        typer.Option(
            help="Override; transient_local: late subscribers get it too.", show_default="the profile's"
        ),
    ] = None
