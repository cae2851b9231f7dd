"""`twin run`: one scenario to its verdict."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twin.bridge.wire import Wire
from twin.cli import completion
from twin.cli.run.options import RunOptions, parse_overrides, parse_pace

_OTHERS = "Other processes"


def run(
    scenario: Annotated[
        Path,
        typer.Argument(
            metavar="SCENARIO",
            help="A scenario of `twin scenarios`, or a file.",
            show_default=False,
            autocompletion=completion.scenarios,
        ),
    ],
    sets: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change one value of the file; may be repeated."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all noise, instead of the file's.")] = None,
    params_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            exists=True,
            dir_okay=False,
            help="A Nav2 parameter file for all robots that navigate, instead of the scenario's.",
        ),
    ] = None,
    repeat: Annotated[int, typer.Option(min=1, help="Run this often, each time in a fresh process.")] = 1,
    expect_one_hash: Annotated[
        bool, typer.Option("--expect-one-hash", help="Fail if the repeated runs differ in a single bit.")
    ] = False,
    pace: Annotated[
        str | None,
        typer.Option(
            help="Simulated seconds per second: a number, or max.", show_default="max; 1 with --free"
        ),
    ] = None,
    listen: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Let others join the bus, e.g. tcp/127.0.0.1:7447.",
            rich_help_panel=_OTHERS,
        ),
    ] = None,
    node: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE.py:FACTORY", help="Also run these nodes, in this process."),
    ] = None,
    wait_for: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Run in lock-step with a node or topic of another process, e.g. /cmd_vel.",
            rich_help_panel=_OTHERS,
        ),
    ] = None,
    wait_timeout: Annotated[
        float, typer.Option(help="How many seconds to wait for an answer.", rich_help_panel=_OTHERS)
    ] = 10.0,
    free: Annotated[
        bool,
        typer.Option(
            "--free",
            help="Let others take part at their own pace; not deterministic.",
            rich_help_panel=_OTHERS,
        ),
    ] = False,
    connect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Join the graph of a router, e.g. tcp/127.0.0.1:7447.",
            rich_help_panel=_OTHERS,
        ),
    ] = None,
    zenoh_config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            exists=True,
            dir_okay=False,
            help="Join as a Zenoh configuration says.",
            rich_help_panel=_OTHERS,
        ),
    ] = None,
    wire: Annotated[
        Wire, typer.Option(help="How names are spelled; all are heard.", rich_help_panel=_OTHERS)
    ] = "rmw_zenoh",
    domain: Annotated[
        int,
        typer.Option(
            envvar="ROS_DOMAIN_ID",
            min=0,
            max=232,
            help="ROS domain, if others may join.",
            rich_help_panel=_OTHERS,
        ),
    ] = 0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the results.", show_default="runs/<scenario>/<time>"),
    ] = None,
    no_record: Annotated[bool, typer.Option("--no-record", help="Write no Rerun recording.")] = False,
    bag: Annotated[
        bool, typer.Option("--bag", help="Also write a ROS 2 bag of every message: <out>/bag.")
    ] = False,
    hidden: Annotated[
        bool, typer.Option("--include-hidden-topics", help="With --bag: topics of actions too.")
    ] = False,
    save_model: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Also write the compiled world as MJCF.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print verdict.json instead of the table.")] = False,
) -> None:
    """Run a scenario to its verdict.

    Exit code 0: every check holds; 1: one fails; 2: the run could not be made.
    """
    if hidden and not bag:
        raise typer.BadParameter("--include-hidden-topics says what is in the bag; it needs --bag")
    options = RunOptions(
        scenario=scenario,
        overrides=parse_overrides(sets or [], seed),
        params_file=params_file,
        pace=parse_pace(pace, free=free),
        listen=tuple(listen or ()),
        nodes=tuple(node or ()),
        wait_for=tuple(wait_for or ()),
        wait_timeout=wait_timeout,
        free=free,
        connect=tuple(connect or ()),
        zenoh_config=zenoh_config,
        wire=wire,
        domain_id=domain,
        record=not no_record,
        bag=bag,
        bag_hidden_topics=hidden,
        save_model=save_model,
    )
    if repeat == 1 and not expect_one_hash:
        from twin.cli.run.once import run_once

        raise typer.Exit(run_once(options, out, as_json=json))
    from twin.cli.run.repeat import run_repeatedly

    runs = max(2, repeat)  # one run has nothing to be compared with
    raise typer.Exit(run_repeatedly(options, runs, out, as_json=json, expect_one_hash=expect_one_hash))
