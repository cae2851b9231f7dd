"""The notebooks run from their first cell to their last, and hold no output."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples" / "notebooks").glob("*.ipynb"))


def cells(notebook: Path) -> list[dict[str, Any]]:
    found = json.loads(notebook.read_text(encoding="utf-8"))
    assert found["nbformat"] == 4
    return [cell for cell in found["cells"] if cell["cell_type"] == "code"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_runs(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    shown: list[Any] = []
    names: dict[str, Any] = {"shown": shown.append}
    with mpl.rc_context({"backend": "agg"}):
        for number, cell in enumerate(cells(notebook), 1):
            code = ast.parse("".join(cell["source"]))
            if isinstance(code.body[-1], ast.Expr):  # what Jupyter shows
                name = ast.Name("shown", ast.Load())
                code.body[-1].value = ast.Call(name, [code.body[-1].value], [])
            exec(compile(ast.fix_missing_locations(code), f"{notebook.name}, cell {number}", "exec"), names)
    assert shown
    assert all(len(each) > 0 for each in shown if hasattr(each, "__len__"))
    if notebook.stem == "numbers_of_a_run":
        driven, *_, drift, runs = (each for each in shown if each.__class__.__name__ == "DataFrame")
        assert len(driven) == 3
        assert 0.0 < drift["drift_mm"][0] < 20.0
        assert runs["seed"].to_list() == [1, 2, 3]
        assert runs["driven_distance.value"].is_between(1.0, 1.7).all()


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_is_small(notebook: Path) -> None:
    assert notebook.stat().st_size < 20_000
    assert not any(cell["outputs"] for cell in cells(notebook))
