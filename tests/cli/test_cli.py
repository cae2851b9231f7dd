"""The command line: exit codes, output, errors in one sentence, and a light start."""
# ruff: noqa: E501  (messages are compared whole)

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
import types
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from rich.console import Console, RenderableType
from rich.text import Text
from typer.main import get_command
from typer.testing import CliRunner

from twin.cli import app as app_module
from twin.cli.console import WIDE
from twin.cli.own_commands import TABLE
from twin.cli.play import find_recording
from twin.cli.run import batch
from twin.cli.run.batch import run_in_child
from twin.cli.run.options import RunOptions, parse_overrides
from twin.cli.run.verdict_table import many_report, verdict_report
from twin.errors import RecordingError, ScenarioError, SimulationError
from twin.experiments.suite import run as suite_run
from twin.experiments.suite.cases import Case
from twin.files.writing import written_alone
from twin.models import catalogue
from twin.scenario.checks import CheckResult
from twin.scenario.faults import FaultReport
from twin.scenario.schema import Scenario
from twin.scenario.verdict import Verdict

SCENARIO = """\
name: demo
duration: 1 s
robots: [{model: diff_bot}]
checks: [{energy: {max: 1}}]
"""

HEAVY = ("mujoco", "zenoh", "rerun", "pydantic", "numpy", "scipy", "numba", "yaml", "xacro", "rosbags")


def twin(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "twin.cli", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


class FakeRuntime:
    """Stands in for the simulation, to test what the command line does with its outcome."""

    def __init__(self) -> None:
        self.calls: list[dict[str, Any]] = []
        self.passed = True
        self.fault: Exception | None = None
        self.metrics = {"sim_time_s": 1.0, "wall_time_s": 0.1, "real_time_factor": 10.0}

    def OpenRun(self, scenario: Scenario, **options: Any) -> FakeRuntime:
        self.calls.append({"scenario": scenario, **options})
        return self

    def advance_to_end(self, progress: object, watch: object = None) -> None:
        if self.fault is not None:
            raise self.fault

    def close(self) -> None:
        pass

    def finish(self) -> Verdict:
        scenario = self.calls[-1]["scenario"]
        reason = "" if self.passed else "diff_bot used 3 J"
        check = CheckResult(
            name="energy", passed=self.passed, value=0.25, limit=1.0, unit="J", at_s=1.0, reason=reason
        )
        return Verdict(
            scenario=scenario.name,
            seed=scenario.seed,
            checks=(check,),
            metrics=self.metrics,
            digest="ab" * 32,
        )


@pytest.fixture
def runtime(monkeypatch: pytest.MonkeyPatch) -> FakeRuntime:
    fake = FakeRuntime()
    module = types.ModuleType("twin.runtime")
    module.OpenRun = fake.OpenRun  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "twin.runtime", module)
    monkeypatch.setattr("twin.runtime", module, raising=False)
    return fake


@pytest.fixture
def demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "demo.yaml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


