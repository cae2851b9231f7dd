"""A plugin of pytest: scenario files are tests, `pytest scenarios --twin`.

It loads nothing of twin until a scenario is collected.
"""

from __future__ import annotations

import re
from collections.abc import Generator, Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from twin.experiments.suite.cases import Case
    from twin.experiments.suite.run import Runner

_SCENARIO = re.compile(r"^(robots|checks|mission) *:", re.MULTILINE)
"""What tells a scenario from other YAML files, in a folder."""
_OUT: pytest.StashKey[Path] = pytest.StashKey()
_RUNNER: pytest.StashKey[Runner] = pytest.StashKey()


class ScenarioFailed(Exception):
    """A check does not hold."""


class ScenarioBroken(Exception):
    """The run could not be made or finished."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the options and the key of the ini file."""
    group = parser.getgroup("twin", "scenarios of twin")
    group.addoption("--twin", action="store_true", help="collect the scenario files of folders, too")
    group.addoption(
        "--twin-out", metavar="DIR", type=Path, help="folder of the runs (default: runs/pytest/<time>)"
    )
    group.addoption("--twin-record", action="store_true", help="write a Rerun recording of each run")
    parser.addini(
        "twin_scenarios",
        "patterns of scenario files to collect without --twin, such as scenarios/*.yaml",
        type="args",
        default=[],
    )


def pytest_configure(config: pytest.Config) -> None:
    """Choose the folder of the runs; xdist's processes have the same one."""
    given = getattr(config, "workerinput", {}).get("twin_out") or config.getoption("--twin-out")
    out = Path(given) if given else Path("runs", "pytest", datetime.now().strftime("%Y%m%d-%H%M%S"))
    config.stash[_OUT] = out if out.is_absolute() else config.invocation_params.dir / out


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Tell a process of xdist the folder of the runs."""
    node.workerinput["twin_out"] = str(node.config.stash[_OUT])


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the process that made the runs."""
    runner = config.stash.get(_RUNNER, None)
    if runner is not None:
        runner.close()


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> ScenarioFile | None:
    """Collect a scenario: one that is named, one that a pattern fits, with `--twin` all of a folder."""
    if file_path.suffix not in (".yaml", ".yml"):
        return None
    config = parent.config
    patterns = config.getini("twin_scenarios")
    if any(file_path.match(pattern) for pattern in patterns):
        return ScenarioFile.from_parent(parent, path=file_path)
    if not (config.getoption("--twin") or parent.session.isinitpath(file_path)):
        return None
    if not _SCENARIO.search(file_path.read_text(encoding="utf-8", errors="replace")):
        return None
    return ScenarioFile.from_parent(parent, path=file_path)


class ScenarioFile(pytest.File):
    """A scenario file."""

    def collect(self) -> Iterator[ScenarioItem]:
        """Yield its tests; what is wrong with its key `test` is an error of collection."""
        from twin.errors import TwinError
        from twin.experiments.suite.cases import cases_of

        try:
            cases = cases_of(_from_here(self.path, self.config))
        except TwinError as fault:
            raise self.CollectError(str(fault)) from None
        for case in cases:
            item: ScenarioItem = ScenarioItem.from_parent(self, name=case.name)
            item.case = case
            for tag in case.tags:
                self.config.addinivalue_line("markers", f"{tag}: a tag of scenarios")
                item.add_marker(tag)
            yield item


class ScenarioItem(pytest.Item):
    """One run of a scenario. It is made in the phase of setup, where what goes wrong is an error."""

    case: Case
    verdict: Mapping[str, Any]

    @property
    def folder(self) -> Path:
        """Where its results are."""
        place = re.sub(r"[^\w.=,+-]+", "-", self.nodeid.partition("::")[0].rpartition(".")[0]).strip("-")
        return self.config.stash[_OUT] / place / self.case.folder

    def setup(self) -> None:
        """Make the run; raises ScenarioBroken if that cannot be."""
        from twin.experiments.suite.one_run import OUTPUT, Job
        from twin.experiments.suite.run import Runner

        stash = self.config.stash
        if _RUNNER not in stash:
            stash[_RUNNER] = Runner()
        record = self.config.getoption("--twin-record")
        self.verdict = stash[_RUNNER].run(Job(number=1, case=self.case, folder=self.folder, record=record))
        self.user_properties += [("digest", self.verdict["digest"]), ("seed", self.verdict["seed"])]
        output = self.folder / OUTPUT
        if output.exists():
            printed = output.read_text(encoding="utf-8", errors="replace")
            self.add_report_section("setup", "stdout", printed)
        if self.verdict["error"] is not None:
            raise ScenarioBroken

    def runtest(self) -> None:
        """Judge it; raises ScenarioFailed if a check does not hold."""
        if self.verdict["verdict"] != "pass":
            raise ScenarioFailed

    def told(self) -> Iterator[str]:
        """Yield the lines of a report: what is wrong, where the run is, and how to make it again."""
        if self.verdict["error"] is not None:
            yield f"the run could not be made or finished: {self.verdict['error']}"
        else:
            from twin.scenario.verdict_text import lines_of

            yield from lines_of(self.verdict)
        yield f"written to {_from_here(self.folder, self.config)}"
        yield f"run it again: {self.case.command}"

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return where the test is, and its name."""
        return self.path, None, self.name


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Tell of a scenario without a traceback, which would be this file's."""
    report = yield
    wrong = (ScenarioBroken, ScenarioFailed)
    if isinstance(item, ScenarioItem) and call.excinfo is not None and call.excinfo.errisinstance(wrong):
        report.longrepr = "\n".join(item.told())
    return report


def _from_here(path: Path, config: pytest.Config) -> Path:
    """Return a path as seen from the folder in which pytest was called, if it is below."""
    here = config.invocation_params.dir
    return path.relative_to(here) if path.is_relative_to(here) else path
