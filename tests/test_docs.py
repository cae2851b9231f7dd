"""The documentation is true: what it shows runs, what it names exists, what it lists is complete."""

from __future__ import annotations

import importlib
import io
import os
import re
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch
from xml.etree import ElementTree

import pytest
import typer
import yaml
from PIL import Image
from typer.main import get_command

from tests.processes import free_endpoint, wait_for_listener
from twin.cli import app as app_module
from twin.models import load
from twin.models.catalogue import catalogue
from twin.runtime.defaults.from_description import footprint
from twin.scenario.checks import CheckEntry, CheckResult
from twin.scenario.schema import json_schema
from twin.scenario.verdict import Verdict

ROOT = Path(__file__).parents[1]
PAGES = {
    page.relative_to(ROOT).as_posix(): page for page in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))
}
ALL_TEXT = "\n".join(page.read_text("utf-8") for page in PAGES.values())

SLOW = {
    "README.md",
    "docs/getting-started.md",
    "docs/navigation.md",
    "docs/arenas.md",
    "docs/ros/commands.md",
    "docs/ros/clouds.md",
    "docs/watch.md",
}
"""Pages whose commands take longer than some seconds."""

NOT_RUN = {
    r"make (?P<target>\w+)": "sets up an environment of its own: only its recipe is looked at",
    r"pip install twin-\*\.whl": "tests/test_wheel.py does that",
    r"cd my_robot && (twin test .*|python -m pytest)": "tests/test_wheel.py does that, with the wheel",
    r"twin test scenarios -j 2 --out runs/all": "tests/runtime/test_shipped_scenarios.py does that",
    r"twin report runs/all": "tests/runtime/test_shipped_scenarios.py does that",
    r"twin run scenarios/warehouse\.yaml --set robots\.0\.args\.palm_camera=\S+ .*": (
        "takes most of a minute: tests/runtime/test_tote_cameras.py does that"
    ),
    r"twin run scenarios/warehouse_(lidar_lost|kidnapped|slam)\.yaml .*": "so do all that ship, there",
    r"source \.venv/bin/activate": "the tests run in an environment already",
    r"twin play .* --screenshot .*": "needs a Vulkan driver: tests/recording/test_player.py does that",
    r"twin play (--web )?\S+": "needs a display, or a browser: only its options are looked at",
    r"twin topic (pub -r|hz|bw|throttle) [^-]*( -s)?": "goes on until Ctrl-C; tests/cli/ros does that",
    r"python examples/learning/learn_goal\.py .*": "takes minutes: tests/examples learns less",
    r"twin bench slam .*": "needs logs that are not shipped: tests/benchmarks/slam has its own",
    r"twin fork .*|twin run warehouse --pace 1 --listen .*": "need each other: tests/live/futures has both",
    r"twin view \S+ --(web|watch)": "serves until it is stopped: only its options are looked at",
    r"twin run \S+ --view": "waits for its user: tests/cli/test_watching.py does that",
    r"twin watch( --web .*| --topics .*)?": "opens a viewer: tests/cli/ros/test_watch.py saves instead",
    r"twin map info \.\./shared/.*": "needs ../shared/data: tests/cli/map has them",
    r"twin bench .*": "needs ../shared/data: tests/benchmarks has small ones",
    r"twin foxglove.*": "serves until it is stopped: tests/web/foxglove does that",
    r"twin teleop.*": "needs a terminal: tests/cli/live/test_teleop.py has one",
    r"twin bag (record|play) .*": "needs a graph beside it: tests/cli/ros/bag/test_bag_commands.py has one",
}
"""Commands that are shown but not run here, and why."""

BESIDE = r"twin (guard( -|$)|mirror \w+ --autonomy)"
"""Runs beside the commands that follow, and listens nowhere itself."""

PORT = "7447"
"""Of the pages; replaced by a free one."""


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    name: str
    """Of the file that the reader is to save; empty for none."""
    text: str


def blocks(page: str) -> list[Block]:
    found = re.findall(
        r"^```(\w*) ?(\S*)\n(.*?)^```", PAGES[page].read_text("utf-8"), re.DOTALL | re.MULTILINE
    )
    return [Block(*groups) for groups in found]


def commands(block: Block) -> Iterator[tuple[str, list[str]]]:
    """Yield each command of a console block with the lines that it is said to print."""
    for chunk in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
        command, *output = chunk.splitlines()
        yield command, [line for line in output if line.strip()]


def exemption(command: str) -> re.Match[str] | None:
    return next((match for pattern in NOT_RUN if (match := re.fullmatch(pattern, command))), None)