@pytest.fixture
def invoke(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    def call(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["twin", *arguments])
        with pytest.raises(SystemExit) as exit_info:
            app_module.run_app()
        captured = capsys.readouterr()
        code = exit_info.value.code
        assert isinstance(code, int)
        return code, captured.out, captured.err

    return call


Invoke = Callable[..., tuple[int, str, str]]


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['twin', '--help']\n"
        "import twin.cli\n"
        "try: twin.cli.main()\n"
        "except SystemExit: pass\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    assert "Run a scenario to its verdict" in done.stdout


@pytest.mark.parametrize("command", [name for name, own in TABLE.items() if own.example])
def test_help_of_every_command_has_an_example_that_parses(command: str) -> None:
    result = CliRunner().invoke(app_module.app, [command, "--help"], env={"COLUMNS": "200"})
    assert result.exit_code == 0
    example = re.search(r"Example: (twin .*?)\s*$", result.output, re.MULTILINE)
    assert example is not None
    assert example[1].split()[1] == command


def test_the_list_of_commands_says_of_each_what_its_own_help_begins_with() -> None:
    for name, command in get_command(app_module.app).commands.items():  # type: ignore[attr-defined]
        assert TABLE[name].summary == command.help.partition("\n\n")[0].replace("\n", " ")


def test_no_help_text_is_taken_for_markup() -> None:
    """rich leaves '[s]' out, as if it were struck through."""
    seen = []

    def look(command: Any) -> None:
        seen.append(command)
        for text in [command.help, *(getattr(each, "help", None) for each in command.params)]:
            assert text is None or Text.from_markup(text).plain == text, command.name
        for each in getattr(command, "commands", {}).values():
            look(each)

    look(get_command(app_module.app))
    assert len(seen) > 40


def test_what_to_put_in_is_named_in_one_way() -> None:
    """Typer shows `{scenario}` for an argument of which nobody says what it is, and adds brackets and dots."""
    wrong = []

    def is_plain(metavar: str | None) -> bool:
        return metavar is not None and "[" not in metavar and not metavar.endswith("...")

    def look(command: Any, name: str) -> None:
        arguments = [each for each in command.params if not each.opts[0].startswith("-")]
        wrong.extend(f"{name} {each.name}" for each in arguments if not is_plain(each.metavar))
        for child, inner in getattr(command, "commands", {}).items():
            look(inner, f"{name} {child}")

    look(get_command(app_module.app), "twin")
    assert wrong == []


@pytest.mark.parametrize(
    ("arguments", "unbuffered"), [(["--help"], ""), (["robots"], "1"), (["interface", "list"], "")]
)
def test_a_full_disk_under_the_output_is_told(arguments: list[str], unbuffered: str) -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "twin.cli", *arguments]
        surroundings = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
        done = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, env=surroundings, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (
        2,
        "error: No space left on device: what is printed is not whole; make room\n",
    )


@pytest.mark.parametrize(
    "surroundings",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": ""},
    ],
    ids=["ascii", "C"],
)
def test_a_terminal_of_few_characters_shows_what_it_can(tmp_path: Path, surroundings: dict[str, str]) -> None:
    def run(*words: str) -> tuple[int, str, str]:
        done = subprocess.run(
            [sys.executable, "-m", "twin.cli", *words],
            env={**os.environ, **surroundings, "COLUMNS": "200"},
            capture_output=True, text=True, encoding="ascii", check=False, cwd=tmp_path,
        )  # fmt: skip
        return done.returncode, done.stdout, done.stderr

    code, out, err = run("bench", "--help")
    assert (code, err, "K?mmerle" in out) == (0, "", True)
    code, _, err = run("run", "böse.yaml")
    assert (code, re.sub(r"\?+", "?", err)) == (2, "error: b?se.yaml: no such file\n")


def test_version_needs_nothing_heavy(invoke: Invoke) -> None:
    assert invoke("--version") == (0, f"twin {version('twin')}\n", "")


def test_a_closed_output_is_no_fault() -> None:
    command = f"{sys.executable} -m twin.cli interface list >&-"
    done = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_commands_are_grouped() -> None:
    out = CliRunner().invoke(app_module.app, ["--help"], env={"COLUMNS": "120"}).output
    panels = re.findall(r"^╭─ (\w.*?) ─", out, re.MULTILINE)
    assert panels[:5] == ["Options", "Scenarios", "Robot files", "ROS 2 graph", "Navigation"]


def test_pass_is_0_and_writes_the_files(demo: Path, runtime: FakeRuntime, invoke: Invoke) -> None:
    code, out, err = invoke(
        "run", str(demo), "--seed", "7", "--set", "checks.0.energy.max=2 J", "--no-record"
    )
    assert (code, err) == (0, "")
    assert "PASS" in out
    assert re.search(r"ok +energy +0.25 J +1 J +1.00 s", out)
    (folder,) = (demo.parent / "runs" / "demo").iterdir()
    assert re.fullmatch(r"\d{8}-\d{6}", folder.name)
    assert json.loads((folder / "verdict.json").read_text(encoding="utf-8"))["seed"] == 7
    assert ElementTree.parse(folder / "junit.xml").getroot().get("failures") == "0"
    (call,) = runtime.calls
    assert call["scenario"].checks[0].energy.max == 2.0
    assert (call["record"], call["pace"], call["network"]) == (False, None, None)


