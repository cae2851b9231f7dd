"""Run one scenario in this process."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from twin.cli.console import print_error, stderr, stdout
from twin.cli.interrupted import raise_swallowed, sigterm_is_ctrl_c, was_interrupted
from twin.cli.run.folders import make_folder, results_folder
from twin.cli.run.options import RunOptions
from twin.cli.run.progress import run_progress
from twin.errors import TwinError
from twin.files.writing import check_file, written_alone

if TYPE_CHECKING:
    from twin.plugins import Execution
    from twin.scenario.outside import ClockMode


def run_once(options: RunOptions, out: Path | None, *, as_json: bool) -> int:
    """Run, write the verdict, print it, and return the exit code."""
    from twin.plugins import execution

    with ExitStack() as held, execution(_tell) as executed:
        return _run_once(options, out, held, executed, as_json=as_json)


def _tell(file: str) -> None:
    """Say which file of a user is about to be executed."""
    stderr().print(f"executes {file}")


def _run_once(
    options: RunOptions, out: Path | None, held: ExitStack, executed: Execution, *, as_json: bool
) -> int:
    from twin.bridge.programs.console_log import show_warnings
    from twin.scenario import schema
    from twin.scenario.outside import Outside
    from twin.scenario.verdict import Verdict

    show_warnings()
    sigterm_is_ctrl_c()
    name, seed, folder = options.scenario.stem, 0, None
    clock: ClockMode = "inproc"
    try:
        folder = None if out is None else held.enter_context(_fresh(out, ""))
        outside = Outside(
            nodes=options.nodes,
            wait_for=options.wait_for,
            wait_timeout_s=options.wait_timeout,
            free=options.free,
        )
        clock = outside.clock(options.network is not None)
        scenario = schema.load(options.scenario, options.overrides, execute=True)
        if options.params_file is not None:
            scenario = scenario.with_params_file(options.params_file.resolve())
        name, seed = scenario.name, scenario.seed
        from twin import runtime  # 2 s of imports that a mistake in the file need not wait for

        folder = folder or held.enter_context(_fresh(None, name))
        if options.save_model is not None and make_folder(options.save_model).resolve() != folder.resolve():
            held.enter_context(written_alone(options.save_model))
        with run_progress(name) as bar:

            def progress(now: runtime.Progress) -> None:
                raise_swallowed()
                if bar is not None:
                    bar(now)

            verdict = runtime.run(
                scenario,
                out=folder,
                record=options.record,
                pace=options.pace,
                network=options.network,
                outside=outside,
                bag=folder / "bag" if options.bag else None,
                bag_hidden_topics=options.bag_hidden_topics,
                save_model=options.save_model,
                progress=progress,
            )
    except TwinError as fault:
        print_error(fault)
        verdict = Verdict(scenario=name, seed=seed, error=str(fault), clock=clock, plugins=executed.versions)
        if folder is not None:
            verdict.write(folder)
        if as_json:
            sys.stdout.write(verdict.to_json())
        return verdict.exit_code
    except KeyboardInterrupt:
        if folder is not None:
            Verdict(scenario=name, seed=seed, error="interrupted", clock=clock).write(folder)
        raise
    except Exception as bug:  # ours, or of a user's node: whoever reads the verdict learns of it, too
        if folder is not None:
            sentence = "interrupted" if was_interrupted() else f"{type(bug).__name__}: {bug}"
            Verdict(scenario=name, seed=seed, error=sentence, clock=clock).write(folder)
        raise
    verdict.write(folder)
    if as_json:
        sys.stdout.write(verdict.to_json())
    else:
        from twin.cli.run.verdict_table import verdict_report

        stdout().print(verdict_report(verdict.to_dict(), folder))
    return verdict.exit_code


@contextmanager
def _fresh(out: Path | None, name: str) -> Iterator[Path]:
    """Hold the folder of the results; a verdict of an earlier run there must not pass for this one's."""
    from twin.scenario.verdict import VERDICT

    with results_folder(out, name) as folder:
        for file in (folder / "junit.xml", folder / VERDICT):
            check_file(file, "--out")
            file.unlink(missing_ok=True)
        yield folder