class Reader:
    """Follows a page in an empty folder: saves its files, types its commands."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("scenarios", "examples"):
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        self.endpoint = free_endpoint()
        self.port = self.endpoint.rpartition(":")[2]
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        here = {"PATH": path, "COLUMNS": "200", "TWIN_CONNECT": self.endpoint}
        self.environment = {**os.environ, **here}
        self.background: list[tuple[subprocess.Popen[str], list[str]]] = []

    def save(self, block: Block) -> None:
        (self.folder / block.name).write_text(block.text.replace(PORT, self.port), encoding="utf-8")

    def type(self, command: str, output: list[str]) -> None:
        if "--listen" in command or re.match(BESIDE, command):
            self.background.append((self._start(command), output))
            wait_for_listener(self.endpoint)
        else:
            self._judge(command, self._start(command), output)

    def finish(self) -> None:
        for process, output in self.background:
            if re.search(rf"examples/|twin plant|{BESIDE}", str(process.args)):  # runs until it is stopped
                process.send_signal(signal.SIGINT)
            self._judge("--listen", process, output)

    def _start(self, command: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            ["bash", "-c", command.replace(PORT, self.port)],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def _judge(self, command: str, process: subprocess.Popen[str], output: list[str]) -> None:
        printed, _ = process.communicate(timeout=600)
        assert process.returncode == 0, f"{command}\n{printed}"
        rest = " ".join(printed.split())
        for line in output:
            _, found, rest = rest.partition(" ".join(line.split()))
            assert found, (
                f"{command}\nshould print {line!r}, and after the lines before it; it prints\n{printed}"
            )


@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=[pytest.mark.slow] if page in SLOW else []) for page in sorted(PAGES)]
)
def test_commands_and_snippets_run(page: str, tmp_path: Path) -> None:
    reader = Reader(tmp_path)
    for block in blocks(page):
        if block.name:
            reader.save(block)
        elif block.language == "yaml":
            assert yaml.safe_load(block.text)
        elif block.language == "toml":
            assert tomllib.loads(block.text)
        elif block.language == "xml":
            ElementTree.fromstring(block.text)
        elif block.language == "python":
            (tmp_path / "snippet.py").write_text(block.text, encoding="utf-8")
            reader.type("python snippet.py", [])
        elif block.language == "console":
            for command, output in commands(block):
                if exemption(command) is None:
                    reader.type(command, output)
    reader.finish()


def test_no_command_hides_in_another_kind_of_block() -> None:
    kinds = {block.language for page in PAGES for block in blocks(page)}
    assert kinds <= {"console", "python", "yaml", "toml", "xml", ""}
    hidden = [
        b.text for page in PAGES for b in blocks(page) if not b.language and re.search(r"^\$ ", b.text, re.M)
    ]
    assert hidden == []


@pytest.mark.parametrize("page", sorted(PAGES))
def test_commands_that_are_not_run_could_be(page: str) -> None:
    for block in blocks(page):
        for command, _ in commands(block) if block.language == "console" else ():
            match = exemption(command)
            if match is None:
                continue
            if "target" in match.groupdict():
                done = subprocess.run(
                    ["make", "-n", match["target"]], cwd=ROOT, capture_output=True, check=False
                )
                assert done.returncode == 0, command
            elif command.startswith("twin"):
                words = command.split()[1:]
                shown = help_of(next(name for name in COMMANDS if words[: len(name.split())] == name.split()))
                assert all(word in shown for word in command.split() if word.startswith("--"))


def help_of(command: str) -> str:
    with patch.dict(os.environ, {"COLUMNS": "200"}), redirect_stdout(io.StringIO()) as shown:
        COMMAND_LINE.main([*command.split(), "--help"], standalone_mode=False)
    return shown.getvalue()


def all_commands(group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the commands of a group and of the groups in it: 'run', 'topic list'."""
    context = typer.Context(group)
    for name in group.list_commands(context):
        _, command, _ = group.resolve_command(context, [name])
        if hasattr(command, "commands"):
            yield from all_commands(command, f"{prefix}{name} ")
        else:
            yield f"{prefix}{name}", command


COMMAND_LINE = get_command(app_module.app)
COMMANDS: dict[str, Any] = dict(all_commands(COMMAND_LINE))


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_has_an_example_and_is_documented_with_all_options(command: str) -> None:
    assert f"Example: twin {command}" in help_of(command)
    assert f"twin {command}" in ALL_TEXT
    shown = [parameter for parameter in COMMANDS[command].params if not getattr(parameter, "hidden", False)]
    options = [option for parameter in shown for option in parameter.opts]
    missing = [option for option in options if option.startswith("--") and option not in ALL_TEXT]
    assert missing == []


