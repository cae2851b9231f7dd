"""Commands of other distributions: listed without being loaded, called, and told of where they cannot be."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke

HELLO = """
import typer

app = typer.Typer()

@app.command()
def world(name: str, loud: bool = False) -> None:
    print(f"hello {name}" + "!" * loud)

@app.callback()
def _root() -> None: pass
"""


class Site:
    """A folder of installed distributions."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def install(self, name: str, command: str, value: str, **modules: str) -> None:
        info = self.folder / f"{name}-1.0.dist-info"
        info.mkdir()
        info.joinpath("METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\nSummary: Greets.\n"
        )
        info.joinpath("entry_points.txt").write_text(f"[twin.commands]\n{command} = {value}\n")
        for module, text in modules.items():
            self.folder.joinpath(f"{module}.py").write_text(text, encoding="utf-8")


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    return Site(folder)


def test_a_command_of_another_distribution(site: Site, invoke: Invoke) -> None:
    site.install("greetings", "hello", "greetings_a:app", greetings_a=HELLO)
    assert invoke("hello", "world", "Ada", "--loud") == (0, "hello Ada!\n", "")
    code, out, _ = invoke("hello", "--help")
    assert code == 0
    assert "twin hello" in out
    assert "--install-completion" not in out
    assert invoke("hello", "word")[0] == 2


def test_lists_name_it_and_load_nothing(site: Site, invoke: Invoke) -> None:
    site.install("greetings", "hello", "greetings_b:app", greetings_b="raise SystemExit(5)")
    code, out, _ = invoke("--help")
    assert code == 0
    assert "hello" in out
    assert "Greets." in out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("other = 1", "AttributeError: module 'greetings_c' has no attribute 'app'"),
        ("app = 1", "greetings_c:app of greetings is no typer.Typer"),
    ],
)
def test_one_that_cannot_be_loaded_is_named(
    site: Site, invoke: Invoke, text: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    site.install("greetings", "hello", "greetings_c:app", greetings_c=text)
    monkeypatch.delitem(__import__("sys").modules, "greetings_c", raising=False)
    code, out, err = invoke("hello", "world")
    assert (code, out) == (2, "")
    assert "greetings_c:app of greetings" in err
    assert said in err


def test_two_of_one_name_are_both_named(site: Site, invoke: Invoke) -> None:
    site.install("greetings", "hello", "greetings_d:app", greetings_d=HELLO)
    site.install("salutations", "hello", "greetings_e:app", greetings_e=HELLO)
    code, _, err = invoke("hello", "world", "Ada")
    assert code == 2
    assert "greetings_d:app of greetings, greetings_e:app of salutations" in err


def test_a_command_of_twin_goes_first(site: Site, invoke: Invoke) -> None:
    site.install("greetings", "robots", "greetings_f:app", greetings_f="raise SystemExit(5)")
    code, out, _ = invoke("robots")
    assert code == 0
    assert "warehouse_bot" in out


def test_bench_says_where_it_is(monkeypatch: pytest.MonkeyPatch, invoke: Invoke) -> None:
    monkeypatch.setattr(metadata, "entry_points", lambda **_: metadata.EntryPoints())
    code, out, err = invoke("bench", "amcl")
    assert (code, out) == (2, "")
    assert err == (
        "error: twin bench comes with the distribution twin-benchmarks, which is not installed; "
        "in twin's repository: pip install ./benchmarks\n"
    )
