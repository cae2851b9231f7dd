"""Compares two runs: hashes name the second, then both are made again up to it and compared in full."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from twin.errors import TwinError
from twin.experiments.diff.bracket import Bracket, bracket
from twin.experiments.diff.changes import changes, since
from twin.experiments.diff.difference import PHYSICS, Difference, Divergence, Value
from twin.experiments.diff.fields import differences
from twin.experiments.diff.replay import Replay
from twin.experiments.diff.side import Side, why_not_alone

if TYPE_CHECKING:
    from twin.runtime import Progress


def compare(a: Side, b: Side, progress: Callable[[Progress], None] | None = None) -> Difference:
    """Return whether two runs were the same run, and if not, where they part.

    Args:
        a: One run.
        b: The other.
        progress: Called about four times a second while they are made again.
    """
    found = bracket(a.run.hashes, b.run.hashes)
    digests = (a.run.digest, b.run.digest)
    same = found.first is None and (None in digests or digests[0] == digests[1])
    first: list[Divergence] = []
    notes: list[str] = []
    if found.first is not None:
        one = _replay(a, found, progress, notes)
        if one.unlike != 0:  # else there is nothing to compare with
            first = list(_divergences(found, one, _replay(b, found, progress, notes)))
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


def _divergences(found: Bracket, a: Replay, b: Replay) -> Iterator[Divergence]:
    """Yield the first difference of each topic, and of the physics before messages of its time."""
    physics = _physics(a, b) if a.holds(found.physics) and b.holds(found.physics) else None
    messages = []
    if a.holds(found.messages) and b.holds(found.messages):
        messages = [each for name in found.topics if (each := _messages(name, a, b)) is not None]
        if not found.topics:
            messages = list(_order(a, b))
    if physics is not None:
        yield from (one for _, one in sorted(messages, key=_place) if one.time_ns < physics.time_ns)
        yield physics
    yield from (
        one for _, one in sorted(messages, key=_place) if physics is None or one.time_ns >= physics.time_ns
    )


def _place(found: tuple[int, Divergence]) -> tuple[int, int]:
    order, one = found
    return one.time_ns, order


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


def _messages(name: str, a: Replay, b: Replay) -> tuple[int, Divergence] | None:
    topic, _, typename = name.partition(" ")
    for one, other in zip_longest(a.messages.get(name, ()), b.messages.get(name, ())):
        if one is None or other is None or one.time_ns != other.time_ns:
            earlier = min(filter(None, (one, other)), key=lambda each: each.time_ns)
            here = ["message" if each is earlier else None for each in (one, other)]
            found: list[tuple[str, Value, Value]] = [("", here[0], here[1])]
        elif one.payload != other.payload:
            earlier = one
            found = list(differences(typename, one.payload, other.payload)) or [("padding", None, None)]
        else:
            continue
        field, a_says, b_says = found[0]
        return earlier.order, Divergence(
            topic=topic,
            type=typename,
            time_ns=earlier.time_ns,
            tick=earlier.tick,
            field=field,
            a=a_says,
            b=b_says,
            fields=len(found),
        )
    return None


def _order(a: Replay, b: Replay) -> Iterator[tuple[int, Divergence]]:
    """Yield the first message that has another one's place."""
    one, other = (
        sorted(((m, name) for name, all_ in each.messages.items() for m in all_), key=lambda m: m[0].order)
        for each in (a, b)
    )
    for (message, name), (_, instead) in zip(one, other, strict=False):
        if name != instead:
            topic, _, typename = name.partition(" ")
            yield (
                message.order,
                Divergence(
                    topic=topic,
                    type=typename,
                    time_ns=message.time_ns,
                    tick=message.tick,
                    field="order",
                    a=topic,
                    b=instead.partition(" ")[0],
                ),
            )
            return
