"""A process that makes runs: one after another in the same one, which costs a tenth of a fresh start.

What could carry over does not: a process that has executed code of a user makes no other run, and one that
died takes nothing along but its own run, which is an error with the cause.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import traceback
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from twin.errors import TwinError
from twin.experiments.suite.cases import Case
from twin.scenario.verdict import VERDICT, Verdict

OUTPUT = "output.txt"
"""What a run printed, in its folder."""
_PATIENCE_S = 10.0
"""For a run to write down that it was interrupted [s]; then its process is killed."""
_COMMAND = (sys.executable, "-m", "twin.experiments.suite.worker")


class Worker:
    """Makes runs in a process beside this one, which starts with the first run and ends with the block."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def run(self, case: Case, folder: Path, *, record: bool = False) -> dict[str, Any]:
        """Return the content of the run's `verdict.json`; if the process dies, one that tells of it.

        Args:
            case: What to run.
            folder: Of the results; it is made.
            record: Whether to write a recording.
        """
        folder.mkdir(parents=True, exist_ok=True)
        output = folder / OUTPUT
        if case.error:
            return _written(_broken(case, case.error), folder)
        job = {
            "file": str(case.file),
            "overrides": dict(case.overrides),
            "out": str(folder),
            "record": record,
            "told": {"test": case.name, "command": case.command},
        }
        try:
            process = self._process = self._process or _start(output)
            assert process.stdin is not None
            assert process.stdout is not None
            line = ""
            try:
                process.stdin.write(json.dumps(job) + "\n")
                process.stdin.flush()
                line = process.stdout.readline()
            except BrokenPipeError:  # it died before it took the job
                pass
            if self._stopped:
                raise KeyboardInterrupt
            if not line:
                return _written(_broken(case, _cause(process.wait(), output)), folder)
            answer = json.loads(line)
            if not answer["again"]:
                self.close()
        except BaseException:  # such as Ctrl-C: the run goes on otherwise
            self.close()
            raise
        finally:
            if self._process is not None and self._process.poll() is not None:
                self.close()
            if output.exists() and output.stat().st_size == 0:
                output.unlink()
        verdict: dict[str, Any] = answer["verdict"]
        return verdict

    def stop(self) -> None:
        """Interrupt what another thread runs; its `run` raises KeyboardInterrupt."""
        self._stopped = True
        if self._process is not None:
            _end(self._process)

    def close(self) -> None:
        """End the process; a run that is under way says `interrupted` in its verdict."""
        process, self._process = self._process, None
        if process is None:
            return
        _end(process)
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()


def _start(output: Path) -> subprocess.Popen[str]:
    with output.open("wb") as errors:
        return subprocess.Popen(
            _COMMAND,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            encoding="utf-8",
        )


def _end(process: subprocess.Popen[str]) -> None:
    process.terminate()
    try:
        process.wait(_PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _broken(case: Case, error: str) -> Verdict:
    seed = case.overrides.get("seed", "0")
    scenario = case.name.partition("[")[0]
    return Verdict(scenario=scenario, seed=int(seed), error=error, test=case.name, command=case.command)


def _written(verdict: Verdict, folder: Path) -> dict[str, Any]:
    verdict.write(folder)
    return verdict.to_dict()


def _cause(code: int, output: Path) -> str:
    """Return why a process ended, as a sentence."""
    ended = f"with code {code}"
    if code < 0:
        names = {each.value: each.name for each in signal.Signals}
        kill = code == -signal.SIGKILL
        ended = f"by {names.get(-code, -code)}" + (" (is there too little memory?)" if kill else "")
    printed = output.read_text(encoding="utf-8", errors="replace").strip() if output.exists() else ""
    last = f": {printed.splitlines()[-1]} (all of it: {output})" if printed else ""
    return f"the run's process ended {ended}{last}"


def main() -> None:
    """Take jobs from stdin, one in a line, and answer each with its verdict on stdout."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all; who started this one decides
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    for line in sys.stdin:
        job = json.loads(line)
        with (Path(job["out"]) / OUTPUT).open("w", encoding="utf-8") as output:
            _print_to(output)
            verdict = _made(job)
            sys.stdout.flush()
            sys.stderr.flush()
        again = not verdict.plugins and verdict.error != "interrupted"
        answers.write(json.dumps({"again": again, "verdict": verdict.to_dict()}) + "\n")
        answers.flush()
        if not again:
            return


def _print_to(output: IO[str]) -> None:
    for number in (1, 2):
        os.dup2(output.fileno(), number)


def _made(job: dict[str, Any]) -> Verdict:
    """Make a run, write its verdict, and return it."""
    from twin.plugins import execution
    from twin.scenario import schema

    folder = Path(job["out"])
    name, seed = Path(job["file"]).stem, int(job["overrides"].get("seed", "0"))
    (folder / VERDICT).unlink(missing_ok=True)
    interrupts: list[int] = []

    def interrupt(number: int, frame: object) -> None:
        interrupts.append(number)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)
    with execution() as executed:
        try:
            scenario = schema.load(job["file"], job["overrides"], execute=True)
            name, seed = scenario.name, scenario.seed
            from twin import runtime

            verdict = runtime.run(scenario, out=folder, record=job["record"])
        except TwinError as fault:
            verdict = Verdict(scenario=name, seed=seed, error=str(fault), plugins=executed.versions)
        except KeyboardInterrupt:
            verdict = Verdict(scenario=name, seed=seed, error="interrupted", plugins=executed.versions)
        except Exception as bug:
            if interrupts:  # what has become of it on its way
                return _kept(job, Verdict(scenario=name, seed=seed, error="interrupted"))
            traceback.print_exc()
            error = f"{type(bug).__name__}: {bug} (all of it: {folder / OUTPUT})"
            verdict = Verdict(scenario=name, seed=seed, error=error, plugins=executed.versions)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    return _kept(job, verdict)


def _kept(job: dict[str, Any], verdict: Verdict) -> Verdict:
    """Write a verdict with what is told of its test, and return it."""
    verdict = replace(verdict, **job["told"])
    verdict.write(Path(job["out"]))
    return verdict


if __name__ == "__main__":
    main()
