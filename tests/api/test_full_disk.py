"""A disk that is full under a run: what cannot be written is told, and the run goes on to its verdict."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import twin
from twin.bridge.bags.reader import BagReader
from twin.errors import RecordingError
from twin.recording.read_back import read
from twin.scenario.verdict import Verdict

_LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (260_000, 260_000))
from twin.cli.__main__ import main
main()
"""
"""`twin`, which can write no file beyond that size: Python takes no heed of the signal, so writing fails."""


def test_a_run_goes_on_to_its_verdict(circle: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-c", _LIMITED, "run", str(circle), "--bag", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    recording, bag = out / "circle.rrd", out / "bag" / "bag_0.mcap"
    why = " (the run goes on; what there is of it can be read)"
    assert sorted(done.stderr.splitlines()) == [
        f"[WARN] [run]: {bag}: cannot be written: File too large{why}",
        f"[WARN] [run]: {recording}: the recording could not be written to its end; is the disk full?{why}",
    ]
    assert done.returncode == 0
    assert " ok  driven_distance" in done.stdout
    assert json.loads((out / "verdict.json").read_text("utf-8"))["digest"] == twin.run(circle).digest
    left = read(recording).entities
    assert "/tf" in left
    assert "/verdict" not in left
    assert not (out / "bag" / "metadata.yaml").exists()
    with BagReader(out / "bag") as part:
        assert max(message.log_ns for message in part.messages()) < 3_000_000_000


def test_a_verdict_that_cannot_be_written_is_an_error_after_the_run(
    circle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(verdict: Verdict, folder: Path) -> None:
        raise RecordingError(f"{folder}: cannot be written: No space left on device")

    monkeypatch.setattr(Verdict, "write", full)
    with pytest.raises(RecordingError, match="cannot be written: No space left on device"):
        twin.run(circle, out=tmp_path)
