"""The QoS of recorded publishers, as rosbag2 writes it (metadata versions 4 to 9).

Source: rosbag2_storage/src/rosbag2_storage/qos.cpp, rmw/qos_string_conversions.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import yaml
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability

from twin.bridge.qos import QoS

_POLICIES: dict[str, type[Enum]] = {
    "history": QosHistory,
    "reliability": QosReliability,
    "durability": QosDurability,
    "liveliness": QosLiveliness,
}
_PERIODS = ("deadline", "lifespan", "liveliness_lease_duration")
_UNKNOWN_DEPTH = 10
"""rosbag2 plays with this depth what was recorded over DDS, which does not tell depths."""


@dataclass(frozen=True)
class Period:
    """A duration in two numbers."""

    sec: int = 9223372036
    nsec: int = 854775807

    @classmethod
    def of(cls, time_ns: int) -> Period:
        """Return a duration [ns]."""
        return cls(*divmod(time_ns, 1_000_000_000))


INFINITE = Period()
"""RMW_DURATION_INFINITE."""
_FORMER_INFINITE = (Period(0x7FFFFFFF, 0xFFFFFFFF), Period(0x7FFFFFFF, 0x7FFFFFFF))
"""What Fast DDS and Connext wrote in Foxy."""


@dataclass(frozen=True, kw_only=True)
class OfferedQoS:
    """What one publisher offered; fields and their order are those of rosbag2."""

    history: str = "unknown"
    depth: int = 0
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline: Period = INFINITE
    lifespan: Period = INFINITE
    liveliness: str = "automatic"
    liveliness_lease_duration: Period = INFINITE
    avoid_ros_namespace_conventions: bool = False

    @classmethod
    def of(cls, qos: QoS) -> OfferedQoS:
        """Return the profile of one of our publishers."""
        return cls(
            history=qos.history,
            depth=qos.depth,
            reliability=qos.reliability,
            durability=qos.durability,
            deadline=Period.of(qos.deadline_ns),
            lifespan=Period.of(qos.lifespan_ns),
            liveliness=qos.liveliness,
            liveliness_lease_duration=Period.of(qos.lease_ns),
        )

    @property
    def latched(self) -> bool:
        """Whether late subscribers got the last samples."""
        return self.durability == "transient_local"


def to_yaml(profiles: Iterable[OfferedQoS]) -> str:
    """Return profiles as the `offered_qos_profiles` of an MCAP channel."""
    return yaml.safe_dump(to_data(profiles), sort_keys=False, default_flow_style=False).strip()


def to_data(profiles: Iterable[OfferedQoS]) -> list[dict[str, Any]]:
    """Return profiles as in metadata.yaml, version 9."""
    return [asdict(profile) for profile in profiles]


def parse(value: Any) -> tuple[OfferedQoS, ...]:
    """Read `offered_qos_profiles`, a YAML text or what it holds; numbers (before version 9) or names.

    What cannot be read counts as not offered: old bags must stay readable.
    """
    try:
        items = yaml.safe_load(value) if isinstance(value, str) else value
        return tuple(_profile(item) for item in items or ())
    except (yaml.YAMLError, TypeError, KeyError, ValueError, IndexError, AttributeError):
        return ()


def from_rosbags(qos: Qos) -> OfferedQoS:
    """Return rosbags' form of a profile as ours."""
    item = qos._asdict()
    policies = {name: item[name].name.lower() for name in _POLICIES}
    return _profile(item | policies | {name: item[name]._asdict() for name in _PERIODS})


def publisher_qos(profiles: Sequence[OfferedQoS]) -> QoS:
    """Return the QoS to play a topic with: latched if a publisher was, reliable unless none was.

    The depth of a latched topic is the sum over its publishers: one player stands for all of them. Deadline,
    lifespan and liveliness are not promised: the rate of playing would break them.
    """
    if not profiles:
        return QoS(depth=_UNKNOWN_DEPTH)
    latched = [profile for profile in profiles if profile.latched]
    reliable = any(profile.reliability != "best_effort" for profile in profiles)
    depths = [profile.depth or 1 for profile in latched] or [profile.depth for profile in profiles]
    keeps_all = all(profile.history == "keep_all" for profile in profiles)
    return QoS(
        depth=sum(depths) if latched else max(depths) or _UNKNOWN_DEPTH,
        reliability="reliable" if reliable else "best_effort",
        durability="transient_local" if latched else "volatile",
        history="keep_all" if keeps_all else "keep_last",
    )


def _profile(item: dict[str, Any]) -> OfferedQoS:
    values: dict[str, Any] = {name: _name(item[name], policy) for name, policy in _POLICIES.items()}
    values |= {name: _period(item[name]) for name in _PERIODS}
    return OfferedQoS(
        **values,
        depth=int(item["depth"]),
        avoid_ros_namespace_conventions=bool(item["avoid_ros_namespace_conventions"]),
    )


def _name(value: str | int, policy: type[Enum]) -> str:
    if isinstance(value, int):
        return policy(value).name.lower()
    return value if value in [each.name.lower() for each in policy] else "unknown"


def _period(item: dict[str, int]) -> Period:
    period = Period(int(item["sec"]), int(item["nsec"]))
    return INFINITE if period in _FORMER_INFINITE else period
