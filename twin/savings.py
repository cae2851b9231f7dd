"""What a run does not do over again; no message, no digest and no verdict shows whether it did."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Savings:
    """Each can be switched off; a run without them is slower, and the oracle of the one with them."""

    due: bool = True
    """Nodes run only when something has come, or is due; otherwise all of them in every spin."""
    services_in_process: bool = True
    """Requests and responses go through Zenoh only if another process may have a part in it."""
    in_process: bool = True
    """What nobody else can hear goes from inbox to inbox, without any Zenoh session; otherwise all by it."""
    by_reference: bool = True
    """Within a process a message that nobody changes any more is handed over as it is, not as bytes."""
    unchanged_drives: bool = True
    """Bounds of servos are written into the physics only if they are others than before."""
    unchanged_truth: bool = True
    """Checks and bumpers look closely only where something is new: other shapes touch than before, a load
    touches more than its robot, something lies elsewhere."""
    plane_of_rays: bool = True
    """Rays pass over bodies that they do not see or reach, those of a flat fan over what its plane misses."""


ALL = Savings()


@contextmanager
def uncollected() -> Iterator[None]:
    """Look for no garbage in the block: a start makes a million objects that stay."""
    looks = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if looks:
            gc.freeze()
            gc.unfreeze()  # all that is there is old now: the next look need not go through it
            gc.enable()


_SELDOM = 20_000
"""Objects that are made and stay before garbage is looked for; ticks leave few, and hardly a circle."""


@contextmanager
def seldom_collected() -> Iterator[None]:
    """Look for garbage seldom in the block, and only among what it makes: what is there by now stays."""
    often, *older = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(max(often, _SELDOM) if often else 0, *older)  # 0: not at all
    try:
        yield
    finally:
        gc.set_threshold(often, *older)
        gc.unfreeze()
