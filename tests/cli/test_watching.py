"""`twin run --view`: real time unless told, the verdict's exit code, one run at a time."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from twin.cli.run.options import RunOptions
from twin.recording import live_screen


def test_who_watches_is_shown_real_time_unless_told_otherwise() -> None:
    def speed(**options: object) -> float | None:
        return RunOptions(scenario=Path("demo"), **options).speed  # type: ignore[arg-type]

    assert (speed(view=True), speed()) == (1.0, None)
    assert (speed(view=True, pace="max"), speed(view=True, pace="2")) == (None, 2.0)


def test_the_exit_code_is_the_verdict_s_once_the_user_has_closed_the_window(
    invoke: Invoke, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, closed, results = tmp_path / "window", tmp_path / "closed", tmp_path / "out"
    waits = f"while ! test -f {results}/verdict.json; do sleep 0.1; done; sleep 4; touch {closed}"
    window.write_text(f"#!/bin/sh\n{waits}\n", encoding="utf-8")
    window.chmod(0o755)
    monkeypatch.setattr(live_screen, "viewer_binary", lambda: str(window))
    monkeypatch.setattr(live_screen, "has_display", lambda: True)
    words = ("--set", "duration=1s", "--pace", "max", "--view", "--out", results)
    status, out, err = invoke("run", "diff_bot_figure8", *words)
    assert (status, err) == (1, "close the viewer's window to end\n")
    assert "FAIL" in out
    assert closed.exists()


def test_many_runs_are_not_watched(invoke: Invoke) -> None:
    status, _, err = invoke("run", "diff_bot_figure8", "--view", "--repeat", "2")
    assert status == 2
    assert "--view shows one run" in err
