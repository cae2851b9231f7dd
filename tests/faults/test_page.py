"""Every fault that docs/faults.md shows lands as it stands there, and every kind is shown."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from tests.faults.conftest import ROUND, Drive
from twin.bridge.msgs import Imu, LaserScan, Odometry
from twin.scenario.faults import FAULTS
from twin.scenario.schema import json_schema

PAGE = (Path(__file__).parents[2] / "docs" / "faults.md").read_text("utf-8")
SHOWN = [
    fault
    for block in re.findall(r"^```yaml\n(faults:.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    for fault in yaml.safe_load(block)["faults"]
]
LISTEN = ((Imu, "/imu"), (LaserScan, "/scan"), (Odometry, "/odom"))


def test_every_kind_that_ships_is_shown() -> None:
    assert sorted({kind for fault in SHOWN for kind in fault}) == sorted(FAULTS.shipped)


def test_editors_take_what_is_shown_and_refuse_other_numbers() -> None:
    editor = jsonschema.Draft202012Validator(json_schema())
    scenario = yaml.safe_load(ROUND)
    assert [error.message for error in editor.iter_errors({**scenario, "faults": SHOWN})] == []
    for wrong in ({"noise": 0.5}, {"mass": "1.1 m"}, {"loss": "2 m"}, {"latency": "80 kg"}):
        assert list(editor.iter_errors({**scenario, "faults": [wrong]})), wrong


@pytest.mark.parametrize(
    "fault", [fault for fault in SHOWN if "dropped_good" not in fault], ids=lambda f: next(iter(f))
)
def test_what_the_page_shows_lands(drive: Drive, fault: dict[str, Any]) -> None:
    (kind,) = fault
    text = ROUND.replace("linear: 0.3", "linear: 1")
    if kind == "displacement":
        text = text.replace("world: {", "world: {arena: warehouse, ")
    report = drive(json.dumps([fault]), text, LISTEN).reports[kind]
    assert report.outcome == "landed", report
    assert report.effect
