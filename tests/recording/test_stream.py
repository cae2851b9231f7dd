"""Files of recordings: a full disk is told and never waited for; nothing grows with a run but the file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from twin.recording.read_back import read
from twin.recording.stream import end_recording, open_recording

_FULL = """
import pathlib, resource, sys
import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from twin.errors import RecordingError
from twin.recording.stream import end_recording, flush, open_recording

path = pathlib.Path(sys.argv[1])
recording = open_recording(path, "twin", "run", rrb.Blueprint())
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
for action in (flush,) * 4 + (end_recording,):
    recording.log("/x", rr.Tensor(np.random.rand(3000)))
    try:
        action(recording, path)
    except RecordingError as fault:
        print(fault)
"""


def test_a_full_disk_is_told_and_not_waited_for(tmp_path: Path) -> None:
    """Rerun's writer ends with its first failure, and its words are coloured in a pipe, too."""
    path = tmp_path / "a.rrd"
    done = subprocess.run(
        [sys.executable, "-c", _FULL, str(path)], capture_output=True, text=True, check=False, timeout=120
    )
    said = done.stdout.splitlines()
    assert set(said) == {f"{path}: the recording could not be written to its end; is the disk full?"}
    assert len(said) >= 2  # a flush after the failure, and the end
    assert (done.returncode, done.stderr) == (0, "")


_FULL_BEFORE = """
import pathlib, resource, sys
import rerun.blueprint as rrb
from twin.errors import RecordingError
from twin.recording.stream import open_recording

resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))
try:
    open_recording(pathlib.Path(sys.argv[1]), "twin", "run", rrb.Blueprint(rrb.Spatial3DView()))
except RecordingError as fault:
    print(fault)
"""


def test_a_disk_that_is_full_before_the_run_is_told_and_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    done = subprocess.run(
        [sys.executable, "-c", _FULL_BEFORE, str(path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.stdout == f"{path}: the recording could not be written to its end; is the disk full?\n"
    assert (done.returncode, done.stderr) == (0, "")


def test_no_index_grows_with_the_run(tmp_path: Path) -> None:
    """Rerun would keep that of a footer in memory: 60 MB in ten minutes of a warehouse."""
    recording = open_recording(tmp_path / "a.rrd", "twin", "run", rrb.Blueprint())
    recording.log("/x", rr.TextLog("here"))
    end_recording(recording, tmp_path / "a.rrd")
    assert b"RRF2FOOT" not in (tmp_path / "a.rrd").read_bytes()
    assert read(tmp_path / "a.rrd").column("/x", "TextLog:text").values == [["here"]]
