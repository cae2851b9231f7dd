"""The options of a run, on the command line and on that of a child process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.bridge.wire import Wire
from twin.cli.option_groups import Overrides, Seed, scenario_argument
from twin.errors import ScenarioError

if TYPE_CHECKING:
    from twin.bridge.wire.session import SessionConfig

_others = partial(typer.Option, rich_help_panel="Other processes")
_file = partial(typer.Option, metavar="FILE", exists=True, dir_okay=False)


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What `twin run` was asked for: its argument and its options, in the order of its help."""

    scenario: Annotated[
        Path, scenario_argument(metavar="SCENARIO", help="A scenario of `twin scenarios`, or a file.")
    ]
    set: Overrides = None
    seed: Seed = None
    params_file: Annotated[
        Path | None,
        _file(help="A Nav2 parameter file for all robots that navigate, instead of the scenario's."),
    ] = None
    repeat: Annotated[int, typer.Option(min=1, help="Run this often, each time in a fresh process.")] = 1
    expect_one_hash: Annotated[
        bool, typer.Option("--expect-one-hash", help="Fail if the repeated runs differ in a single bit.")
    ] = False
    golden: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="Fail unless this is the same run as an earlier one, named by its folder or hashes.json.",
        ),
    ] = None
    pace: Annotated[
        str | None,
        typer.Option(
            help="Simulated seconds per second: a number, or max.",
            show_default="max; 1 with --free, --view or --web",
        ),
    ] = None
    view: Annotated[
        bool,
        typer.Option(
            "--view", help="Show the run while it goes on: in a window, or on a page for a browser."
        ),
    ] = False
    web: Annotated[
        bool,
        _others("--web", help="Serve web clients and the operator's page: `twin rosbridge` beside the run."),
    ] = False
    web_port: Annotated[int, _others(min=0, max=65535, help="Where they connect.")] = 9090
    web_address: Annotated[
        str, _others(metavar="IP", help="Of this computer; another than loopback needs --web-token.")
    ] = "127.0.0.1"
    web_token: Annotated[
        Path | None,
        _others(
            metavar="FILE",
            exists=True,
            dir_okay=False,
            help="Which of them may come in, see `twin rosbridge`.",
        ),
    ] = None
    listen: Annotated[
        list[str] | None,
        _others(metavar="ENDPOINT", help="Let others join the bus, e.g. tcp/127.0.0.1:7447."),
    ] = None
    node: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE.py:FACTORY", help="Also run these nodes, in this process."),
    ] = None
    wait_for: Annotated[
        list[str] | None,
        _others(
            metavar="NAME", help="Run in lock-step with a node or topic of another process, e.g. /cmd_vel."
        ),
    ] = None
    wait_timeout: Annotated[float, _others(help="How many seconds to wait for an answer.")] = 10.0
    free: Annotated[
        bool, _others("--free", help="Let others take part at their own pace; not deterministic.")
    ] = False
    keep_inputs: Annotated[
        bool, _others("--keep-inputs", help="Keep what they say, for snapshots of `twin fork --save`.")
    ] = False
    connect: Annotated[
        list[str] | None,
        _others(metavar="ENDPOINT", help="Join the graph of a router, e.g. tcp/127.0.0.1:7447."),
    ] = None
    zenoh_config: Annotated[
        Path | None, _file(help="Join as a Zenoh configuration says.", rich_help_panel="Other processes")
    ] = None
    wire: Annotated[Wire, _others(help="How names are spelled; all are heard.")] = "rmw_zenoh"
    domain: Annotated[
        int, _others(envvar="ROS_DOMAIN_ID", min=0, max=232, help="ROS domain, if others may join.")
    ] = 0
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the results.", show_default="runs/<scenario>/<time>"),
    ] = None
    no_record: Annotated[bool, typer.Option("--no-record", help="Write no Rerun recording.")] = False
    bag: Annotated[
        bool, typer.Option("--bag", help="Also write a ROS 2 bag of every message: <out>/bag.")
    ] = False
    include_hidden_topics: Annotated[
        bool, typer.Option("--include-hidden-topics", help="With --bag: topics of actions too.")
    ] = False
    save_model: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Also write the compiled world as MJCF.")
    ] = None
    workers: Annotated[
        int, typer.Option(min=0, metavar="N", help="Let N processes run the nodes of several robots.")
    ] = 0
    json: Annotated[bool, typer.Option("--json", help="Print verdict.json instead of the table.")] = False

    def __post_init__(self) -> None:
        if self.include_hidden_topics and not self.bag:
            raise typer.BadParameter("--include-hidden-topics says what is in the bag; it needs --bag")
        if self.golden is not None and (self.repeat > 1 or self.expect_one_hash):
            raise typer.BadParameter("--golden compares one run; leave --repeat and --expect-one-hash out")
        if self.view and (self.repeat > 1 or self.expect_one_hash):
            raise typer.BadParameter("--view shows one run; leave --repeat and --expect-one-hash out")
        if self.web and (self.repeat > 1 or self.expect_one_hash or self.wait_for):
            raise typer.BadParameter(
                "--web is of one run at its own pace: no --repeat, --wait-for and the like"
            )
        if self.web:
            self._check_web()
        _ = self.overrides, self.speed  # raise ScenarioError

    def _check_web(self) -> None:
        """Refuse before the run what `twin rosbridge` would refuse beside it."""
        from twin.web.rosbridge.access import read_tokens
        from twin.web.rosbridge.door import is_loopback

        if self.web_token:
            read_tokens(self.web_token)
        elif not is_loopback(self.web_address):
            raise typer.BadParameter(
                f"--web-address {self.web_address}: others may come in only with --web-token FILE"
            )

    @property
    def overrides(self) -> dict[str, str]:
        """Dotted keys of the scenario -> values that go before its own."""
        return parse_overrides(self.set or (), self.seed)

    @property
    def speed(self) -> float | None:
        """Simulated seconds per second; None: as fast as possible.

        Who does not say it wants `max`, or real time if people watch or others live by their own clocks.
        """
        if self.pace is None or self.pace == "max":
            watched = self.free or self.view or self.web
            return 1.0 if watched and self.pace is None else None
        try:
            speed = float(self.pace)
        except ValueError:
            speed = 0.0
        if not 0.0 < speed < float("inf"):
            raise ScenarioError(
                f"--pace {self.pace}: must be max or a number greater than 0, such as 1 for real time"
            )
        return speed

    @property
    def network(self) -> SessionConfig | None:
        """How the bus takes part in a network, None if it does not."""
        listen = tuple(self.listen or ())
        if self.web and not self.joined:
            listen = (self.endpoint,)
        if not (listen or self.joined):
            return None
        from twin.bridge.wire.session import SessionConfig

        return SessionConfig(
            mode="client" if self.connect and not listen else "peer",
            listen=listen,
            connect=tuple(self.connect or ()),
            file=self.zenoh_config,
            wire=self.wire,
            domain_id=self.domain,
        )

    @property
    def joined(self) -> bool:
        """Whether the options themselves say how others meet the run."""
        return bool(self.listen or self.connect or self.zenoh_config)

    @cached_property
    def endpoint(self) -> str:
        """Where the bridge meets the run: where it listens, or a port that is free now."""
        from twin.cli.run.web import free_endpoint

        return next(iter(self.listen or self.connect or ()), "") or free_endpoint()

    @property
    def serving(self) -> list[str]:
        """The options by which `twin rosbridge` serves web clients of the run."""
        words = ["--port", str(self.web_port), "--address", self.web_address]
        return [*words, "--token", str(self.web_token)] if self.web_token else words

    @property
    def joining(self) -> list[str]:
        """The options by which another command joins the run."""
        where = ["--config", str(self.zenoh_config)] if self.zenoh_config else ["--connect", self.endpoint]
        return [*where, "--domain", str(self.domain), "--wire", self.wire]

    def arguments(self, out: Path) -> list[str]:
        """Return the arguments of a `twin` that does the same once, in a folder, and prints JSON."""
        child = replace(self, out=out, json=True, repeat=1, expect_one_hash=False)
        words = ["run", str(self.scenario)]
        for name, value in vars(child).items():
            if name != "scenario" and value is not None and value is not False:
                option = f"--{name.replace('_', '-')}"
                values = value if isinstance(value, list) else [value]
                words += [option] if value is True else [w for each in values for w in (option, str(each))]
        return words


def parse_overrides(sets: Sequence[str], seed: int | None) -> dict[str, str]:
    """Split `KEY=VALUE` words; raises ScenarioError for one without `=`."""
    wrong = [word for word in sets if "=" not in word.lstrip("=")]
    if wrong:
        raise ScenarioError(f"--set {wrong[0]}: must be KEY=VALUE, such as --set robots.0.pose.x=1.5")
    overrides = dict(word.split("=", 1) for word in sets)
    return overrides if seed is None else {**overrides, "seed": str(seed)}
