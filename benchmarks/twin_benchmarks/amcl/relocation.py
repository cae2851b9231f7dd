"""Robots that do not know where they are: put down anywhere, or carried away while they drive."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.bridge.services import Client
from twin.bridge.srvs import Empty
from twin_benchmarks.amcl.world import Bench, Places, Wanderer, opened

_RIGHT_XY, _RIGHT_YAW = 0.15, math.radians(5.0)
_GLOBAL_S, _KIDNAPPED_S, _BEFORE_S = 10.0, 20.0, 5.0
_SETTLE_S = 0.5


@dataclass(frozen=True, kw_only=True)
class Relocation:
    """Outcome of a number of trials."""

    trials: int
    right: int
    """How many knew at the end, within 15 cm and 5 degrees, where they were."""
    median_s: float
    """Time until they knew for good, of those [s]; also the next two."""
    p95_s: float
    max_s: float
    wrong: tuple[str, ...]
    """Where the others were put down, and how far off they believed to be."""


def globally(trials: int, seed: int, progress: Callable[[float, float], None] | None = None) -> Relocation:
    """Put the robot down at random poses, ask for a global localisation, let it wander for ten seconds."""
    times, wrong = [], []
    with opened({"type": "idle"}, seed, navigation=False) as bench:
        Wanderer(bench)
        service = bench.bus.create_node("bench").create_client(Empty, "reinitialize_global_localization")
        places = Places(seed)
        _run(bench, _SETTLE_S)
        for trial in range(trials):
            place = places.draw()
            bench.carry(place)
            _run(bench, _SETTLE_S)
            _call(bench, service)
            known, left = _until_known(bench, _GLOBAL_S)
            times.append(known)
            if known is None:
                wrong.append(f"{place.x:.2f} {place.y:.2f} {place.yaw:.2f}: {left:.2f} m off")
            if progress is not None:
                progress(trial + 1, trials)
    return _summary(times, wrong)


def kidnapped(trials: int, seed: int, progress: Callable[[float, float], None] | None = None) -> Relocation:
    """Carry a robot that knows where it is somewhere else; tell it nothing, and let it wander on."""
    times, wrong = [], []
    with opened({"type": "idle"}, seed, navigation=False) as bench:
        Wanderer(bench)
        places = Places(seed + 1)
        _run(bench, _BEFORE_S)
        for trial in range(trials):
            place = places.draw()
            while place.distance(bench.truth) < 2.0:
                place = places.draw()
            bench.carry(place)
            known, left = _until_known(bench, _KIDNAPPED_S)
            times.append(known)
            if known is None:
                wrong.append(f"{place.x:.2f} {place.y:.2f} {place.yaw:.2f}: {left:.2f} m off")
            if progress is not None:
                progress(trial + 1, trials)
    return _summary(times, wrong)


def _run(bench: Bench, seconds: float) -> None:
    end = bench.now_ns + round(seconds * 1e9)
    while bench.now_ns < end:
        bench.tick()


def _call(bench: Bench, service: Client) -> None:
    future = service.call_async(Empty.Request())
    while not future.done:
        bench.tick()


def _until_known(bench: Bench, seconds: float) -> tuple[float | None, float]:
    """Run; return after how long the robot knew for good where it is, None if never, and its last error."""
    start, since, left = bench.now_ns, None, math.inf
    while bench.now_ns < start + round(seconds * 1e9):
        error = bench.tick()
        if error is None or error.xy > _RIGHT_XY or abs(error.yaw) > _RIGHT_YAW:
            since = None
        elif since is None:
            since = (bench.now_ns - start) * 1e-9
        left = math.inf if error is None else error.xy
    return since, left


def _summary(times: list[float | None], wrong: list[str]) -> Relocation:
    known = np.array([time for time in times if time is not None])
    return Relocation(
        trials=len(times),
        right=len(known),
        median_s=float(np.median(known)) if len(known) else math.inf,
        p95_s=float(np.percentile(known, 95)) if len(known) else math.inf,
        max_s=float(known.max()) if len(known) else math.inf,
        wrong=tuple(wrong),
    )
