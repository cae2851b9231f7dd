"""The options of a run, from the command line and back to one for a child process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from twin.bridge.wire import Wire
from twin.errors import ScenarioError

if TYPE_CHECKING:
    from twin.bridge.wire.session import SessionConfig


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What `twin run` was asked for."""

    scenario: Path
    overrides: Mapping[str, str] = field(default_factory=dict)
    params_file: Path | None = None
    """Of Nav2, for every robot that navigates."""
    pace: float | None = None
    """Simulated seconds per second; None: as fast as possible."""
    listen: tuple[str, ...] = ()
    nodes: tuple[str, ...] = ()
    wait_for: tuple[str, ...] = ()
    wait_timeout: float = 10.0
    """[s] of wall time."""
    free: bool = False
    connect: tuple[str, ...] = ()
    wire: Wire = "rmw_zenoh"
    zenoh_config: Path | None = None
    domain_id: int = 0
    record: bool = True
    bag: bool = False
    """Whether a bag is written into the folder of the results."""
    bag_hidden_topics: bool = False
    """Whether topics of actions are in the bag too."""
    save_model: Path | None = None

    @property
    def network(self) -> SessionConfig | None:
        """How the bus takes part in a network, None if it does not."""
        if not (self.listen or self.connect or self.zenoh_config):
            return None
        from twin.bridge.wire.session import SessionConfig

        return SessionConfig(
            mode="client" if self.connect and not self.listen else "peer",
            listen=self.listen,
            connect=self.connect,
            file=self.zenoh_config,
            wire=self.wire,
            domain_id=self.domain_id,
        )

    def arguments(self, out: Path) -> list[str]:
        """Return the arguments of a `twin` that does the same and prints JSON."""
        words = ["run", str(self.scenario), "--json", "--out", str(out)]
        words += [word for key, value in self.overrides.items() for word in ("--set", f"{key}={value}")]
        words += [] if self.params_file is None else ["--params-file", str(self.params_file)]
        words += [] if self.pace is None else ["--pace", repr(self.pace)]
        words += [word for endpoint in self.listen for word in ("--listen", endpoint)]
        words += [word for place in self.nodes for word in ("--node", place)]
        words += [word for name in self.wait_for for word in ("--wait-for", name)]
        words += ["--wait-timeout", repr(self.wait_timeout)] if self.wait_for else []
        words += ["--free"] * self.free
        words += [word for endpoint in self.connect for word in ("--connect", endpoint)]
        if self.network is not None:
            words += ["--wire", self.wire, "--domain", str(self.domain_id)]
        words += [] if self.zenoh_config is None else ["--zenoh-config", str(self.zenoh_config)]
        words += [] if self.record else ["--no-record"]
        words += ["--bag"] if self.bag else []
        words += ["--include-hidden-topics"] if self.bag_hidden_topics else []
        return words + ([] if self.save_model is None else ["--save-model", str(self.save_model)])


def parse_overrides(sets: Sequence[str], seed: int | None) -> dict[str, str]:
    """Split `KEY=VALUE` words; raises ScenarioError for one without `=`."""
    wrong = [word for word in sets if "=" not in word.lstrip("=")]
    if wrong:
        raise ScenarioError(f"--set {wrong[0]}: must be KEY=VALUE, such as --set robots.0.pose.x=1.5")
    overrides = dict(word.split("=", 1) for word in sets)
    return overrides if seed is None else {**overrides, "seed": str(seed)}


def parse_pace(text: str | None, *, free: bool = False) -> float | None:
    """Return simulated seconds per second, None for `max`; raises ScenarioError.

    Who does not say it wants `max`, or real time if others live by their own clocks.
    """
    if text is None:
        return 1.0 if free else None
    if text == "max":
        return None
    try:
        pace = float(text)
    except ValueError:
        pace = 0.0
    if not 0.0 < pace < float("inf"):
        raise ScenarioError(f"--pace {text}: must be max or a number greater than 0, such as 1 for real time")
    return pace
