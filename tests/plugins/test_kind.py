"""Plugins are found by reading, and run when they are asked for; what is wrong is one sentence."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from twin.errors import PluginError
from twin.plugins import Kind, execution, require_finite
from twin.scenario.checks import Check

BASE = "twin.scenario.checks:Check"
GOOD = """
from twin.scenario.checks import Check

class Calm(Check):
    def observe(self, observation):
        return 1 / observation

    def result(self):
        return "calm"
"""
RAN = """
with open(__file__ + ".ran", "a") as file:
    file.write("x")
"""
NOT_RUN = "raise SystemExit('this file was run')\n"


@pytest.fixture
def checks() -> Kind[Check]:
    return Kind("check", base=BASE, group="twin.tests_of_kind")


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield a folder from which modules are imported, and forget them afterwards."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


def write(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file


def distribute(folder: Path, package: str, points: str, group: str = "twin.tests_of_kind") -> None:
    """Write what pip writes of an installed package."""
    info = folder / f"{package}-1.5.dist-info"
    write(info, "METADATA", f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.5\n")
    write(info, "entry_points.txt", f"[{group}]\n{points}\n")


def test_a_file_beside_the_one_that_names_it_is_found_and_run_only_when_it_is_created(
    checks: Kind[Check], tmp_path: Path
) -> None:
    file = write(tmp_path, "mine/calm.py", GOOD + RAN)
    plugin = checks.find("mine/calm.py:Calm", tmp_path)
    assert (plugin.name, plugin.place.file, plugin.place.line) == ("calm.py:Calm", file, 4)
    assert not Path(f"{file}.ran").exists()

    told: list[str] = []
    with execution(told.append) as executed:
        assert plugin.create("a", None, None).result() == "calm"
        assert checks.find("calm.py:Calm", tmp_path / "mine").create("b", None, None).name == "b"
    assert told == [str(file)]
    assert list(executed.versions) == ["calm.py:Calm"]
    assert executed.versions["calm.py:Calm"].startswith("sha256:")
    assert Path(f"{file}.ran").read_text() == "x"  # once for both
    with execution():
        checks.find("mine/calm.py:Calm", tmp_path).load()
    assert Path(f"{file}.ran").read_text() == "xx"  # another run starts afresh


def test_an_edited_file_is_run_again(checks: Kind[Check], tmp_path: Path) -> None:
    write(tmp_path, "calm.py", GOOD)
    old = checks.find("calm.py:Calm", tmp_path).load()
    write(tmp_path, "calm.py", GOOD.replace("calm", "serene"))
    assert checks.find("calm.py:Calm", tmp_path).create("a", None, None).result() == "serene"
    assert checks.find("calm.py:Calm", tmp_path).load() is not old


def test_a_module_in_a_package_is_found_without_importing_the_package(
    checks: Kind[Check], path: Path
) -> None:
    write(path, "their_pack/__init__.py", NOT_RUN)
    file = write(path, "their_pack/inner/calm.py", GOOD)
    assert checks.find("their_pack.inner.calm:Calm").place.file == file
    assert "their_pack" not in sys.modules


def test_entry_points_are_names_with_a_version(checks: Kind[Check], path: Path) -> None:
    write(path, "their_calm.py", GOOD)
    distribute(path, "their", "calm = their_calm:Calm")
    assert "calm" in checks.names()
    assert "their_calm" not in sys.modules
    with execution() as executed:
        assert checks.find("calm").create("x", None, None).result() == "calm"
    assert executed.versions == {"calm": "their 1.5"}


def test_two_packages_with_one_name_are_named(checks: Kind[Check], path: Path) -> None:
    write(path, "their_calm.py", GOOD)
    distribute(path, "their", "calm = their_calm:Calm")
    distribute(path, "other", "calm = other_calm:Calm")
    with pytest.raises(
        PluginError,
        match=r"two .* called 'calm': .*'other_calm:Calm' of other 1.5 and 'their_calm:Calm' of their",
    ):
        checks.find("calm")
    checks.register("rough", "their_calm:Calm")  # others are not harmed
    assert checks.find("rough").create("x", None, None).result() == "calm"
    with pytest.raises(PluginError, match="two plugins are called 'rough'"):
        checks.register("rough", "their_calm:Other")


def test_a_class_of_a_running_program_can_be_registered(checks: Kind[Check]) -> None:
    class Mine(Check):
        def observe(self, observation: object) -> None:
            raise ValueError("not today")

        def result(self) -> object:  # type: ignore[override]
            return 1

    checks.register("mine", Mine)
    plugin = checks.find("mine")
    assert not plugin.ships
    with (
        pytest.raises(PluginError, match=rf"{__file__}:\d+: check 'mine' fails: ValueError: not today"),
        plugin.guard,
    ):
        plugin.create("m", None, None).observe(None)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("calm", "there is no check 'calm'"),
        ("nowhere.py:Calm", "nowhere.py: check 'nowhere.py:Calm': there is no such file"),
        ("calm.py:Clam", r"calm.py: check 'calm.py:Clam': there is no 'Clam' in it; did you mean 'Calm'"),
        ("broken.py:Calm", r"broken.py:2: check 'broken.py:Calm': SyntaxError"),
        ("no_such_pack.checks:Calm", "no module 'no_such_pack.checks'; install its package"),
        ("json.no_such:Calm", "no module 'json.no_such'"),
        ("json.decoder:Calm", r"decoder.py: check 'json.decoder:Calm': there is no 'Calm'"),
        (":Calm", "valid is a name, module:Class or FILE.py:Class"),
        ("calm.py:1", "valid is a name"),
    ],
)
def test_what_cannot_be_found_is_one_sentence(
    checks: Kind[Check], tmp_path: Path, text: str, message: str
) -> None:
    write(tmp_path, "calm.py", GOOD + NOT_RUN)
    write(tmp_path, "broken.py", "import json\nclass Calm(:\n")
    with pytest.raises(PluginError, match=message) as raised:
        checks.find(text, tmp_path)
    assert "\n" not in str(raised.value)


HEAD = "from twin.scenario.checks import Check\n"


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (
            "Calm = 3",
            r"calm.py:2: check 'calm.py:Calm' is no class; derive one from twin.scenario.checks.Check",
        ),
        ("class Calm: pass", r"calm.py:2: check 'calm.py:Calm' is no Check; derive it from"),
        (
            "class Calm(Check):\n    def result(self): ...",
            r"calm.py:2: check 'calm.py:Calm' lacks observe\(observation\)$",
        ),
        ("class Calm(Check): pass", r"lacks observe\(observation\), result\(\)$"),
        (
            "class Calm(Check):\n    def result(self): ...\n    def observe(self): ...",
            r"calm.py:4: check 'calm.py:Calm' has observe\(self\), which must take what observe\(obs",
        ),
        (
            "class Calm(Check):\n    def result(self): ...\n    observe = 3",
            r"has a 'observe' that is no method; it must be observe\(observation\)",
        ),
        (
            "import no_such_module\nCalm = 1",
            r"calm.py:2: .* fails: ModuleNotFoundError: No module named 'no_such",
        ),
        (
            "def f():\n    return 1 / 0\nclass Calm(Check):\n    x = f()",
            r"calm.py:3: .* fails: ZeroDivisionError",
        ),
        (
            "class Calm(Check):\n    def __init__(self, *_):\n        [].pop()\n"
            "    def result(self): ...\n    def observe(self, o): ...",
            r"calm.py:4: check 'calm.py:Calm' fails: IndexError: pop from empty list",
        ),
    ],
)
def test_a_class_that_does_not_fit_is_one_sentence_with_its_line(
    checks: Kind[Check], tmp_path: Path, code: str, message: str
) -> None:
    write(tmp_path, "calm.py", HEAD + code)
    plugin = checks.find("calm.py:Calm", tmp_path)
    with pytest.raises(PluginError, match=message):
        plugin.create("a", None, None)


def test_a_call_that_raises_names_the_line_of_the_plugin(checks: Kind[Check], tmp_path: Path) -> None:
    write(tmp_path, "calm.py", GOOD)
    plugin = checks.find("calm.py:Calm", tmp_path)
    check = plugin.create("a", None, None)
    with (
        pytest.raises(PluginError, match=r"calm.py:6: check 'calm.py:Calm' fails: ZeroDivisionError"),
        plugin.guard,
    ):
        check.observe(0)  # type: ignore[arg-type]
    with pytest.raises(PluginError, match=r"calm.py:4: .* returns a speed of \(1, nan\); it must be finite"):
        require_finite(plugin, "a speed", [1.0, float("nan")])


def test_what_ships_is_neither_guarded_nor_kept(checks: Kind[Check]) -> None:
    checks.register("ours", "twin.scenario.checks.no_collision:NoCollision")
    plugin = checks.find("ours")
    with execution() as executed:
        plugin.load()
    assert executed.versions == {}
    with pytest.raises(ZeroDivisionError), plugin.guard:
        raise ZeroDivisionError
