"""Runs worlds, each as the scenario that is written for it, in processes beside each other."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from twin.files.writing import write_whole
from twin.runtime import run
from twin.scenario import schema
from twin_benchmarks.barn.referee import Referee, Trial
from twin_benchmarks.barn.scenarios import BarnOptions, write
from twin_benchmarks.barn.worlds import BarnSet, BarnWorld


def run_world(
    world: BarnWorld, rules: BarnSet, options: BarnOptions, folder: Path, *, record: bool = False
) -> Trial:
    """Write a world's files into `folder`, drive through it, and return how it went."""
    path = write(folder, world, rules, options)
    scenario = schema.load(path, dict(options.overrides))
    referee = Referee(world, rules)
    verdict = run(scenario, out=folder, record=record, watch=referee.watch)
    trial = referee.trial(
        seed=options.seed,
        recoveries=int(verdict.metrics["recoveries"]),
        real_time_factor=verdict.metrics["real_time_factor"],
    )
    write_whole(folder / "trial.json", json.dumps(trial.to_dict(), indent=2) + "\n")
    return trial


def run_worlds(
    rules: BarnSet, options: BarnOptions, folder: Path, *, workers: int, record: bool = False
) -> Iterator[Trial]:
    """Yield the trial of each world as it ends.

    Args:
        rules: The worlds and their rules.
        options: Of all runs.
        folder: Each run gets a folder in it.
        workers: Processes at a time.
        record: Whether to write Rerun recordings.
    """
    common = replace(rules, worlds=())  # a world need not know the others
    with ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=_ignore_interrupts
    ) as pool:
        futures = [
            pool.submit(
                run_world,
                world,
                common,
                replace(options, seed=seed, runs=1),
                folder / (f"world_{world.id:03d}" + (f"_seed_{seed}" if options.runs > 1 else "")),
                record=record,
            )
            for seed in range(options.seed, options.seed + options.runs)
            for world in rules.worlds
        ]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            for future in futures:
                future.cancel()


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the process that waits for this one; the present world is driven to its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
