"""One run of a scenario, step by step, with everything in it open to a script."""

from __future__ import annotations

import math
import shutil
import sys
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING, Any, Self

from twin.api.files import load_scenario
from twin.api.participant import Participant
from twin.api.truth import Truth
from twin.errors import RecordingError, SimulationError, TwinError
from twin.files.writing import check_file, make_folder, written_alone
from twin.plugins import Execution
from twin.savings import uncollected
from twin.scenario.outside import Outside

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.wire.session import SessionConfig
    from twin.recording.live_screen import LiveScreen
    from twin.runtime import OpenRun, Progress
    from twin.runtime.simulation_control import SimulationControl
    from twin.scenario.outside import ClockMode
    from twin.scenario.schema import Scenario
    from twin.scenario.verdict import Verdict

NO_OVERRIDES: Mapping[str, Any] = MappingProxyType({})


class Simulation(Participant):
    """A scenario's run: `with twin.Simulation("file.yaml") as simulation: ...`, and then its `verdict`.

    It starts when the block is entered, or when it is first used. However it ends - by an exception, Ctrl-C,
    the end of the block, or because nobody holds it any more - recording and bag are whole files, the bus and
    the folder are closed. Run to its end, it is the run of `twin run`, to the last bit of its digest.
    """

    def __init__(
        self,
        scenario: Scenario | str | Path,
        *,
        overrides: Mapping[str, Any] = NO_OVERRIDES,
        seed: int | None = None,
        params_file: str | Path | None = None,
        out: str | Path | Callable[[str], Path] | None = None,
        record: bool = True,
        bag: bool = False,
        bag_hidden_topics: bool = False,
        save_model: str | Path | None = None,
        workers: int = 0,
        pace: float | None = None,
        view: bool = False,
        listen: Sequence[str] = (),
        network: SessionConfig | None = None,
        nodes: Sequence[str] = (),
        wait_for: Sequence[str] = (),
        wait_timeout: float = 10.0,
        free: bool = False,
        keep_inputs: bool = False,
        on_execute: Callable[[str], None] | None = None,
    ) -> None:
        """Prepare a run; nothing is read or opened yet.

        Args:
            scenario: Its name or file, or what `load_scenario` returned.
            overrides: Dotted keys of the file -> values that go before its own; see `load_scenario`.
            seed: Of all noise, instead of the file's.
            params_file: A Nav2 parameter file for all robots that navigate, instead of the scenario's.
            out: Folder of the results: verdict, recording, bag, maps; a function is given the scenario's name
                and returns it. None: nothing is written.
            record: Whether `out` gets a Rerun recording.
            bag: Whether `out` gets a ROS 2 bag of every message.
            bag_hidden_topics: Whether topics of actions are in the bag, too.
            save_model: Folder for the compiled world as MJCF.
            workers: Processes that run the nodes of several robots beside this one. Changes no result.
            pace: Simulated seconds per second; None is as fast as possible. Changes no result.
            view: Whether a viewer shows the run while it goes on, best with `pace=1.0`: a window where there
                is a display, else a page, whose address is printed. Changes no result, and the run never
                waits for it. The viewer ends with this object, or with Python: see `wait_for_viewer`.
            listen: Endpoints at which other processes may join the bus, such as tcp/127.0.0.1:7447.
            network: How else the bus takes part in a network, instead of `listen`.
            nodes: `FILE.py:FACTORY` of nodes to run, too.
            wait_for: Nodes and topics of other processes with which the run is in lock-step.
            wait_timeout: How long to wait for their answers [s] of wall time.
            free: Whether others take part at their own pace; not deterministic.
            keep_inputs: Whether what comes from outside is kept, for snapshots (`twin fork --save`).
            on_execute: Called with the name of each file or module of a user's plugins before it is executed.

        Raises:
            SimulationError: A bag without a folder.
            RecordingError: No viewer is installed.
        """
        if bag and out is None:
            raise SimulationError("bag=True needs a folder: say where with out=...")
        super().__init__()
        self._given = scenario
        self._overrides = dict(overrides) if seed is None else {**overrides, "seed": seed}
        self._params_file = params_file
        self._out = out
        self._record = record
        self._bag, self._bag_hidden_topics = bag, bag_hidden_topics
        self._save_model = None if save_model is None else Path(save_model)
        self._pace = pace
        self._workers, self._keep_inputs = workers, keep_inputs
        self._listen, self._network = tuple(listen), network
        self._outside = partial(
            Outside, nodes=tuple(nodes), wait_for=tuple(wait_for), wait_timeout_s=wait_timeout, free=free
        )
        self._others = {"node": list(nodes), "wait-for": list(wait_for)}
        self._executed = Execution(on_execute)
        self._name, self._seed = Path(str(scenario)).stem, 0
        self._clock: ClockMode = "inproc"
        self._run: OpenRun | None = None
        self._control: SimulationControl | None = None
        self._can_reset = False
        """Whether `run` goes on with another one: who steps the run holds what is in it."""
        self._verdict: Verdict | None = None
        self._held = ExitStack()
        weakref.finalize(self, self._held.close)
        self._screen: LiveScreen | None = None
        if view:
            from twin.recording.live_screen import LiveScreen

            self._screen = LiveScreen(_print)
            weakref.finalize(self, self._screen.close)
        self.folder: Path | None = None
        """Where the results are; None before the start, or if nothing is written."""

    # -- life ------------------------------------------------------------------------------------------------

    def start(self) -> Self:
        """Read the scenario and build everything. Harmless when repeated; whatever needs it does it.

        Raises:
            TwinError: The run cannot be made.
        """
        if self._run is None and self._verdict is None:
            with self._told(), self._executed.going_on():
                self._start()
        return self

    def close(self) -> None:
        """End the run, if it is not over, as a failure of its script. Harmless when repeated."""
        if self._run is not None:
            self._end_with("closed before its end")

    def finish(self) -> Verdict:
        """End the run now, and judge it as it stands. Harmless when repeated.

        What it leaves beside the verdict and cannot write, as the disk is full, the logger `twin.run` tells.

        Raises:
            RecordingError: The verdict cannot be written.
        """
        if self._verdict is None:
            run = self._running
            with self._told():
                verdict = replace(run.finish(), command=self._command)
                self._close(verdict)
                if self.folder is not None:
                    verdict.write(self.folder)
        return self.verdict

    @property
    def verdict(self) -> Verdict:
        """How the run ended: checks, digest, `exit_code`, `to_dict()`; of one that broke off, its error.

        Raises:
            SimulationError: It has not ended.
        """
        if self._verdict is None:
            raise SimulationError("the run has not ended; its verdict is there after run() or finish()")
        return self._verdict

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.finish()
        elif self._verdict is None:
            self._end_with(_reason(error))

    # -- time ------------------------------------------------------------------------------------------------

    def step(self) -> bool:
        """Advance by one tick, the scenario's control period; False, and nothing happens, if the run is over.

        Raises:
            TwinError: The run cannot go on.
        """
        run = self._running
        with self._told():
            return run.advance(until=lambda: True)

    def run_until(self, until: float | Callable[[], bool], timeout: float = math.inf) -> bool:
        """Advance to a time, or until a condition holds; return whether that was reached.

        Args:
            until: Simulated time since the start of the run [s], or a function that is asked after each tick.
            timeout: Longest simulated time from now [s].

        Raises:
            TwinError: The run cannot go on.
        """
        run, world = self._running, self._running.run.world
        reached = until if callable(until) else lambda: world.time_ns >= round(until * 1e9)
        end = world.time_ns + timeout * 1e9
        if not reached():
            with self._told():
                run.advance(lambda: reached() or world.time_ns >= end)
        return reached()

    def run(self, progress: Callable[[Progress], None] | None = None) -> Verdict:
        """Run to the end and return the verdict; `progress` is called about four times a second.

        Raises:
            TwinError: The run cannot be made or go on.
        """
        if self._verdict is None:
            run = self._running
            self._can_reset = True
            with self._told():
                run.advance_to_end(progress, lambda _: self._is_to_reset)
                while self._is_to_reset:
                    self._reset().advance_to_end(progress, lambda _: self._is_to_reset)
        return self.finish()

    def wait_for_viewer(self) -> None:
        """Wait until the user closes the window of `view`, or presses Ctrl-C, as is printed."""
        if self._screen is not None and self._screen.is_open:
            _print(self._screen.how_to_end)
            with suppress(KeyboardInterrupt):
                self._screen.wait()

    @property
    def over(self) -> bool:
        """Whether the time is up, or the mission has been over for a moment."""
        return self._verdict is not None or self._running.run.over

    @property
    def time(self) -> float:
        """Simulated time since the start of the run [s]."""
        return self.truth.time

    # -- what is in it ---------------------------------------------------------------------------------------

    @property
    def scenario(self) -> Scenario:
        """What is run."""
        return self._running.run.scenario

    @property
    def mission_state(self) -> str:
        """What the mission is about."""
        return self._running.run.parts.mission.state

    @property
    def truth(self) -> Truth:
        """Where everything really is."""
        return Truth(self._running.run.world)

    @property
    def bus(self) -> Bus:
        """The bus of all nodes."""
        return self._running.run.bus

    # -- inside ----------------------------------------------------------------------------------------------

    @property
    def _running(self) -> OpenRun:
        self.start()
        if self._run is None:
            raise SimulationError(f"the run of '{self._name}' has ended; make another Simulation")
        return self._run

    def _start(self) -> None:
        with uncollected():
            self._open()

    def _open(self) -> None:
        if isinstance(self._out, str | Path):
            self._hold(Path(self._out))
        outside = self._outside()
        self._clock = outside.clock(self._network is not None or bool(self._listen))
        scenario = load_scenario(self._given, self._overrides, execute=True)
        if self._params_file is not None:
            scenario = scenario.with_params_file(Path(self._params_file).resolve())
        self._name, self._seed = scenario.name, scenario.seed
        if callable(self._out):
            self._hold(self._out(scenario.name))
        if self._save_model is not None:
            model = make_folder(self._save_model)
            if self.folder is None or model.resolve() != self.folder.resolve():
                self._held.enter_context(written_alone(model))
        self._begin(scenario)

    def _begin(self, scenario: Scenario) -> OpenRun:
        from twin import runtime  # 2 s of imports that a mistake in the file need not wait for

        self._run = run = runtime.OpenRun(
            scenario,
            out=self.folder,
            record=self._record,
            pace=self._pace,
            listen=self._listen,
            network=self._network,
            outside=self._outside(),
            bag=self.folder / "bag" if self._bag and self.folder is not None else None,
            bag_hidden_topics=self._bag_hidden_topics,
            save_model=self._save_model,
            workers=self._workers,
            screen=self._screen,
        )
        self._held.callback(run.close)
        if self._clock == "free" and not self._workers:
            from twin.live.futures.inputs import Inputs
            from twin.live.futures.node import FuturesNode
            from twin.runtime.simulation_control import SimulationControl, SimulationState

            FuturesNode(run, Inputs(run) if self._keep_inputs else None)
            state = SimulationState(speed=self._pace or 0.0) if self._control is None else self._control.state
            self._control = SimulationControl(
                run, state, can_reset=lambda: self._can_reset, keeps_inputs=self._keep_inputs
            )
        return run

    @property
    def _is_to_reset(self) -> bool:
        return self._control is not None and self._control.is_to_reset

    def _reset(self) -> OpenRun:
        """End the run without a verdict, and begin it anew; what it has left so far goes."""
        run = self._running
        run.close()
        if self._bag and self.folder is not None:
            shutil.rmtree(self.folder / "bag", ignore_errors=True)
        with uncollected():
            again = self._begin(run.run.scenario)
        assert self._control is not None
        again.go_on(self._control.state.speed or math.inf)
        return again

    def _hold(self, folder: Path) -> None:
        """Take the folder of the results; a verdict of an earlier run there must not pass for this one's."""
        from twin.recording.hashes import HASHES
        from twin.scenario.verdict import VERDICT

        self._held.enter_context(written_alone(make_folder(folder)))
        self.folder = folder
        for file in (folder / "junit.xml", folder / HASHES, folder / VERDICT):
            check_file(file, "--out")
            file.unlink(missing_ok=True)

    @contextmanager
    def _told(self) -> Iterator[None]:
        """End the run if the block fails: a tick that was broken off cannot be resumed."""
        try:
            yield
        except BaseException as error:
            self._end_with(_reason(error))
            raise

    def _end_with(self, error: str) -> None:
        from twin.scenario.verdict import Verdict

        verdict = Verdict(
            scenario=self._name,
            seed=self._seed,
            error=error,
            command=self._command,
            clock=self._clock,
            plugins=self._executed.versions,
        )
        with suppress(RecordingError):  # the error that ended the run is what its user is to see
            self._close(verdict)
        if self.folder is not None:
            with suppress(RecordingError):
                verdict.write(self.folder)

    @property
    def _command(self) -> str:
        """The command that makes the run again; empty if the scenario was not named by a file."""
        from twin.scenario.command import twin_run
        from twin.scenario.overrides import as_yaml

        if not isinstance(self._given, str | Path):
            return ""
        options: dict[str, Sequence[object]] = {
            "params-file": [] if self._params_file is None else [self._params_file],
            **self._others,
        }
        return twin_run(self._given, {key: as_yaml(v) for key, v in self._overrides.items()}, options=options)

    def _close(self, verdict: Verdict) -> None:
        self._verdict, self._run = verdict, None
        self._held.close()


def run(
    scenario: Scenario | str | Path,
    *,
    overrides: Mapping[str, Any] = NO_OVERRIDES,
    seed: int | None = None,
    out: str | Path | None = None,
) -> Verdict:
    """Run a scenario to its verdict; `Simulation` has more options.

    Args:
        scenario: Its name or file, or what `load_scenario` returned.
        overrides: Dotted keys of the file -> values that go before its own.
        seed: Of all noise, instead of the file's.
        out: Folder of the results; None: nothing is written.

    Raises:
        TwinError: The run cannot be made or go on.
    """
    with Simulation(scenario, overrides=overrides, seed=seed, out=out) as simulation:
        return simulation.run()


def _print(sentence: str) -> None:
    sys.stderr.write(f"{sentence}\n")


def _reason(error: BaseException) -> str:
    if isinstance(error, TwinError):
        return str(error)
    return "interrupted" if isinstance(error, KeyboardInterrupt) else f"{type(error).__name__}: {error}"
