"""What holds for the whole repository: layers, light imports, no machine paths, few readers of the clock."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
SOURCES = sorted(
    path for home in ("twin", "benchmarks/twin_benchmarks") for path in (ROOT / home).rglob("*.py")
)

HEAVY = (
    "mujoco",
    "zenoh",
    "rerun",
    "numpy",
    "scipy",
    "numba",
    "pydantic",
    "rosbags",
    "xacro",
)

WALL_CLOCK = {
    "benchmarks/twin_benchmarks/amcl/tracking.py": {"process_time"},  # what the filter and the run cost
    "twin/runtime/pacing.py": {"perf_counter", "sleep"},  # how a paced run waits
    "twin/runtime/open_run.py": {"perf_counter", "process_time"},  # how long the run took
    "twin/experiments/processes.py": {"monotonic"},  # the time limit of a job
    "twin/experiments/sweep/folder.py": {"monotonic", "time"},  # locks that other machines have left
    "twin/experiments/sweep/making.py": {"sleep"},  # waits for what others make
    "twin/experiments/sweep/sweep.py": {"monotonic"},  # how often is looked and told
    "twin/experiments/sweep/ray_cluster.py": {"monotonic"},  # the time limit of a run
    "twin/runtime/workers/process.py": {"monotonic", "sleep"},  # waits for the end of a process
    "twin/runtime/workers/robots_here.py": {"process_time"},  # what a worker took
    "twin/live/plant.py": {"time_ns"},  # a physical robot's clock starts at the time of day
    "twin/live/guard/node.py": {"monotonic_ns"},  # time-outs of a robot's commands
    "twin/live/teleop/node.py": {"monotonic_ns"},  # the dead man's time-out
    "twin/live/guard/client.py": {"monotonic_ns"},  # stamps that no setting of the clock moves
    "twin/live/futures/future.py": {"process_time"},  # what a future cost
    "twin/live/futures/futures.py": {"monotonic"},  # the time limit of a future
    "twin/live/futures/served.py": {"monotonic"},  # how often futures are looked at
    "twin/live/futures/inputs.py": {"process_time"},  # what the run has cost
    "twin/live/futures/snapshot.py": {"process_time"},  # what restoring cost
    "twin/live/mirror/exchanges.py": {"perf_counter_ns"},  # when to ask a robot for its time
    "twin/live/mirror/live_source.py": {"monotonic", "perf_counter_ns", "sleep", "time_ns"},  # our own clock
    "twin/bridge/services/__init__.py": {"perf_counter_ns"},  # when a question left, and its answer came
    "twin/recording/sink.py": {"monotonic_ns"},  # how much of its end a killed run may lose
    "twin/recording/player.py": {"monotonic", "sleep"},  # waits for the viewer, another program
    "twin/bridge/live.py": {"time_ns", "monotonic"},  # processes beside a run live by the wall clock
    "twin/bridge/graph.py": {"monotonic", "sleep"},  # waits for other processes to say who they are
    "twin/bridge/wire/session.py": {"monotonic", "sleep"},  # who is asked for may start later
    "twin/bridge/lockstep/stepper.py": {"monotonic"},  # time-outs of other processes
    "twin/bridge/lockstep/topic.py": {"monotonic", "sleep"},  # time-outs of other processes
    "twin/bridge/bags/recorder.py": {"time_ns", "monotonic"},  # when a message was received
    "twin/bridge/bags/asked_definitions.py": {"monotonic"},  # time-outs of other processes
    "twin/bridge/bags/player.py": {"monotonic_ns"},  # when a message is due
    "benchmarks/twin_benchmarks/grid.py": {"perf_counter"},  # time per plan is what is measured
    "benchmarks/twin_benchmarks/grid_maps.py": {"perf_counter"},  # the same
    "benchmarks/twin_benchmarks/slam/trial.py": {"perf_counter"},  # times faster than the robot drove
    "twin/experiments/pytest_plugin.py": {"now"},  # the name of a folder of runs
    "twin/experiments/report/page.py": {"now"},  # when the page was written
    "twin/web/rosbridge/bridge.py": {
        "monotonic",
        "time_ns",
    },  # time-outs of clients; when a command was given
    "twin/web/rosbridge/door.py": {"monotonic"},
    "twin/web/rosbridge/http/tiles.py": {"time_ns"},  # versions are others in another process
    "twin/web/rosbridge/server.py": {"monotonic"},  # rates and time limits of clients
    "twin/cli/ros/watch.py": {"monotonic"},  # how long is watched
    "twin/cli/run/folders.py": {"now"},  # the name of a run's folder
}
"""Where the wall clock may be read, and by which function."""

CLOCKS = {
    "time": {
        "time",
        "time_ns",
        "sleep",
        "perf_counter",
        "perf_counter_ns",
        "monotonic",
        "monotonic_ns",
        "process_time",
    },
    "datetime": {"now", "utcnow", "today"},
}


def tracked() -> list[Path]:
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [path for name in done.stdout.split("\0") if name and (path := ROOT / name).is_file()]


def texts() -> Iterator[tuple[str, str]]:
    """Yield path and text of every tracked text file but this one."""
    for path in tracked():
        if path == Path(__file__) or path.suffix in (".npz", ".pcd", ".pgm", ".png", ".jpg"):
            continue
        yield path.relative_to(ROOT).as_posix(), path.read_text("utf-8")


MACHINE_PATH = re.compile(r"(?<![\w.>})/-])/(home|root|work|tmp|opt|Users|mnt|workspace)/\w")
ADDRESS = re.compile(
    r"(--index-url|--extra-index-url|--find-links|/simple\b(?!\.py)|pypi\.|git\+)", re.IGNORECASE
)


def test_no_file_knows_the_machine_it_was_written_on() -> None:
    found = [f"{name}: {match[0]}" for name, text in texts() for match in MACHINE_PATH.finditer(text)]
    assert found == []


def test_no_file_names_a_package_registry() -> None:
    found = [f"{name}: {match[0]}" for name, text in texts() for match in ADDRESS.finditer(text)]
    assert [item for item in found if not item.startswith("tests/")] == []


def test_layers_hold() -> None:
    done = subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("statement", ["import twin", "import twin.cli; twin.cli.main()"])
def test_a_light_start(statement: str) -> None:
    code = (
        "import sys; sys.argv = ['twin', '--help']\n"
        f"try: {statement}\n"
        "except SystemExit: pass\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def clocks_read(tree: ast.AST) -> set[str]:
    """Return the functions of `time` and `datetime` that a module calls, whatever they are imported as."""
    names: dict[str, str] = {}
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.asname or alias.name: alias.name for alias in node.names if alias.name in CLOCKS}
        if isinstance(node, ast.ImportFrom) and node.module in CLOCKS:
            found |= {alias.name for alias in node.names if alias.name in CLOCKS[node.module]}
            names |= {alias.asname or alias.name: node.module for alias in node.names}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            owner = node.value
            while isinstance(owner, ast.Attribute):
                owner = owner.value
            module = names.get(owner.id) if isinstance(owner, ast.Name) else None
            if module is not None and node.attr in CLOCKS[module]:
                found.add(node.attr)
    return found


def test_the_wall_clock_is_read_in_few_places() -> None:
    found = {}
    for path in SOURCES:
        clocks = clocks_read(ast.parse(path.read_text("utf-8")))
        if clocks:
            found[path.relative_to(ROOT).as_posix()] = clocks
    assert found == WALL_CLOCK


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("import time\ntime.sleep(1)", {"sleep"}),
        ("import time as t\nt.time()", {"time"}),
        ("from time import monotonic as m", {"monotonic"}),
        ("from datetime import datetime\ndatetime.now()", {"now"}),
        ("import datetime\ndatetime.datetime.now()", {"now"}),
        ("world.time()\nnode.now_ns", set()),
    ],
)
def test_the_search_for_clocks_finds_them(code: str, expected: set[str]) -> None:
    assert clocks_read(ast.parse(code)) == expected


def test_only_the_command_line_prints() -> None:
    prints = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in SOURCES
        if not path.is_relative_to(ROOT / "twin" / "cli")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
    ]
    assert prints == []


def test_no_global_random_state() -> None:
    """Numbers come from seeded generators: no `random`, none of numpy's functions with hidden state."""
    allowed = {"Philox", "Generator", "SeedSequence", "BitGenerator"}
    found = []
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            where = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.Import) and any(alias.name == "random" for alias in node.names):
                found.append(where)
            if isinstance(node, ast.Attribute) and ast.unparse(node).startswith(
                ("np.random.", "numpy.random.")
            ):
                found += [] if node.attr in allowed else [where]
    assert found == []


