"""A robot in another process that stands in for a physical one: in real time, by a clock of its own."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from twin.files.writing import check_file, make_folder
from twin.live.device_clock import RIGHT, ClockError, DeviceClock
from twin.runtime.open_run import OpenRun
from twin.runtime.pacing import Pace
from twin.runtime.stacks.context import Layout
from twin.scenario.schema import Scenario

if TYPE_CHECKING:
    from twin.bridge.wire.session import SessionConfig

_FOR_EVER_S = 1e9
_SLACK_S = 0.5
"""It makes up for what it is behind: a physical robot loses no time when another program is busy."""
TRUTH_COLUMNS = ("robot", "stamp_ns", "x", "y", "yaw")
"""Of the file of truths: the robot's clock, pose of its base in the world [m, rad]."""


class Plant:
    """A scenario's robots as their hardware: drivers' nodes, no `/clock`, nothing of a simulation."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        error: ClockError = RIGHT,
        network: SessionConfig,
        is_one_of_several: bool = False,
        autonomy: bool = False,
        truth: Path | None = None,
        bag: Path | None = None,
        pace: float | None = 1.0,
        start_ns: int | None = None,
    ) -> None:
        """Build the robots.

        Args:
            scenario: Its robots, world and faults; also its missions, with `autonomy`.
            error: How wrong their clock is.
            network: Where others reach them.
            is_one_of_several: Whether other robots, elsewhere, share the graph: names are behind the robot's.
            autonomy: Whether localisation, navigation and missions run on the robots, too.
            truth: A CSV file for where they really are, each tick; nobody but a test may look.
            bag: Folder for a bag of what the robots say and hear.
            pace: Simulated seconds per second; None: as fast as possible.
            start_ns: Time of day at the first tick [ns]; None: the present one.

        Raises:
            TwinError: A robot cannot be made, or nobody can be reached.
        """
        changes: dict[str, object] = {"checks": (), "early_stop": "never", "duration": _FOR_EVER_S}
        scenario = scenario.model_copy(update=changes)
        self._starts_now, self._has_begun = start_ns is None, False
        self._pace = None if pace is None else Pace(pace, slack_s=_SLACK_S)
        self.clock = DeviceClock(time.time_ns() if start_ns is None else start_ns, error)
        with ExitStack() as ending:
            self._rows: Any = None
            if truth is not None:
                check_file(truth, "--truth")
                make_folder(truth.absolute().parent)
                file = ending.enter_context(truth.open("w", newline="", encoding="utf-8"))
                self._rows = csv.writer(file)
                self._rows.writerow(TRUTH_COLUMNS)
            self.run = OpenRun(
                scenario,
                record=False,
                network=network,
                pace=self._pace,
                bag=bag,
                clock=self.clock,
                endless=True,
                layout=Layout(autonomy="all" if autonomy else "none", is_one_of_several=is_one_of_several),
            )
            ending.callback(self.run.close)
            self._ending = ending.pop_all()

    def advance(self, until: Callable[[], bool] = lambda: False) -> None:
        """Go on until a condition holds after a tick; raises TwinError if the robots cannot go on."""
        if not self._has_begun:
            self._has_begun = True
            if self._starts_now:
                self.clock.start(time.time_ns())
                if self._pace is not None:
                    self._pace.start()
            self._tell_truth()
        self.run.advance(lambda: self._tell_truth() or until())

    @property
    def names(self) -> tuple[str, ...]:
        """Of the robots."""
        return tuple(self.run.run.parts.stacks)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the graph. Harmless when repeated."""
        self._ending.close()

    def _tell_truth(self) -> bool:
        if self._rows is not None:
            world = self.run.run.world
            for name, robot in world.robots.items():
                pose = world.pose(robot.base).to_pose2()
                self._rows.writerow((name, self.clock.now_ns, pose.x, pose.y, pose.yaw))
        return False
