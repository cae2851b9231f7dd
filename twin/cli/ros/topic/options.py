"""Options that several commands about topics share: names, quality of service."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from twin.bridge.qos import QoS

TopicName = Annotated[str, typer.Argument(metavar="TOPIC", help="Such as /chatter.", show_default=False)]
NodeName = Annotated[
    str | None,
    typer.Option("--node-name", "-n", metavar="NAME", help="Name of the node.", show_default="a hidden one"),
]
Window = Annotated[int, typer.Option("--window", "-w", min=1, metavar="N", help="Messages to average over.")]


class Profile(StrEnum):
    """rclpy's presets."""

    DEFAULT = "default"
    SYSTEM_DEFAULT = "system_default"
    SENSOR_DATA = "sensor_data"
    SERVICES_DEFAULT = "services_default"
    PARAMETERS = "parameters"
    PARAMETER_EVENTS = "parameter_events"
    ACTION_STATUS_DEFAULT = "action_status_default"


class Reliability(StrEnum):
    """Whether lost samples are sent again."""

    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"
    SYSTEM_DEFAULT = "system_default"


class Durability(StrEnum):
    """Whether late subscribers get earlier samples."""

    VOLATILE = "volatile"
    TRANSIENT_LOCAL = "transient_local"
    SYSTEM_DEFAULT = "system_default"


class History(StrEnum):
    """How many samples are kept."""

    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"
    SYSTEM_DEFAULT = "system_default"


@dataclass(frozen=True, kw_only=True)
class QosChoice:
    """What the options say about quality of service."""

    profile: Profile
    depth: int | None
    history: History | None
    reliability: Reliability | None
    durability: Durability | None

    @property
    def is_given(self) -> bool:
        """Whether more than the profile is asked for."""
        return any(
            choice is not None for choice in (self.depth, self.history, self.reliability, self.durability)
        )

    def qos(self) -> QoS:
        """Return the profile with what overrides it."""
        from twin.bridge.qos import LATCHED, PARAMETER_EVENTS, SENSOR_DATA, SYSTEM_DEFAULT, QoS

        presets = {
            Profile.SYSTEM_DEFAULT: SYSTEM_DEFAULT,
            Profile.SENSOR_DATA: SENSOR_DATA,
            Profile.PARAMETERS: PARAMETER_EVENTS,
            Profile.PARAMETER_EVENTS: PARAMETER_EVENTS,
            Profile.ACTION_STATUS_DEFAULT: LATCHED,
        }
        preset = presets.get(self.profile, QoS())
        best_effort, latched = preset.reliability == "best_effort", preset.durability == "transient_local"
        if self.reliability is not None:
            best_effort = self.reliability is Reliability.BEST_EFFORT
        if self.durability is not None:
            latched = self.durability is Durability.TRANSIENT_LOCAL
        return QoS(
            depth=self.depth or preset.depth,
            history="keep_all" if self.history is History.KEEP_ALL else "keep_last",
            reliability="best_effort" if best_effort else "reliable",
            durability="transient_local" if latched else "volatile",
        )


_Depth = Annotated[
    int | None, typer.Option(min=0, metavar="N", help="Samples kept.", show_default="the profile's")
]
_History = Annotated[
    History | None, typer.Option(help="Keep all samples, or so many.", show_default="the profile's")
]


def subscription_qos(
    qos_profile: Annotated[Profile, typer.Option(help="Quality of service.")] = Profile.SENSOR_DATA,
    qos_depth: _Depth = None,
    qos_history: _History = None,
    qos_reliability: Annotated[
        Reliability | None, typer.Option(help="Override.", show_default="what all publishers offer")
    ] = None,
    qos_durability: Annotated[
        Durability | None, typer.Option(help="Override.", show_default="what all publishers offer")
    ] = None,
) -> QosChoice:
    """Return what the options of a subscription say."""
    return QosChoice(
        profile=qos_profile,
        depth=qos_depth,
        history=qos_history,
        reliability=qos_reliability,
        durability=qos_durability,
    )


def publisher_qos(
    qos_profile: Annotated[Profile, typer.Option(help="Quality of service.")] = Profile.DEFAULT,
    qos_depth: _Depth = None,
    qos_history: _History = None,
    qos_reliability: Annotated[
        Reliability | None, typer.Option(help="Override.", show_default="the profile's")
    ] = None,
    qos_durability: Annotated[
        Durability | None,
        typer.Option(
            help="Override; transient_local: late subscribers get it too.", show_default="the profile's"
        ),
    ] = None,
) -> QosChoice:
    """Return what the options of a publisher say."""
    return subscription_qos(qos_profile, qos_depth, qos_history, qos_reliability, qos_durability)
