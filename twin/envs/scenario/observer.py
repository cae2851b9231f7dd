"""All that an agent is shown: topics with their ages, and what it needs to know beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from twin.envs.scenario.agents.agent import Agent, Values
from twin.envs.scenario.episode import Episode, Heard
from twin.envs.scenario.observations import Channel, Costmap, Odometry, PoseInMap, Poses, Scan
from twin.envs.scenario.own_code import blamed
from twin.errors import GymError

OLDEST_S = 10.0
"""Older than this is as good as nothing, which counts as so old [s]."""
CHANNELS: Mapping[str, type[Channel]] = {
    "sensor_msgs/msg/LaserScan": Scan,
    "nav_msgs/msg/Odometry": Odometry,
    "geometry_msgs/msg/PoseWithCovarianceStamped": PoseInMap,
    "geometry_msgs/msg/PoseStamped": PoseInMap,
    "geometry_msgs/msg/PoseArray": Poses,
    "nav_msgs/msg/OccupancyGrid": Costmap,
}
"""What shows a topic that is only named, by its type."""
_RANGES = ("sensor_msgs/msg/LaserScan", "ranges")
"""What shows a scan shows this field of it."""


class Observer:
    """Fills one observation from an episode's topics and its agent."""

    def __init__(self, episode: Episode, agent: Agent, wanted: Sequence[str | Channel] | None) -> None:
        """Begin to hear.

        Args:
            episode: A run before its first tick.
            agent: Who is to act in it.
            wanted: Names of topics, or channels; None: what is usual, as far as it is there.

        Raises:
            GymError: A topic that is not there, or whose type nothing shows.
        """
        self._episode, self._agent = episode, agent
        if isinstance(wanted, str) or not (
            wanted is None
            or (isinstance(wanted, Sequence) and all(isinstance(each, str | Channel) for each in wanted))
        ):
            raise GymError(f"observe={wanted!r}: valid is a list of topics or channels")
        if wanted is None:
            wanted = [topic for topic in agent.observes if episode.publishes(topic)]
        self.channels = tuple(
            each if isinstance(each, Channel) else _channel_of(each, episode) for each in wanted
        )
        keys = [channel.key for channel in self.channels]
        for key in {*keys, "age", *agent.observation_spaces()}:
            taken = keys.count(key) + (key == "age") + (key in agent.observation_spaces())
            if taken > 1:
                raise GymError(f"two parts of the observation are called '{key}'")
        self._heard: list[Heard] = [episode.hear(channel.name) for channel in self.channels]
        self._boxes = [channel.space(episode) for channel in self.channels]
        ages = {"age": spaces.Box(0.0, OLDEST_S, (len(keys),), np.float32)} if keys else {}
        self.space = spaces.Dict(
            {**dict(zip(keys, self._boxes, strict=True)), **ages, **agent.observation_spaces()}
        )

    def observe(self) -> dict[str, Values]:
        """Return the present observation; zeros for a topic on which nothing has come."""
        episode, now = self._episode, self._episode.node.now_ns
        found: dict[str, Values] = {}
        for channel, heard in zip(self.channels, self._heard, strict=True):
            if heard.message is not None:
                with blamed(type(channel), "the channel"):
                    found[channel.key] = channel.values(heard.message, episode)
        if self.channels:
            found["age"] = np.array([heard.age(now) for heard in self._heard])
        with blamed(type(self._agent), "observe"):
            found |= self._agent.observe()
        return {key: _within(found.get(key), box) for key, box in self.space.spaces.items()}


def _channel_of(topic: str, episode: Episode) -> Channel:
    """Return what shows a topic of which only the name is given.

    Raises:
        GymError: It is not there, or nothing shows its type.
    """
    name, _, field = topic.partition(".")
    msgtype = episode.publisher(name).msgtype
    if field and (msgtype, field) != _RANGES:
        raise GymError(f"{topic} has no bounds; valid is Field({topic!r}, low, high)")
    if msgtype not in CHANNELS:
        raise GymError(
            f"{topic} carries {msgtype}, of which fields can be shown, as Field('{topic}.<field>', low, "
            f"high); whole are {', '.join(CHANNELS)}"
        )
    return CHANNELS[msgtype](name)


def _within(values: Values | None, space: spaces.Space[Any]) -> Values:
    """Return values as the space has them."""
    assert isinstance(space, spaces.Box)
    if values is None:
        return np.clip(np.zeros(space.shape, space.dtype), space.low, space.high)
    return np.clip(np.nan_to_num(values), space.low, space.high).astype(space.dtype)