def test_tables_are_up_to_date() -> None:
    command = [sys.executable, str(ROOT / "docs" / "reference.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_scenario_key_is_documented() -> None:
    text = PAGES["docs/scenarios.md"].read_text("utf-8")
    schema = json_schema()
    keys = {key for part in (schema, *schema["$defs"].values()) for key in part.get("properties", ())}
    assert len(keys) > 80
    assert [key for key in sorted(keys) if f"| `{key}` |" not in text] == []


def test_every_scenario_that_ships_is_listed() -> None:
    text = PAGES["docs/scenarios.md"].read_text("utf-8")
    files = [file.relative_to(ROOT).as_posix() for file in (ROOT / "scenarios").rglob("*.yaml")]
    assert [file for file in sorted(files) if f"(../{file})" not in text] == []


def test_every_check_says_what_it_means() -> None:
    meanings = PAGES["docs/scenarios.md"].read_text("utf-8").partition("## Checks")[2].partition("\n## ")[0]
    assert [check for check in CheckEntry.model_fields if f"\n| `{check}` |" not in meanings] == []


def test_every_key_of_the_verdict_is_documented() -> None:
    text = PAGES["docs/scenarios.md"].read_text("utf-8").partition("## Verdict")[2].partition("\n## ")[0]
    keys = [*Verdict(scenario="x", seed=0).to_dict(), *(field.name for field in fields(CheckResult))]
    assert [key for key in keys if f"`{key}`" not in text] == []


def slug(heading: str) -> str:
    """Return the anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


@pytest.mark.parametrize("page", sorted(PAGES))
def test_links_lead_somewhere(page: str) -> None:
    path = PAGES[page]
    text = re.sub(r"^```.*?^```", "", path.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith("https://"):
            continue
        file, _, anchor = target.partition("#")
        goal = (path.parent / file).resolve() if file else path
        if not goal.exists() or not goal.is_relative_to(ROOT):
            broken.append(target)
        elif anchor:
            headings = re.findall(r"^#+ (.*)$", goal.read_text("utf-8"), re.MULTILINE)
            broken += [] if anchor in map(slug, headings) else [target]
    assert broken == []


def test_every_page_can_be_reached_from_the_readme() -> None:
    readme = PAGES["README.md"].read_text("utf-8")
    assert [page for page in PAGES if page != "README.md" and f"({page})" not in readme] == []


def named_code(text: str) -> list[tuple[str, str]]:
    """Return (file, dotted name or empty) for everything like `twin/sim/world.py:World.compose`."""
    return re.findall(r"`(twin/[\w/]+\.py)(?::([\w.]+))?`", text)


@pytest.mark.parametrize("page", sorted(PAGES))
def test_files_and_functions_that_are_named_exist(page: str) -> None:
    for file, name in named_code(PAGES[page].read_text("utf-8")):
        assert (ROOT / file).is_file(), file
        found: Any = importlib.import_module(file.removesuffix(".py").replace("/", ".")) if name else None
        for part in name.split(".") if name else ():
            assert hasattr(found, part), f"{file}:{name}"
            found = getattr(found, part)


def test_the_map_of_the_code_is_complete() -> None:
    text = PAGES["docs/architecture.md"].read_text("utf-8")
    packages = [item for item in (ROOT / "twin").iterdir() if not item.name.startswith("__")]
    names = [f"twin/{p.name}/" if p.is_dir() else f"twin/{p.name}" for p in packages if p.name != "py.typed"]
    assert [name for name in sorted(names) if name not in text] == []
    assert len(named_code(text)) > 30


def test_robots_are_as_the_table_says() -> None:
    rows = re.findall(
        r"^\| `(\w+)` \| ([\d.]+) \| (.*?) \| (.*?) \| (.*?) \|$", page_of_robots(), re.MULTILINE
    )
    assert sorted(row[0] for row in rows) == list(catalogue())
    for name, mass, extent, drive, sensors in rows:
        robot = load(name)
        total = sum(link.inertial.mass for link in robot.links.values() if link.inertial is not None)
        assert total == pytest.approx(float(mass), abs=1e-6), name
        if extent != "–":
            corners = footprint(robot, padding=0.0)
            size = corners.max(axis=0) - corners.min(axis=0)
            assert [f"{side:.2f}" for side in size] == extent.split(" × "), name
        kind = (
            "none"
            if robot.drive is None
            else {"diff_drive": "differential", "skid_steer": "skid steer"}[robot.drive.kind]
        )
        assert drive.startswith(kind), name
        assert sorted(sensor.name for sensor in robot.sensors) == sorted(
            set(sensors.split(", ")) - {"none"}
        ), name


def page_of_robots() -> str:
    return PAGES["docs/robots.md"].read_text("utf-8")


@pytest.mark.parametrize("robot", list(catalogue()))
def test_every_robot_has_a_section_with_a_small_picture(robot: str) -> None:
    assert f"\n## {robot}\n" in page_of_robots()
    picture = ROOT / "docs" / "robots" / f"{robot}.png"
    assert f"(robots/{robot}.png)" in page_of_robots()
    assert picture.stat().st_size <= 60_000


def test_every_scenario_that_ships_has_a_small_picture() -> None:
    page = PAGES["docs/gallery.md"].read_text("utf-8")
    for scenario in (ROOT / "scenarios").rglob("*.yaml"):
        picture = f"gallery/{scenario.stem}.jpg"
        assert f"\n## {scenario.stem}\n" in page
        assert f"]({picture})" in page
        assert (ROOT / "docs" / picture).stat().st_size <= 60_000


def test_the_picture_of_the_run_is_small() -> None:
    picture = ROOT / "docs" / "warehouse.png"
    assert picture.stat().st_size < 200_000
    with Image.open(picture) as image:
        assert image.width <= 1200
