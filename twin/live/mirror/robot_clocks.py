"""Several robots, each with a clock of its own, in a mirror that has one, by which all of it is stamped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from twin.bridge.msgs import ns, stamp
from twin.bridge.types.fields import fields_of
from twin.live.mirror.followed_clock import FollowedClock
from twin.live.mirror.source import ClockChange

_TIME = "builtin_interfaces/msg/Time"
_SET_NS = 50_000_000
"""A robot's clock was set if it is this much elsewhere at once [ns]; what is less is slewed."""


class RobotClocks:
    """How far each robot's clock is ahead of the mirror's; what they say is stamped anew as it comes in."""

    def __init__(self, mirror: FollowedClock, spaces: Mapping[str, str]) -> None:
        """Know nothing yet.

        Args:
            mirror: The clock by which stamps are afterwards.
            spaces: Namespace of each robot.
        """
        self._mirror, self._spaces = mirror, dict(spaces)
        self._robots: dict[str, FollowedClock] = {}
        self._ahead: dict[str, int] = {}
        """By namespace [ns]."""

    def follow(self, robot: str, elapsed_ns: int, shown_ns: int, bound_ns: int) -> list[ClockChange]:
        """Take what a robot's clock shows at a time of the mirror's run; return what has changed, if it has.

        Args:
            robot: Whose.
            elapsed_ns: Since the beginning of the mirror's run.
            shown_ns: What it shows [ns since 1970].
            bound_ns: It may be off by so much.
        """
        is_known = robot in self._robots
        clock = self._robots.setdefault(robot, FollowedClock(shown_ns - elapsed_ns))
        clock.now_ns = elapsed_ns
        clock.follow(shown_ns, bound_ns)
        space = self._spaces[robot]
        before_ns = self._ahead.get(space, 0)
        self._ahead[space] = ahead_ns = clock.now_ns - self._mirror.now_ns
        set_by_ns = ahead_ns - before_ns
        if is_known and abs(set_by_ns) <= _SET_NS:
            return []
        return [ClockChange(what="clock" if is_known else "met", set_by_ns=set_by_ns, robot=robot)]

    def stamp_anew(self, topic: str, message: Any) -> None:
        """Let the stamps of a message of a robot's namespace be of the mirror's clock; zeros stay zeros."""
        space = topic[: max(0, topic.find("/", 1))]
        ahead_ns = self._ahead.get(space, 0)
        if ahead_ns:
            _shifter(message.__msgtype__)(message, -ahead_ns)


@cache
def _shifter(typename: str) -> Callable[[Any, int], None]:
    """Return what moves all times in a message of a type, in place."""
    moves: list[tuple[str, bool, Callable[[Any, int], None] | None]] = []
    for field in fields_of(typename):
        if field.message == _TIME:
            moves.append((field.attribute, bool(field.many), None))
        elif field.message and _has_times(field.message):
            moves.append((field.attribute, bool(field.many), _shifter(field.message)))

    def shift(message: Any, by_ns: int) -> None:
        for name, many, inner in moves:
            value = getattr(message, name)
            if inner is None:
                moved = [_moved(each, by_ns) for each in value] if many else _moved(value, by_ns)
                setattr(message, name, moved)
                continue
            for each in value if many else (value,):
                inner(each, by_ns)

    return shift


@cache
def _has_times(typename: str) -> bool:
    inner = [field.message for field in fields_of(typename) if field.message]
    return _TIME in inner or any(map(_has_times, inner))


def _moved(time: Any, by_ns: int) -> Any:
    time_ns = ns(time)
    return stamp(max(1, time_ns + by_ns)) if time_ns else time
