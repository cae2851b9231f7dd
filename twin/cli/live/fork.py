"""`twin fork`: what will become of a run."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.option_groups import AsJson
from twin.cli.ros.joining import Joining, joins
from twin.errors import BridgeError, SimulationError

_WAIT_S = 3.0
"""For a run that is there."""

if TYPE_CHECKING:
    from twin.bridge.live import LiveBus
    from twin.live.futures.futures import Answer
    from twin.live.futures.snapshot import Snapshot
    from twin.live.futures.what_if import WhatIf


@joins
def fork(
    at: Annotated[
        str, typer.Option(metavar="now|FILE", help="Of the run that goes on, or of a snapshot of --save.")
    ] = "now",
    n: Annotated[int, typer.Option("--n", metavar="N", help="How many futures.")] = 8,
    horizon: Annotated[float, typer.Option(metavar="S", help="How far they go at most.")] = 60.0,
    goal: Annotated[
        str | None,
        typer.Option(metavar="X,Y,YAW", help="Send the robot there (m, m, rad), instead of what it is at."),
    ] = None,
    set: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="What is otherwise from now on: NODE.PARAMETER, or a fault by one number; may be repeated.",
        ),
    ] = None,
    robot: Annotated[
        str, typer.Option(metavar="NAME", help="Who is watched.", show_default="the only one")
    ] = "",
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a snapshot of the run instead.")
    ] = None,
    json: AsJson = False,
    *,
    joining: Joining,
) -> None:
    """Run futures of a run, or of a mirror, that goes on, and tell how they end.

    Each is a fork of the run, as it is at this moment, that goes on faster than real time. The first has the
    noise that the run will have, each of the others its own. The run goes on as if nothing had happened.
    """
    from twin.live.futures.what_if import WhatIf, parsed_goal

    asked = WhatIf(
        n=n,
        horizon=horizon,
        robot=robot,
        goal=None if goal is None else parsed_goal(goal),
        set=tuple(set or ()),
    )
    if save is not None:
        with joining.open() as process:
            snapshot = _snapshot(process)
        snapshot.write(save)
        typer.echo(f"{save}: t = {snapshot.time_ns * 1e-9:.2f} s; to be there again, {snapshot.cost}")
        return
    if at == "now":
        with joining.open() as process:
            answer = _asked_of_a_run(process, asked)
    else:
        answer = _asked_of_a_snapshot(Path(at), asked)
    typer.echo(answer.to_json() if json else "\n".join(_report(answer)))


def _asked_of_a_run(process: LiveBus, asked: WhatIf) -> Answer:
    from twin.bridge.parameters.values import Parameter
    from twin.cli.ros.param.client import ParameterClient
    from twin.live.futures.futures import Answer
    from twin.live.futures.names import NODE, RUN
    from twin.live.futures.node import parameters_of

    _find(process)
    values = parameters_of(asked).items()
    ParameterClient(process, NODE).set(
        [Parameter(name, value=value).to_parameter_msg() for name, value in values]
    )
    answer = Answer.from_json(_trigger(process, RUN))
    if answer.asked != asked:
        raise SimulationError("somebody else has asked something else at the same moment; ask again")
    return answer


def _asked_of_a_snapshot(file: Path, asked: WhatIf) -> Answer:
    from twin.live.futures.futures import Futures
    from twin.live.futures.snapshot import Snapshot

    snapshot = Snapshot.read(file)
    snapshot.check()
    typer.echo(f"{file}: {snapshot.cost}", err=True)
    run = snapshot.restore()
    try:
        with Futures(run, asked) as futures:
            return futures.wait()
    finally:
        run.close()


def _snapshot(process: LiveBus) -> Snapshot:
    from twin.live.futures.names import SNAPSHOT
    from twin.live.futures.snapshot import Snapshot

    _find(process)
    return Snapshot.from_json(_trigger(process, SNAPSHOT))


def _find(process: LiveBus) -> None:
    """Wait for a run that tells its futures; raises SimulationError if there is none."""
    from twin.cli.ros.param.client import find_node
    from twin.live.futures.names import NODE

    try:
        find_node(process, NODE, hidden=False, timeout_s=_WAIT_S)
    except BridgeError:
        raise SimulationError(
            "nobody there tells futures; who does is `twin mirror`, and `twin run` with --listen or "
            "--connect, without --wait-for and --workers"
        ) from None


def _trigger(process: LiveBus, service: str) -> str:
    """Return the message of an answer; raises SimulationError if it is a refusal."""
    from twin.bridge.srvs import Trigger
    from twin.cli.ros.joining import tool_node
    from twin.cli.ros.service.call import answer

    client = tool_node(process.bus, "fork").create_client(Trigger, service)
    if not process.spin(lambda: client.service_is_ready, _WAIT_S):
        raise SimulationError(f"{service} is announced, but cannot be reached")
    response: Any = answer(process, client, Trigger.Request())
    if not response.success:
        raise SimulationError(response.message)
    return str(response.message)


def _report(answer: Answer) -> list[str]:
    from twin.experiments.sequential import clopper_pearson

    lines = [f"{'future':>6}  {'end':<9}  {'after':>7}  {'clearance':>9}"]
    for one in answer.outcomes:
        clearance = "" if one.clearance_m is None else f"{one.clearance_m:z.3f} m"
        why = "; ".join(filter(None, (", ".join(one.failed_checks), one.reason)))
        lines.append(f"{one.number:>6}  {one.end:<9}  {one.end_s:>5.2f} s  {clearance:>9}  {why}".rstrip())
    arrivals = [one.arrival_s for one in answer.outcomes if one.arrival_s is not None]
    if answer.awaited and answer.known:
        low, high = clopper_pearson(answer.succeeded, answer.known)
        chance = (
            f"{answer.succeeded} of {answer.known} reach {answer.awaited} within {answer.asked.horizon:g} s"
        )
        share = answer.succeeded / answer.known
        lines.append(f"{chance}: chance {share:.0%} ({low:.0%} to {high:.0%} with 95 % confidence)")
    elif not answer.awaited:
        lines.append("there is nothing that they could reach: no goal is under way, and no mission")
    if arrivals:
        lines.append(
            f"arrival {min(arrivals):.2f} to {max(arrivals):.2f} s from now, median {median(arrivals):.2f} s"
        )
    lines.append(
        f"from t = {answer.at_s:.2f} s of a {answer.label}; "
        f"{answer.cpu_s:.1f} s of CPU in {answer.wall_s:.1f} s; "
        f"the run stood still for {answer.stall_s * 1e3:.0f} ms"
    )
    return lines
