"""Compiled functions run what is written: an edit of any file that they use is seen."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

FILES = {
    "__init__.py": "",
    "limits.py": "LOW = 1\n",
    "costs.py": "LETHAL = 254\n",
    "inner.py": """
from twin.navigation._jit import jit
from . import limits

@jit
def cost(x):
    return [x + limits.LOW for _ in range(1)][0]
""",
    "middle.py": """
from twin.navigation._jit import jit
from .inner import cost

@jit
def doubled(x):
    return 2 * cost(x)
""",
    "outer.py": """
from twin.navigation._jit import jit
from .costs import LETHAL
from .middle import doubled

@jit
def total(x):
    return doubled(x) + LETHAL
""",
}


@pytest.fixture
def kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "kernels_of_a_test"
    folder.mkdir()
    for name, text in FILES.items():
        (folder / name).write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    # Sources of one size and second would be taken for the same by Python itself.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield folder
    forget()


def forget() -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "kernels_of_a_test"]:
        del sys.modules[name]


def imported() -> ModuleType:
    """Return the module as a new process would import it."""
    forget()
    importlib.invalidate_caches()
    return importlib.import_module("kernels_of_a_test.outer")


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def test_what_did_not_change_is_loaded_and_not_compiled(kernels: Path) -> None:
    assert imported().total(1) == 258
    again = imported().total
    assert again(1) == 258
    assert sum(again.dispatcher.stats.cache_hits.values()) == 1
    assert not again.dispatcher.stats.cache_misses


@pytest.mark.parametrize(
    ("file", "old", "new", "total"),
    [
        pytest.param("inner.py", "x + limits", "x - limits", 254, id="a kernel called by a called one"),
        pytest.param("middle.py", "2 * cost", "3 * cost", 260, id="a kernel called"),
        pytest.param("outer.py", "+ LETHAL", "- LETHAL", -250, id="the kernel itself"),
        pytest.param("costs.py", "254", "253", 257, id="a constant of another file"),
        pytest.param("limits.py", "1", "5", 266, id="a constant of a module that a called kernel names"),
    ],
)
def test_an_edit_is_seen_though_the_old_machine_code_lies_on_disk(
    kernels: Path, file: str, old: str, new: str, total: int
) -> None:
    assert imported().total(1) == 258
    edit(kernels / file, old, new)
    assert imported().total(1) == total
    edit(kernels / file, new, old)
    assert imported().total(1) == 258


def test_what_is_compiled_with_other_options_is_compiled_anew(kernels: Path) -> None:
    imported().total(1)
    edit(kernels / "inner.py", "import jit", "import fast_jit as jit")
    other = imported().total
    assert other(1) == 258
    assert not other.dispatcher.stats.cache_hits
