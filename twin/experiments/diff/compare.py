"""Compares two runs: hashes name the second, then both are made again up to it and compared in full."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from twin.errors import TwinError
from twin.experiments.diff.changes import changes, since
from twin.experiments.diff.difference import PHYSICS, Difference, Divergence, Value
from twin.experiments.diff.fields import differences
from twin.experiments.diff.replay import Message, Replay
from twin.experiments.diff.side import Side, why_not_alone
from twin.recording.hashes import RunHashes

if TYPE_CHECKING:
    from twin.runtime import Progress

_Placed = tuple[int, Divergence]
"""A difference, and where its message is among those of all topics."""


@dataclass(frozen=True, kw_only=True)
class Bracket:
    """Seconds, counted from 0, in which hashes first differ; None: in no second."""

    messages: int | None
    physics: int | None
    topics: tuple[str, ...]
    """Topics with types that differ in the second of `messages`; empty: only the order among them does."""

    @property
    def first(self) -> int | None:
        """The earlier of the two."""
        return min((second for second in (self.messages, self.physics) if second is not None), default=None)


def compare(a: Side, b: Side, progress: Callable[[Progress], None] | None = None) -> Difference:
    """Return whether two runs were the same run, and if not, where they part.

    Args:
        a: One run.
        b: The other.
        progress: Called about four times a second while they are made again.
    """
    found = _bracket(a.run.hashes, b.run.hashes)
    digests = (a.run.digest, b.run.digest)
    same = found.first is None and (None in digests or digests[0] == digests[1])
    first: list[Divergence] = []
    notes: list[str] = []
    if found.first is not None:
        one = _replay(a, found, progress, notes)
        if one.unlike != 0:  # else there is nothing to compare with
            first = _divergences(found, one, _replay(b, found, progress, notes))
    elif not same:
        notes.append("the digests differ though no short hash does: one in four thousand million")
    return Difference(
        a=a.name,
        b=b.name,
        digest_a=digests[0],
        digest_b=digests[1],
        same=same,
        changes=tuple(changes(a.run.provenance, b.run.provenance)),
        second=found.first,
        topics=found.topics,
        first=tuple(first),
        notes=tuple(notes),
    )


def _bracket(a: RunHashes, b: RunHashes) -> Bracket:
    """Return where the hashes of two runs first differ."""
    messages = _first(a.stream, b.stream)
    topics: list[str] = []
    if messages is not None:
        names = sorted({*a.topics, *b.topics})
        topics = [
            name
            for name in names
            if a.topics.get(name, {}).get(messages) != b.topics.get(name, {}).get(messages)
        ]
    return Bracket(messages=messages, physics=_first(a.physics, b.physics), topics=tuple(topics))


def _first(a: Sequence[int], b: Sequence[int]) -> int | None:
    return next((i for i, (one, other) in enumerate(zip_longest(a, b)) if one != other), None)


def _replay(
    side: Side, found: Bracket, progress: Callable[[Progress], None] | None, notes: list[str]
) -> Replay:
    """Return a run made again; what is wrong with it becomes a note."""
    made = Replay(messages_of=found.messages, states_of=found.physics, unlike=0)
    if not side.is_alone:
        notes.append(f"{side.name} cannot be made again: {why_not_alone(side)}")
        return made
    try:
        made.run(side, progress)
    except TwinError as fault:
        notes.append(f"{side.name} cannot be made again: {fault.problems[0]}")
        return made
    if made.unlike is not None:
        changed = ", ".join(since(side.run.provenance))
        why = f"since then changed: {changed}" if changed else "something took part that is not kept"
        notes.append(f"{side.name}, made again, is another run from second {made.unlike} on: {why}")
    return made


def _divergences(found: Bracket, a: Replay, b: Replay) -> list[Divergence]:
    """Return the first difference of each topic, and of the physics before messages of its time."""
    differ: list[_Placed] = []
    if a.holds(found.physics) and b.holds(found.physics) and (physics := _physics(a, b)) is not None:
        differ.append((-1, physics))
    if a.holds(found.messages) and b.holds(found.messages):
        differ += filter(None, (_messages(name, a, b) for name in found.topics))
        if not found.topics:
            differ += _order(a, b)
    return [one for _, one in sorted(differ, key=lambda placed: (placed[1].time_ns, placed[0]))]


def _physics(a: Replay, b: Replay) -> Divergence | None:
    if a.state_names != b.state_names:
        return None  # other bodies or joints: what the scenarios say of them differs
    for index, (one, other) in enumerate(zip(a.states, b.states, strict=False)):
        differs = np.flatnonzero(one.view(np.uint64) != other.view(np.uint64))
        if len(differs):
            step = a.first_step + index
            most = int(np.argmax(np.abs(one - other)))
            return Divergence(
                topic=PHYSICS,
                type=f"step {step}",
                time_ns=step * a.timestep_ns,
                tick=-(-step // a.substeps),
                field=a.state_names[most],
                a=float(one[most]),
                b=float(other[most]),
                fields=len(differs),
            )
    return None


def _messages(name: str, a: Replay, b: Replay) -> _Placed | None:
    for one, other in zip_longest(a.messages.get(name, ()), b.messages.get(name, ())):
        if one is None or other is None or one.time_ns != other.time_ns:
            earlier = min(filter(None, (one, other)), key=lambda each: each.time_ns)
            here = ["message" if each is earlier else None for each in (one, other)]
            return _placed(name, earlier, "", *here)
        if one.payload != other.payload:
            typename = name.partition(" ")[2]
            found = list(differences(typename, one.payload, other.payload)) or [("padding", None, None)]
            return _placed(name, one, *found[0], fields=len(found))
    return None


def _order(a: Replay, b: Replay) -> list[_Placed]:
    """Return the first message that has another one's place, if there is one."""
    one, other = (
        sorted(((m, name) for name, all_ in each.messages.items() for m in all_), key=lambda m: m[0].order)
        for each in (a, b)
    )
    for (message, name), (_, instead) in zip(one, other, strict=False):
        if name != instead:
            here, there = (each.partition(" ")[0] for each in (name, instead))
            return [_placed(name, message, "order", here, there)]
    return []


def _placed(name: str, message: Message, field: str, a: Value, b: Value, *, fields: int = 1) -> _Placed:
    topic, _, typename = name.partition(" ")
    return message.order, Divergence(
        topic=topic,
        type=typename,
        time_ns=message.time_ns,
        tick=message.tick,
        field=field,
        a=a,
        b=b,
        fields=fields,
    )
