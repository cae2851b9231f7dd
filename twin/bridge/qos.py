"""Quality of service: what a topic promises, and how liveliness tokens spell it.

Source: rmw_zenoh qos.cpp (defaults), liveliness_utils.cpp (spelling); the numbers are rmw/types.h's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeVar

Reliability = Literal["reliable", "best_effort"]
Durability = Literal["volatile", "transient_local"]
History = Literal["keep_last", "keep_all"]
Liveliness = Literal["automatic", "manual_by_topic"]

INFINITE_NS = 2**63 - 1
"""RMW_DURATION_INFINITE [ns]: 9223372036 s and 854775807 ns."""
RMW_DEFAULT_DEPTH = 42
"""rmw_zenoh's, which tokens leave out."""
_S = 1_000_000_000


@dataclass(frozen=True, kw_only=True)
class QoS:
    """A topic's quality of service."""

    depth: int = 10
    """Samples kept: by a transient_local publisher for late subscribers, by a subscription between spins."""
    reliability: Reliability = "reliable"
    durability: Durability = "volatile"
    """transient_local: a subscription that comes later gets the last `depth` samples ("latched")."""
    history: History = "keep_last"
    """keep_all: a subscription drops nothing between spins; a reliable publisher waits for slow readers."""
    deadline_ns: int = INFINITE_NS
    """Longest time between two samples that is promised [ns]; announced, as in rmw_zenoh no event follows."""
    lifespan_ns: int = INFINITE_NS
    """How long a sample is good for [ns]; a subscription drops what has waited longer for its spin."""
    liveliness: Liveliness = "automatic"
    lease_ns: int = INFINITE_NS
    """Liveliness lease [ns]; announced, the link's own lease is what counts, as in rmw_zenoh."""

    def __post_init__(self) -> None:
        """Refuse a depth below one, and times that are not positive."""
        if self.depth < 1:
            raise ValueError(f"a QoS depth of {self.depth}; valid is 1 or more")
        for name in ("deadline_ns", "lifespan_ns", "lease_ns"):
            if not 0 < getattr(self, name) <= INFINITE_NS:
                raise ValueError(f"a QoS {name} of {getattr(self, name)}; valid is 1 to {INFINITE_NS} ns")


SENSOR_DATA = QoS(depth=5, reliability="best_effort")
"""rclpy's qos_profile_sensor_data."""
LATCHED = QoS(depth=1, durability="transient_local")
"""Maps, descriptions, static transforms, action status."""
PARAMETER_EVENTS = QoS(depth=1000)
"""rclpy's qos_profile_parameters and qos_profile_parameter_events."""
SYSTEM_DEFAULT = QoS(depth=RMW_DEFAULT_DEPTH)
"""What rmw_zenoh makes of rclpy's qos_profile_system_default."""


def as_qos(qos: QoS | int) -> QoS:
    """Return a QoS; a number is the depth of a reliable, volatile one, as in rclpy."""
    return QoS(depth=qos) if isinstance(qos, int) else qos


def profile(
    *,
    depth: int = 0,
    reliability: str = "system_default",
    durability: str = "system_default",
    history: str = "system_default",
    liveliness: str = "system_default",
    deadline_ns: int = 0,
    lifespan_ns: int = 0,
    lease_ns: int = 0,
) -> QoS:
    """Return a QoS of rmw's words.

    'system_default', 'best_available', 'unknown' and zeros are rmw_zenoh's defaults.

    Raises:
        ValueError: another word, or a negative number.
    """
    return QoS(
        depth=depth or RMW_DEFAULT_DEPTH,
        reliability=_word(reliability, ("reliable", "best_effort")),
        durability=_word(durability, ("volatile", "transient_local")),
        history=_word(history, ("keep_last", "keep_all")),
        liveliness=_word(liveliness, ("automatic", "manual_by_topic")),
        deadline_ns=deadline_ns or INFINITE_NS,
        lifespan_ns=lifespan_ns or INFINITE_NS,
        lease_ns=lease_ns or INFINITE_NS,
    )


W = TypeVar("W", bound=str)
_DEFAULTS = ("system_default", "best_available", "unknown")


def _word(word: str, valid: tuple[W, ...]) -> W:
    if word in _DEFAULTS:
        return valid[0]
    for known in valid:
        if known == word:
            return known
    raise ValueError(f"{word!r} is no QoS policy; valid: {', '.join((*valid, *_DEFAULTS))}")


_RELIABILITY = {"0": "reliable", "1": "reliable", "2": "best_effort", "3": "reliable"}
_DURABILITY = {"0": "volatile", "1": "transient_local", "2": "volatile", "3": "volatile"}
_HISTORY = {"0": "keep_last", "1": "keep_last", "2": "keep_all", "3": "keep_last"}
_LIVELINESS = {"0": "automatic", "1": "automatic", "3": "manual_by_topic", "4": "automatic", "5": "automatic"}


def qos_string(qos: QoS) -> str:
    """Return a QoS as tokens spell it; what equals the default (reliable, volatile, depth 42) is empty."""
    reliability = "2" if qos.reliability == "best_effort" else ""
    durability = "1" if qos.durability == "transient_local" else ""
    history = "2" if qos.history == "keep_all" else ""
    depth = "" if qos.depth == RMW_DEFAULT_DEPTH else str(qos.depth)
    liveliness = "3" if qos.liveliness == "manual_by_topic" else ""
    deadline, lifespan, lease = map(_duration, (qos.deadline_ns, qos.lifespan_ns, qos.lease_ns))
    return f"{reliability}:{durability}:{history},{depth}:{deadline}:{lifespan}:{liveliness},{lease}"


def parse_qos(text: str) -> QoS:
    """Return the QoS that a token spells; more fields than rmw_zenoh's are ignored.

    Raises:
        ValueError: not in that form.
    """
    fields = [field.split(",") for field in text.split(":")]
    if len(fields) < 6 or any(len(f) < n for f, n in zip(fields, (1, 1, 2, 2, 2, 3), strict=False)):
        raise ValueError(f"{text!r} is no QoS of rmw_zenoh, which looks like '2::,5:,:,:,,'")
    (reliability, *_), (durability, *_), (history, depth, *_), deadline, lifespan, (liveliness, *lease) = (
        fields[:6]
    )
    try:
        return profile(
            depth=_number(depth, 0),
            reliability=_RELIABILITY[reliability or "1"],
            durability=_DURABILITY[durability or "2"],
            history=_HISTORY[history or "1"],
            liveliness=_LIVELINESS[liveliness or "1"],
            deadline_ns=_nanoseconds(deadline),
            lifespan_ns=_nanoseconds(lifespan),
            lease_ns=_nanoseconds(lease),
        )
    except KeyError as error:
        raise ValueError(f"{text!r} has an unknown policy {error}") from error


def _duration(nanoseconds: int) -> str:
    """Return 'seconds,nanoseconds'; each is left out where it is that of an infinite duration."""
    parts = zip(divmod(nanoseconds, _S), divmod(INFINITE_NS, _S), strict=True)
    return ",".join("" if part == infinite else str(part) for part, infinite in parts)


def _nanoseconds(parts: list[str]) -> int:
    seconds, rest = (_number(p, d) for p, d in zip(parts[:2], divmod(INFINITE_NS, _S), strict=True))
    return min(seconds * _S + rest, INFINITE_NS)


def _number(text: str, default: int) -> int:
    if not text:
        return default
    if not (text.isascii() and text.isdecimal() and len(text) <= 20):
        raise ValueError(f"{text[:40]!r} is no number")
    return int(text)
