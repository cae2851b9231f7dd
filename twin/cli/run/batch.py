"""`twin test`: many scenarios as tests."""

from __future__ import annotations

import json as json_module
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from twin.cli import completion
from twin.errors import ScenarioError
from twin.files.reading import absence


def run_batch(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="SCENARIO",
            help="Names of scenarios, files, or folders of them.",
            show_default="the folder scenarios",
            autocompletion=completion.scenarios,
        ),
    ] = None,
    junit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write one JUnit file over all runs.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the results.", show_default="runs/test/<time>"),
    ] = None,
    record: Annotated[bool, typer.Option("--record", help="Write Rerun recordings too.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of the table.")] = False,
) -> None:
    """Run many scenarios, each in a process of its own.

    Exit code 0: all pass; 1: one fails; 2: one could not be run.
    """
    from twin.cli.console import stderr, stdout
    from twin.cli.run.child import run_in_child
    from twin.cli.run.folders import results_folder
    from twin.cli.run.options import RunOptions
    from twin.cli.run.verdict_table import many_report
    from twin.files.writing import check_file, write_whole

    files = scenario_files(paths or [own_scenarios()])
    if junit is not None:
        check_file(junit, "--junit")
    verdicts: list[dict[str, Any]] = []
    with results_folder(out, "test") as folder, stderr().status("") as status:
        for number, file in enumerate(files, 1):
            status.update(f"{number} of {len(files)}: {file}")
            target = folder / f"{number:02d}-{file.stem}"
            verdicts.append(run_in_child(RunOptions(scenario=file, no_record=not record), target))
    if junit is not None:
        from twin.scenario.junit import junit_xml

        write_whole(junit, junit_xml(verdicts))
    if json:
        sys.stdout.write(json_module.dumps(verdicts, indent=2) + "\n")
    else:
        stdout().print(many_report(verdicts))
    raise typer.Exit(max({"pass": 0, "fail": 1, "error": 2}[verdict["verdict"]] for verdict in verdicts))


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