def subject(tests: Path) -> Path:
    """Return the folder that a folder of tests is about."""
    first, *rest = tests.relative_to(ROOT / "tests").parts or ("",)
    if first == "benchmarks" and rest != ["measures"]:  # which are in no package
        return ROOT.joinpath("benchmarks", "twin_benchmarks", *rest)
    return ROOT.joinpath("" if first in ("benchmarks", "examples") else "twin", first, *rest)


def test_tests_mirror_the_package() -> None:
    folders = {path.parent for path in (ROOT / "tests").rglob("test_*.py")}
    assert [folder.as_posix() for folder in sorted(folders) if not subject(folder).is_dir()] == []


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    return {canonicalize_name(name): version for name, _, version in (line.partition("==") for line in lines)}


def test_constraints_are_pins_and_nothing_else() -> None:
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    assert [line for line in lines if not re.fullmatch(r"[\w.\-]+==[\w.!+\-]+", line)] == []
    assert lines == sorted(lines, key=lambda line: line.partition("==")[0].lower())


def needed() -> Iterator[str]:
    """Yield everything that `pip install .[dev] ./benchmarks` installs, as far as it is installed here."""
    own = {"twin": frozenset({"", "dev"}), "twin-benchmarks": frozenset({""})}
    todo = list(own.items())
    seen: set[tuple[str, frozenset[str]]] = set()
    while todo:
        name, extras = todo.pop()
        if (name, extras) in seen:
            continue
        seen.add((name, extras))
        try:
            requirements = metadata.requires(name) or ()
        except metadata.PackageNotFoundError:
            continue
        if name not in own:
            yield name
        for text in requirements:
            requirement = Requirement(text)
            marker = requirement.marker
            if marker is None or any(marker.evaluate({"extra": extra}) for extra in extras):
                todo.append((canonicalize_name(requirement.name), frozenset({"", *requirement.extras})))


def test_constraints_pin_every_package_of_the_project() -> None:
    assert sorted(set(needed()) - set(pins())) == []
    assert {"mujoco", "numpy", "eclipse-zenoh", "rerun-sdk", "pytest"} <= set(pins())


def test_data_files_of_the_package_ship_in_the_wheel() -> None:
    """Every kind of file in the package is named in pyproject's package-data."""
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    kinds = {path.suffix for path in tracked() if path.is_relative_to(ROOT / "twin")} - {".py"}
    assert [kind for kind in sorted(kinds) if f"*{kind}" not in text and f"py{kind}" not in text] == []
