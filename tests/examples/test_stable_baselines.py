"""The adapter for stable-baselines3, where that is installed."""

import runpy
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "examples" / "learning" / "stable_baselines.py"


def test_it_learns(monkeypatch, capsys):
    pytest.importorskip("stable_baselines3", reason="pulls gigabytes, so it is no dependency")
    monkeypatch.setattr(sys, "argv", [PROGRAM.name, "8000"])
    runpy.run_path(str(PROGRAM), run_name="__main__")
    printed = capsys.readouterr().out
    assert "ep_rew_mean" in printed
    assert "goal reached in" in printed
