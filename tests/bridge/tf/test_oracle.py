"""The buffer beside the real tf2: look-ups that it gave once (tests/oracles/tf2_goldens.json), and now."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from twin.bridge.tf import (
    DisconnectedFramesError,
    ExtrapolationError,
    InvalidFrameError,
    TransformBuffer,
    TransformError,
    UnknownFrameError,
)

ORACLES = Path(__file__).parents[2] / "oracles"
SYSTEM_PYTHON = Path("/usr/bin/python3")
GOLDENS = json.loads((ORACLES / "tf2_goldens.json").read_text("utf-8"))["cases"]

# get_latest_common_time of tf2_py raises the base class where no path is found.
CLASSES = {
    "LookupException": (UnknownFrameError,),
    "ConnectivityException": (DisconnectedFramesError,),
    "ExtrapolationException": (ExtrapolationError,),
    "InvalidArgumentException": (InvalidFrameError,),
    "TransformException": (UnknownFrameError, DisconnectedFramesError),
}


def do(buffer: TransformBuffer, kind: str, *rest: Any) -> Any:
    """Take a step as tests/oracles/tf2_goldens.py describes it."""
    if kind == "set":
        parent, child, stamp, (x, y, z, i, j, k, w), static = rest
        try:
            buffer.set_rigid(parent, child, stamp, (x, y, z, w, i, j, k), static=static)
        except ValueError:
            return None
        return None
    if kind in ("lookup", "full"):
        find = buffer.lookup_stamped if kind == "lookup" else buffer.lookup_full
        (x, y, z, w, i, j, k), stamp = find(*rest)
        return [x, y, z, i, j, k, w, stamp]
    if kind == "common":
        return buffer.latest_common_ns(*rest) or 0
    call = {"can": buffer.can_transform, "can_full": buffer.can_transform_full, "clear": buffer.clear}[kind]
    return call(*rest)


def compare(case: dict[str, Any]) -> int:
    """Take a case's steps; return how many look-ups there were."""
    buffer, lookups = TransformBuffer(), 0
    for number, (step, gave) in enumerate(zip(case["steps"], case["gave"], strict=True)):
        where = f"{case['name']}, step {number}: {step}"
        lookups += step[0] in ("lookup", "full")
        if isinstance(gave, str):
            with pytest.raises(TransformError) as caught:
                pytest.fail(f"{where} gave {do(buffer, *step)}, tf2 {gave}")
            assert type(caught.value) in CLASSES[gave], f"{where}: {caught.value!r}, tf2 {gave}"
            continue
        try:
            got = do(buffer, *step)
        except TransformError as error:
            pytest.fail(f"{where}: {error!r}, tf2 {gave}")
        if isinstance(gave, list):
            assert got[:7] == pytest.approx(gave[:7], rel=0, abs=1e-9), where
            assert got[7] == gave[7], where
        else:
            assert got == gave, where
    return lookups


@pytest.mark.parametrize("case", GOLDENS, ids=lambda case: case["name"])
def test_the_buffer_answers_as_tf2_did(case: dict[str, Any]) -> None:
    compare(case)


def test_there_are_enough_of_every_kind() -> None:
    gave = [
        given
        for case in GOLDENS
        for step, given in zip(case["steps"], case["gave"], strict=True)
        if step[0] in ("lookup", "full")
    ]
    assert len(gave) >= 300
    assert set(CLASSES) - {"TransformException"} == {given for given in gave if isinstance(given, str)}


@pytest.mark.parametrize("seed", [20261121, 5])
def test_the_buffer_answers_as_tf2_does_now(seed: int) -> None:
    probe = [SYSTEM_PYTHON, "-c", "import tf2_py, rospy, geometry_msgs.msg"]
    if not SYSTEM_PYTHON.exists() or subprocess.run(probe, capture_output=True, check=False).returncode:
        pytest.skip(f"{SYSTEM_PYTHON} has no tf2_py (Debian: python3-tf2-ros)")
    script = [SYSTEM_PYTHON, ORACLES / "tf2_goldens.py", "--seed", str(seed), "-o", "-"]
    done = subprocess.run(script, capture_output=True, text=True, check=True)
    assert sum(compare(case) for case in json.loads(done.stdout)["cases"]) >= 300
