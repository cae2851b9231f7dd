"""`twin bench amcl`, as short as it can be."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from twin.cli.app import app


@pytest.mark.slow
def test_it_tracks_finds_itself_and_notices_a_kidnapping() -> None:
    arguments = ["bench", "amcl", "--distance", "5", "--starts", "1", "--kidnaps", "1", "--json"]
    result = CliRunner().invoke(app, arguments)
    report = json.loads(result.stdout)
    assert 0.001 < report["tracking"]["rms_m"] < 0.03
    assert report["tracking"]["rms_deg"] < 0.5
    assert report["tracking"]["distance_m"] >= 5.0
    assert report["global_localisation"]["right"] == report["global_localisation"]["trials"] == 1
    assert report["kidnapped"]["right"] == report["kidnapped"]["trials"] == 1
    assert (result.exit_code == 0) == report["passed"]
