"""The maps that robots made in a run, as files beside its verdict."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from twin.errors import RecordingError
from twin.runtime.stacks.robot import RobotStack


def save_maps(stacks: Mapping[str, RobotStack], folder: Path) -> None:
    """Write `map.yaml`, `map.pgm` and `map.posegraph` of the robot that maps; of several `<robot>_map`.

    A robot that localises in a pose graph made none. Nothing is written where no map was published yet.

    Raises:
        RecordingError: The folder cannot be written.
    """
    makers = {name: s.slam for name, s in stacks.items() if s.slam and s.slam.slam.mode == "mapping"}
    for name, maker in makers.items():
        grid = maker.fresh_map()
        if grid is None:
            continue
        stem = "map" if len(stacks) == 1 else f"{name}_map"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            grid.save(folder / f"{stem}.yaml")
            maker.slam.save(folder / f"{stem}.posegraph")
        except OSError as fault:
            raise RecordingError(f"{folder}: the map cannot be written there: {fault.strerror}") from fault
