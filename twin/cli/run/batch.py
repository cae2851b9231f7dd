"""Many runs: `twin test`, scenarios as tests, and `twin run --repeat`, which compares the digests."""

from __future__ import annotations

import json as json_module
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from twin.cli.console import print_json, stderr, stdout
from twin.cli.option_groups import AsJson, Jobs, scenario_argument
from twin.cli.run.batch_progress import batch_progress
from twin.cli.run.folders import results_folder
from twin.cli.run.options import RunOptions
from twin.errors import ScenarioError
from twin.files.reading import absence

COMMAND = (sys.executable, "-m", "twin.cli")
"""How to start another `twin`."""


def run_in_child(options: RunOptions, out: Path) -> dict[str, Any]:
    """Return the content of the run's `verdict.json`; a process that dies gives a verdict of error."""
    child = subprocess.run(
        [*COMMAND, *options.arguments(out)],
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},  # whatever this process's terminal can show
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    if child.returncode == 130:
        raise KeyboardInterrupt
    try:
        verdict: dict[str, Any] = json_module.loads(child.stdout)
    except json_module.JSONDecodeError:
        from twin.scenario.verdict import Verdict

        out.mkdir(parents=True, exist_ok=True)
        (out / "stderr.txt").write_text(child.stderr, encoding="utf-8")
        last = (child.stderr.strip() or "no message").splitlines()[-1]
        error = (
            f"the run's process ended with code {child.returncode}: {last} (all of it: {out / 'stderr.txt'})"
        )
        return Verdict(scenario=options.scenario.stem, seed=0, error=error).to_dict()
    return verdict


def run_batch(
    paths: Annotated[
        list[Path] | None,
        scenario_argument(
            metavar="SCENARIO",
            help="Names of scenarios, files, or folders of them.",
            show_default="the folder scenarios",
        ),
    ] = None,
    keyword: Annotated[
        str, typer.Option("-k", "--keyword", metavar="EXPR", help="Only tests with such names, as pytest -k.")
    ] = "",
    tag: Annotated[
        str, typer.Option("-m", "--tag", metavar="EXPR", help="Only tests with such tags, as pytest -m.")
    ] = "",
    jobs: Jobs = 1,
    shard: Annotated[
        str, typer.Option(metavar="I/N", help="Only the I-th of N parts, for N machines.")
    ] = "1/1",
    time_limit: Annotated[
        float | None,
        typer.Option(min=0.1, metavar="SECONDS", help="End a run that takes longer, by the wall clock."),
    ] = None,
    junit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write one JUnit file over all runs.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the results.", show_default="runs/test/<time>"),
    ] = None,
    record: Annotated[bool, typer.Option("--record", help="Write Rerun recordings too.")] = False,
    json: AsJson = False,
    show: Annotated[bool, typer.Option("--list", help="Only print the names of the tests.")] = False,
) -> None:
    """Run scenarios as tests, one for each seed and value that they name.

    Exit code 0: all pass; 1: one fails; 2: one could not be run.
    """
    from twin.cli.interrupted import sigterm_is_ctrl_c
    from twin.cli.run.verdict_table import many_report
    from twin.experiments.suite.cases import cases_in
    from twin.experiments.suite.run import run_all
    from twin.experiments.suite.selection import selected, shard_of
    from twin.files.writing import check_file, write_whole
    from twin.scenario.junit import junit_xml
    from twin.scenario.verdict import EXIT_CODES

    files = scenario_files(paths or [own_scenarios()])
    cases = selected(cases_in(files), keyword=keyword, tags=tag, shard=shard_of(shard))
    if show:
        for case in cases:
            sys.stdout.write(f"{case.name}\n")
        if wrong := [case.error for case in cases if case.error]:
            raise ScenarioError("\n".join(wrong))
        return
    if junit is not None:
        check_file(junit, "--junit")
    sigterm_is_ctrl_c()
    verdicts: list[Mapping[str, Any]] = []
    with results_folder(out, "test") as folder, batch_progress(len(cases)) as progress:
        try:
            verdicts.extend(
                run_all(
                    cases,
                    folder,
                    jobs=jobs or len(os.sched_getaffinity(0)),
                    record=record,
                    time_limit_s=time_limit,
                    on_begin=progress.begin,
                    on_end=progress.end,
                )
            )
        finally:  # also of those that ended before a Ctrl-C
            if junit is not None:
                write_whole(junit, junit_xml(verdicts))
    if json:
        print_json(verdicts)
    else:
        stdout().print(many_report(verdicts, folder))
    raise typer.Exit(max((EXIT_CODES[verdict["verdict"]] for verdict in verdicts), default=0))


def own_scenarios() -> Path:
    """Return the folder that is tested if none is named; raises ScenarioError if there is none."""
    from twin.scenario.catalogue import FOLDER

    if not FOLDER.is_dir():
        raise ScenarioError(
            "there is no folder 'scenarios' here; name scenarios (`twin scenarios`), files or folders of them"
        )
    return FOLDER


def scenario_files(paths: list[Path]) -> list[Path]:
    """Return the files of `paths`, which may be names, folders opened one level deep, each file once."""
    from twin.scenario.catalogue import resolve

    files: dict[Path, None] = {}
    for path in paths:
        found = sorted(path.glob("*.yaml")) if path.is_dir() else [resolve(path)]
        if not found:
            raise ScenarioError(
                f"{path}: the folder holds no scenario (*.yaml); name files or a folder of them"
            )
        if not found[0].exists():
            raise ScenarioError(f"{path}: {absence(path)}")
        files |= dict.fromkeys(found)
    return list(files)


def run_repeatedly(options: RunOptions) -> int:
    """Run some times in fresh processes, print the digests, and return the exit code."""
    from twin.scenario import schema
    from twin.scenario.verdict import EXIT_CODES

    runs = max(2, options.repeat)  # one run has nothing to be compared with
    name = "" if options.out else schema.load(options.scenario, options.overrides).name
    verdicts: list[dict[str, Any]] = []
    with results_folder(options.out, name) as parent, stderr().status("") as status:
        for number in range(1, runs + 1):
            status.update(f"run {number} of {runs}")
            verdicts.append(run_in_child(options, parent / str(number)))
    digests = sorted({verdict["digest"] or "none" for verdict in verdicts})
    if options.json:
        print_json({"runs": verdicts, "digests": digests})
    else:
        _report(verdicts, digests)
    differ = options.expect_one_hash and (len(digests) > 1 or digests == ["none"])
    return max(*(EXIT_CODES[verdict["verdict"]] for verdict in verdicts), int(differ))


def _report(verdicts: list[dict[str, Any]], digests: list[str]) -> None:
    from rich.text import Text

    from twin.cli.run.verdict_table import many_report

    console = stdout()
    console.print(many_report(verdicts))
    if len(digests) == 1:
        console.print(Text(f"one digest: {digests[0]}", style="green"))
    else:
        console.print(Text(f"{len(digests)} different digests:", style="red"))
        found = [verdict["digest"] or "none" for verdict in verdicts]
        for digest in digests:
            numbers = [str(number) for number, other in enumerate(found, 1) if other == digest]
            console.print(f"  {digest}  run {', '.join(numbers)}")