@pytest.mark.parametrize(
    ("losses", "lost_s", "told"),
    [(0, 0.0, ""), (1, 7.96, "lost once, 8.0 s in all"), (12, 3.14, "lost 12 times, 3.1 s in all")],
)
def test_a_pace_that_was_lost_is_told(
    demo: Path, runtime: FakeRuntime, invoke: Invoke, losses: float, lost_s: float, told: str
) -> None:
    runtime.metrics |= {"pace_losses": losses, "pace_lost_s": lost_s}
    _, out, _ = invoke("run", str(demo), "--pace", "1", "--no-record")
    assert re.findall(r"the pace was (.*\S)", out) == ([told] if told else [])


@pytest.mark.parametrize(("width", "shown"), [(80, 36), (100, 52), (200, 52)])
def test_a_long_name_of_a_check_is_cut_on_a_terminal_alone(width: int, shown: int) -> None:
    name = "always(" + "x" * 120 + ")"
    check = CheckResult(name=name, passed=True, value=2.5, limit=2.0, unit="m", at_s=1.0, margin=0.5)
    verdict = Verdict(scenario="demo", seed=1, checks=(check,)).to_dict()

    def printed(columns: int, *, short: bool) -> str:
        console = Console(width=columns, file=io.StringIO())
        console.print(verdict_report(verdict, None, short=short))
        return console.file.getvalue()  # type: ignore[attr-defined, no-any-return]

    cut = printed(width, short=True)
    assert f" ok  always({'x' * shown}… " in cut
    assert max(map(len, cut.splitlines())) <= width
    assert name in printed(WIDE, short=False)


def test_what_became_of_faults_is_told() -> None:
    faults = (
        FaultReport(name="loss", kind="loss", outcome="landed", at_s=1.0, end_s=2.5, effect="3 of 9 lost"),
        FaultReport(name="ice", kind="friction", outcome="no_effect", at_s=0.0, effect="0 of 9 ticks"),
        FaultReport(name="late", kind="link_delay", outcome="not_reached"),
    )
    verdict = Verdict(scenario="demo", seed=1, faults=faults).to_dict()

    def printed(report: RenderableType) -> str:
        console = Console(width=120, file=io.StringIO())
        console.print(report)
        return console.file.getvalue()  # type: ignore[attr-defined, no-any-return]

    one, many = printed(verdict_report(verdict, None)), printed(many_report([verdict]))
    assert re.search(r"landed +loss +1.00 s +2.50 s +3 of 9 lost *\n", one)
    assert re.search(r"no effect +ice +0.00 s +0 of 9 ticks *\n", one)
    assert re.search(r"not reached +late *\n", one)
    assert "demo: the fault ice had no effect: 0 of 9 ticks" in many
    assert "demo: the fault late did not happen" in many
    assert "the fault loss" not in many
    assert "demo and 2 more: the fault late did not happen" in printed(many_report([verdict] * 3))


def test_a_failed_check_is_1_with_its_reason(demo: Path, runtime: FakeRuntime, invoke: Invoke) -> None:
    runtime.passed = False
    code, out, _ = invoke("run", str(demo), "--out", "here")
    assert code == 1
    assert "FAIL" in out
    assert "diff_bot used 3 J" in out
    assert (demo.parent / "here" / "verdict.json").exists()


