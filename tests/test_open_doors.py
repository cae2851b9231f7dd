"""What docs/architecture.md says of adding a sensor, a check or a mission is run as it stands there."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pages import write_files
from twin import runtime
from twin.scenario import schema

PAGE = Path(__file__).parents[1] / "docs" / "architecture.md"


@pytest.mark.parametrize("heading", ["Add a sensor", "Add a check", "Add a mission"])
def test_the_page_s_own_text_runs_and_passes(heading: str, tmp_path: Path) -> None:
    scenarios = write_files(PAGE, heading, tmp_path)
    assert scenarios
    for file in scenarios:
        verdict = runtime.run(schema.load(file, execute=True), record=False)
        assert verdict.verdict == "pass", verdict.to_json()
        assert verdict.plugins
