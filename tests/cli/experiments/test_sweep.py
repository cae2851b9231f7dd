"""`twin sweep` as it is typed."""

from __future__ import annotations

import json
import re
import shlex
import sys
from pathlib import Path

import polars as pl
import pytest

from tests.cli.conftest import Invoke
from tests.experiments.sweep.conftest import LIMIT, SCENARIO, SPEED


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "moment.yaml").write_text(SCENARIO, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_sweep_is_made_told_and_taken_up_again(invoke: Invoke, folder: Path) -> None:
    words = ["sweep", "moment.yaml", "--seeds", "0:2", "--set", f"{LIMIT}=1 mm,1 m", "-j", 2]
    code, out, err = invoke(*words)
    assert (code, err) == (1, "")
    lines = out.splitlines()
    assert lines[1].split()[:2] == ["tolerance", "passed"]
    first = " ".join(lines[2].split())
    assert re.fullmatch(r"FAIL 1 mm 0 of 2 0.0 to 84.2 % [\d.]+ mm final_pose 2", first)
    assert " ".join(lines[3].split()).startswith("PASS 1 m 2 of 2 15.8 to 100.0 %")
    assert "2 of 4 runs passed" in out
    again = next(line.removeprefix("fails: ") for line in lines if line.startswith("fails: "))
    results = Path(lines[-1].removeprefix("written to "))
    assert results.parts[:2] == ("runs", "moment")
    assert "<svg" in (results / "report.html").read_text()

    code, out, err = invoke(*words, "--seeds", "0:3", "--json", "--no-page")
    summary = json.loads(out)
    assert (code, summary["made"], summary["runs"], summary["outcome"]) == (1, 2, 6, "fail")
    assert summary == {**json.loads((results / "summary.json").read_text()), "made": 2}

    code, out, err = invoke(*shlex.split(again)[1:], "--no-record", "--json")
    rows = pl.read_parquet(results / "results.parquet").filter(pl.col("verdict") == "fail")
    assert json.loads(out)["digest"] == rows["digest"][0]


def test_a_pass_rate_that_is_not_settled_has_its_own_exit_code(invoke: Invoke, folder: Path) -> None:
    code, out, _ = invoke("sweep", "moment.yaml", "--seeds", "0:2", "--pass-rate", "0.9", "--no-page")
    assert code == 3
    assert "INCONCLUSIVE" in out
    assert "asked for: at least 0.9, with confidence 0.95" in out


def test_a_share_says_what_is_missing(invoke: Invoke, folder: Path) -> None:
    code, out, err = invoke("sweep", "moment.yaml", "--seeds", "0:3", "--shard", "2/3", "-j", "1")
    assert (code, out) == (0, "")
    assert err.startswith("1 runs made; 1 of 3 runs are there")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--set", "mission.stesp.0.linear=1,2"], "unknown key 'stesp' in mission; did you mean 'steps'?"),
        (["--set", f"{SPEED}=fast"], "linear: must be a number"),
        (["--shard", "5/4"], "--shard 5/4: must be I/N"),
        (["--out", "."], ".: holds something else than a sweep; name a new folder"),
        (["--seeds", "4:1"], "no seed"),
        (["--pass-rate", "95"], "must be between 0 and 1"),
    ],
)
def test_mistakes_are_one_sentence_before_anything_runs(
    invoke: Invoke, folder: Path, words: list[str], said: str
) -> None:
    code, out, err = invoke("sweep", "moment.yaml", *words)
    assert (code, out) == (2, "")
    assert said in err
    assert len(err.splitlines()) == 1
    assert not (folder / "runs").exists()


def test_without_ray_it_says_what_to_install(
    invoke: Invoke, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    code, _, err = invoke("sweep", "moment.yaml", "--ray", "auto")
    assert code == 2
    assert "pip install 'twin[ray]'" in err
    assert not (folder / "runs").exists()