def test_json_is_the_file(demo: Path, runtime: FakeRuntime, invoke: Invoke) -> None:
    code, out, _ = invoke("run", str(demo), "--json", "--out", "here", "--pace", "1")
    assert code == 0
    assert out == (demo.parent / "here" / "verdict.json").read_text(encoding="utf-8")
    assert runtime.calls[0]["pace"] == 1.0


def test_a_fault_of_a_users_node_is_2_in_one_sentence_and_in_the_verdict(tmp_path: Path) -> None:
    """1 would be a failed check: whoever reads the exit code only would look for it in the robot."""
    (tmp_path / "demo.yaml").write_text(SCENARIO, encoding="utf-8")
    (tmp_path / "bad.py").write_text(
        "def make(bus):\n"
        "    node = bus.create_node('bad')\n"
        "    node.create_timer(20_000_000, lambda: 1 / 0)\n"
        "    return node\n",
        encoding="utf-8",
    )
    done = twin("run", "demo.yaml", "--node", "bad.py:make", "--no-record", "--out", "here", cwd=tmp_path)
    assert done.returncode == 2
    fault = "bad.py:3: node 'bad.py:make' fails: ZeroDivisionError: division by zero"
    assert done.stderr.endswith(f"error: {fault}\n")
    assert "Traceback" not in done.stderr
    verdict = json.loads((tmp_path / "here" / "verdict.json").read_text(encoding="utf-8"))
    assert (verdict["verdict"], verdict["error"]) == ("error", fault)


def test_a_mistake_is_2_in_one_sentence_each(demo: Path, runtime: FakeRuntime, invoke: Invoke) -> None:
    demo.write_text(SCENARIO.replace("energy", "enrgy").replace("1 s", "1 kg"), encoding="utf-8")
    code, out, err = invoke("run", str(demo))
    assert (code, out) == (2, "")
    assert err.splitlines() == [
        f"error: {demo}:2: duration: must have a unit of time (s, ms, us, min, h), not '1 kg'",
        f"error: {demo}:4: unknown key 'enrgy' in checks.0; did you mean 'energy'? "
        "Valid: always, closed_loop, delivered, driven_distance, energy, eventually, final_pose, finally, "
        "formula, localisation_error, map_accuracy, map_coverage, mission_failed, mission_succeeded, never, "
        "no_collision, odometry_drift, path_on_circle, reaches, recoveries, time_limit, tote_slip, until, within",
        "2 problems",
    ]
    assert not runtime.calls
    assert not (demo.parent / "runs").exists()


def test_a_run_that_breaks_is_2_with_an_error_verdict(
    demo: Path, runtime: FakeRuntime, invoke: Invoke
) -> None:
    runtime.fault = SimulationError("the physics diverged at 0.3 s")
    code, out, err = invoke("run", str(demo), "--out", "here", "--json")
    assert (code, err) == (2, "error: the physics diverged at 0.3 s\n")
    assert json.loads(out)["verdict"] == "error"
    assert ElementTree.parse(demo.parent / "here" / "junit.xml").getroot().get("errors") == "1"


@pytest.mark.parametrize(
    "command", [("run",), ("check",), ("test",), ("play",), ("bag", "info"), ("map", "show")]
)
def test_a_name_that_is_too_long_for_a_file_is_told(command: tuple[str, ...], invoke: Invoke) -> None:
    code, _, err = invoke(*command, "a" * 300)
    assert (code, err.count("\n"), "File name too long" in err) == (2, 1, True)


def test_a_bug_keeps_its_traceback(demo: Path, runtime: FakeRuntime, invoke: Invoke) -> None:
    runtime.fault = ZeroDivisionError("a bug")
    code, _, err = invoke("run", str(demo))
    assert code == 2
    assert err.startswith("Traceback")
    assert err.endswith("ZeroDivisionError: a bug\n")


def test_ctrl_c_is_130(demo: Path, runtime: FakeRuntime, invoke: Invoke) -> None:
    runtime.fault = KeyboardInterrupt()  # type: ignore[assignment]
    assert invoke("run", str(demo), "--out", "here") == (130, "", "")
    verdict = json.loads((demo.parent / "here" / "verdict.json").read_text(encoding="utf-8"))
    assert (verdict["verdict"], verdict["error"]) == ("error", "interrupted")


def test_two_runs_in_one_second_get_two_folders(demo: Path, runtime: FakeRuntime, invoke: Invoke) -> None:
    for _ in range(3):
        invoke("run", str(demo))
    assert len(list((demo.parent / "runs" / "demo").iterdir())) == 3


def _no_run(*_: object) -> None:
    raise AssertionError("something ran")


@pytest.mark.parametrize(
    "command",
    [
        ["run", "demo.yaml", "--out", "held"],
        ["run", "demo.yaml", "--save-model", "held"],
        ["run", "demo.yaml", "--repeat", "2", "--out", "held"],
        ["test", "demo.yaml", "--out", "held"],
    ],
)
def test_two_commands_do_not_write_into_one_folder(
    demo: Path, runtime: FakeRuntime, invoke: Invoke, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    monkeypatch.setattr("twin.cli.run.batch.run_in_child", _no_run)
    monkeypatch.setattr(suite_run, "run_all", _no_run)
    held = demo.parent / "held"
    held.mkdir()
    (held / "verdict.json").write_text("the other's", encoding="utf-8")
    with written_alone(held):
        code, _, err = invoke(*command)
    assert (code, runtime.calls) == (2, [])
    assert err == (
        f"error: held: process {os.getpid()} is writing there; wait for its end, or name another folder\n"
    )
    assert (held / "verdict.json").read_text(encoding="utf-8") == "the other's"


def test_a_folder_is_used_again_and_an_old_verdict_is_not_taken_for_a_new_one(
    demo: Path, runtime: FakeRuntime, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ["run", str(demo), "--out", "here", "--save-model", "here"]
    assert invoke(*command)[0] == 0
    assert invoke(*command)[0] == 0
    assert sorted(each.name for each in Path("here").iterdir()) == ["junit.xml", "verdict.json"]
    full = RecordingError("here/junit.xml: cannot be written: No space left on device")
    monkeypatch.setattr("twin.scenario.verdict.write_junit", lambda *_: (_ for _ in ()).throw(full))
    assert invoke(*command) == (2, "", f"error: {full}\n")  # the run passed, and nobody can know
    assert not any(Path("here").iterdir())


@pytest.mark.parametrize(
    ("command", "option"),
    [
        (["schema", "-o", "PLACE"], "--output"),
        (["test", "demo.yaml", "--junit", "PLACE"], "--junit"),
        (["graph", "diff_bot", "-o", "PLACE.gv"], "--output"),
        (["tf", "frames", "-o", "PLACE.svg"], "--output"),
        (["node", "graph", "-o", "PLACE.svg"], "--output"),
        (["view", "diff_bot", "--save", "PLACE"], "--save"),
        (["map", "convert", "warehouse", "-o", "PLACE.yaml"], "--output"),
        (["map", "render", "warehouse", "-o", "PLACE.yaml"], "--output"),
        (["map", "save", "-f", "PLACE.yaml"], "--output"),
        (["map", "show", "warehouse", "-o", "PLACE.png"], "--output"),
    ],
)
@pytest.mark.parametrize("place", ["folder", "file/in"])
def test_where_nothing_can_be_written_is_told_before_any_work(
    demo: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch, command: list[str], option: str, place: str
) -> None:
    for work in (
        "twin.cli.run.batch.run_in_child",
        "twin.experiments.suite.run.run_all",
        "twin.models.loader.load",
        "twin.cli.ros.joining.Joining.open",
        "twin.scenario.schema.json_schema",
        "twin.navigation.maps.occupancy_map.OccupancyMap.load",
        "twin.warehouse.arena.load",
    ):
        monkeypatch.setattr(work, _no_run)
    words = [word.replace("PLACE", place) for word in command]
    Path("file").touch()
    Path(words[-1].replace("file/in", "other")).mkdir()
    code, out, err = invoke(*words)
    why = "it is a folder; name a file"
    if place == "file/in":
        why = f"{demo.parent / 'file'} is not a folder; name another place"
    assert (code, out, err) == (2, "", f"error: {option} {words[-1]}: cannot be written: {why}\n")


def test_wrong_options_say_what_is_valid() -> None:
    with pytest.raises(ScenarioError, match=r"--set seed: must be KEY=VALUE"):
        parse_overrides(["seed"], None)
    assert parse_overrides(["a.b=c=d", "seed=3"], 4) == {"a.b": "c=d", "seed": "4"}
    with pytest.raises(ScenarioError, match=r"--pace fast: must be max or a number greater than 0"):
        RunOptions(scenario=Path("a.yaml"), pace="fast")
    paces = [(None, False), (None, True), ("max", True), ("0.5", True)]
    options = [RunOptions(scenario=Path("a.yaml"), pace=pace, free=free) for pace, free in paces]
    assert [each.speed for each in options] == [None, 1.0, None, 0.5]


@pytest.mark.parametrize(
    "options",
    [
        RunOptions(scenario=Path("a.yaml")),
        RunOptions(
            scenario=Path("a.yaml"),
            set=["x=1", "y=a=b"],
            seed=3,
            params_file=Path(__file__),
            pace="0.5",
            listen=["tcp/1"],
            node=["n.py:make"],
            wait_for=["/cmd_vel", "/controller"],
            wait_timeout=2.5,
            free=True,
            connect=["tcp/2", "tcp/3"],
            wire="humble",
            zenoh_config=Path(__file__),
            domain=7,
            no_record=True,
            bag=True,
            include_hidden_topics=True,
            save_model=Path("model"),
        ),
    ],
    ids=["none", "all"],
)
def test_options_survive_the_way_to_a_child(
    options: RunOptions, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    understood: list[RunOptions] = []
    monkeypatch.setattr("twin.cli.run.once.run_once", lambda options: understood.append(options) or 0)
    code, _, err = invoke(*options.arguments(Path("out")))
    assert (code, err) == (0, "")
    assert understood == [replace(options, out=Path("out"), json=True)]


def test_another_parameter_file_for_the_robots_that_navigate(
    demo: Path, runtime: FakeRuntime, invoke: Invoke
) -> None:
    given = "localisation: {type: amcl, map: warehouse}, navigation: {params_file: own.yaml}"
    demo.write_text(SCENARIO.replace("model: diff_bot", f"model: warehouse_bot, {given}"), encoding="utf-8")
    for name in ("own.yaml", "other.yaml"):
        demo.with_name(name).write_text("{}\n", encoding="utf-8")
    assert invoke("run", str(demo))[0] == 0
    assert invoke("run", str(demo), "--params-file", "other.yaml")[0] == 0
    files = [call["scenario"].robots[0].navigation.params_file for call in runtime.calls]
    assert files == [str(demo.with_name("own.yaml")), str(demo.with_name("other.yaml"))]
    code, _, err = invoke("run", str(demo), "--params-file", "absent.yaml")
    assert (code, "absent.yaml" in err) == (2, True)
    demo.write_text(SCENARIO, encoding="utf-8")
    code, _, err = invoke("run", str(demo), "--params-file", "other.yaml")
    assert (code, "no robot of 'demo' has it" in err) == (2, True)


def child(digests: Iterator[str | None], passed: bool = True) -> Callable[[RunOptions, Path], dict[str, Any]]:
    def run(options: RunOptions, out: Path) -> dict[str, Any]:
        check = CheckResult(
            name="c", passed=passed, value=1.0, limit=1.0, unit="m", at_s=1.0, reason="too far"
        )
        made = Verdict(scenario=options.scenario.stem, seed=0, checks=(check,))
        return replace(made, digest=next(digests)).to_dict()

    return run


@pytest.mark.parametrize(
    ("digests", "flags", "code", "says"),
    [
        (["aa", "aa", "aa"], ["--expect-one-hash"], 0, "one digest: aa"),
        (["aa", "bb", "aa"], ["--expect-one-hash"], 1, "2 different digests"),
        (["aa", "bb", "aa"], [], 0, "2 different digests"),
        ([None, None, None], ["--expect-one-hash"], 1, "one digest: none"),
    ],
)
def test_repeat_compares_digests(
    demo: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch,
    digests: list[str | None], flags: list[str], code: int, says: str,
) -> None:  # fmt: skip
    monkeypatch.setattr(batch, "run_in_child", child(iter(digests)))
    got, out, _ = invoke("run", str(demo), "--repeat", "3", *flags)
    assert got == code
    assert says in out


def results(words: str) -> Callable[..., Iterator[dict[str, Any]]]:
    """Return a stand-in for `run_all` whose tests end in turn with p(ass), f(ail) and e(rror)."""

    def run_all(cases: Sequence[Case], folder: Path, **options: Any) -> Iterator[dict[str, Any]]:
        for case, word in zip(cases, words, strict=True):
            options["on_begin"](case)
            check = CheckResult(name="c", passed=word == "p", reason="" if word == "p" else "too far")
            checks, error = ((), "broken") if word == "e" else ((check,), None)
            verdict = Verdict(
                scenario="demo", seed=0, checks=checks, error=error, test=case.name, command=case.command
            ).to_dict()
            options["on_end"](case, verdict)
            yield verdict

    return run_all


def test_test_runs_all_and_writes_one_junit(
    demo: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    (demo.parent / "second.yaml").write_text(SCENARIO + "test: {seeds: 1..2}\n", encoding="utf-8")
    monkeypatch.setattr("twin.experiments.suite.run.run_all", results("pfe"))
    code, out, _ = invoke("test", ".", "--junit", "reports/all.xml", "--out", "here")
    assert code == 2
    lines = out.splitlines()
    assert [line.split()[:2] for line in lines[1:4]] == [
        ["PASS", "demo"],
        ["FAIL", "demo[seed=1]"],
        ["ERROR", "demo[seed=2]"],
    ]
    assert lines[4:] == [
        "demo[seed=1]: c: too far",
        "  run it again: twin run second.yaml --seed 1",
        "demo[seed=2]: broken",
        "  run it again: twin run second.yaml --seed 2",
        "1 of 3 passed",
        "written to here; `twin report here` makes a page of it",
    ]
    root = ElementTree.parse(demo.parent / "reports" / "all.xml").getroot()
    assert [suite.get("name") for suite in root] == ["demo", "demo[seed=1]", "demo[seed=2]"]


def test_tests_are_listed_and_chosen(demo: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch) -> None:
    demo.write_text(SCENARIO + "test: {seeds: 1..4, tags: [quick]}\n", encoding="utf-8")
    names = [f"demo[seed={seed}]\n" for seed in range(1, 5)]
    assert invoke("test", ".", "--list") == (0, "".join(names), "")
    assert invoke("test", ".", "--list", "--shard", "2/3")[1] == names[1]
    assert invoke("test", ".", "--list", "-k", "seed=4 or seed=2", "-m", "quick")[1] == names[1] + names[3]
    code, out, err = invoke("test", ".", "-m", "nightly")
    assert (code, out) == (2, "")
    assert err == "error: -m nightly: chooses none of 4 tests; tags: quick\n"
    monkeypatch.setattr("twin.experiments.suite.run.run_all", results("ppp"))
    assert invoke("test", ".", "-k", "not seed=3")[0] == 0
    demo.write_text(SCENARIO + "test: {seeds: 0-3}\n", encoding="utf-8")
    code, out, err = invoke("test", ".", "--list")
    assert (code, out) == (2, "demo\n")
    assert err.count("0:10 (without 10), not '0-3'") == err.count("not '0-3'") == 1


def test_what_ended_before_a_ctrl_c_is_in_the_junit(
    demo: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    demo.write_text(SCENARIO + "test: {seeds: 1..2}\n", encoding="utf-8")

    def run_all(cases: Sequence[Case], folder: Path, **options: Any) -> Iterator[dict[str, Any]]:
        yield from results("p")(cases[:1], folder, **options)
        raise KeyboardInterrupt

    monkeypatch.setattr("twin.experiments.suite.run.run_all", run_all)
    assert invoke("test", ".", "--junit", "all.xml")[0] == 130
    (suite,) = ElementTree.parse(demo.parent / "all.xml").getroot()
    assert suite.get("name") == "demo[seed=1]"


def test_test_names_a_wrong_path(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="no such file"):
        batch.scenario_files([tmp_path / "nope"])
    with pytest.raises(ScenarioError, match="no scenario"):
        batch.scenario_files([tmp_path])


def test_a_dead_child_is_an_error_not_a_crash(tmp_path: Path) -> None:
    done = twin("test", str(tmp_path / "bad.yaml"), cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, f"error: {tmp_path}/bad.yaml: no such file\n")
    (tmp_path / "bad.yaml").write_text("name: bad\n", encoding="utf-8")
    done = twin("test", str(tmp_path / "bad.yaml"), "--json", cwd=tmp_path)
    assert done.returncode == 2
    (verdict,) = json.loads(done.stdout)
    assert verdict["verdict"] == "error"
    assert "missing key 'robots'" in verdict["error"]


def test_a_child_that_crashes_says_its_last_line_and_keeps_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    crash = "import sys; sys.exit('Traceback\\n  many lines\\nTypeError: no')"
    monkeypatch.setattr(RunOptions, "arguments", lambda *_: [])
    monkeypatch.setattr("twin.cli.run.batch.COMMAND", (sys.executable, "-c", crash))
    verdict = run_in_child(RunOptions(scenario=Path("demo.yaml")), tmp_path / "new")
    assert verdict["verdict"] == "error"
    assert verdict["error"].startswith("the run's process ended with code 1: TypeError: no (all of it: ")
    assert "many lines" in (tmp_path / "new" / "stderr.txt").read_text(encoding="utf-8")


def test_play_finds_the_recording(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="it holds none"):
        find_recording(tmp_path)
    (tmp_path / "a.rrd").touch()
    assert find_recording(tmp_path) == tmp_path / "a.rrd"
    with pytest.raises(RecordingError, match=r"not a Rerun recording; valid: \*\.rrd"):
        find_recording(Path(__file__))
    with pytest.raises(RecordingError, match="no such recording"):
        find_recording(tmp_path / "b.rrd")


def test_schema_and_robots(demo: Path, invoke: Invoke) -> None:
    assert invoke("schema", "-o", "s.json")[0] == 0
    assert json.loads((demo.parent / "s.json").read_text(encoding="utf-8"))["title"] == "Scenario"
    code, out, _ = invoke("robots")
    assert code == 0
    assert {"diff_bot", "warehouse_bot", "r2d2", "sp1s"} <= set(out.split())
    assert {str(path) for path in catalogue().values()} <= set(out.split())  # whole, to be copied


@pytest.mark.parametrize(
    "command", [["run", "SCENARIO"], ["run", "SCENARIO", "--repeat", "2"], ["test", "SCENARIO"]]
)
def test_a_file_cannot_be_the_folder_of_the_results(tmp_path: Path, command: list[str]) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine", encoding="utf-8")
    scenario = str(Path(__file__).parents[2] / "scenarios" / "diff_bot_figure8.yaml")
    words = [scenario if word == "SCENARIO" else word for word in command]
    done = subprocess.run(
        [sys.executable, "-m", "twin.cli", *words, "--out", str(taken)], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr == f"error: {taken}: cannot be the folder of the results: File exists\n"
    assert taken.read_text(encoding="utf-8") == "mine"
