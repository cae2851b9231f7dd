"""Verdict files: complete, strict JSON, valid JUnit, never half-written."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from twin.scenario.checks import CheckResult
from twin.scenario.provenance import cpu_class, versions
from twin.scenario.verdict import Verdict, write_junit


def check(name: str, passed: bool, value: float | None = 1.0, reason: str = "") -> CheckResult:
    return CheckResult(name=name, passed=passed, value=value, limit=2.0, unit="m", at_s=3.0, reason=reason)


def verdict(*checks: CheckResult, error: str | None = None) -> Verdict:
    return Verdict(
        scenario="demo",
        seed=7,
        checks=checks,
        metrics={"sim_time_s": 10.0, "wall_time_s": 0.5},
        digest="ab" * 32,
        versions=versions(),
        cpu=cpu_class(),
        error=error,
    )


GOOD, BAD = check("energy", True), check("closed_loop", False, float("inf"), "bot <ends> \x1b[31mfar & away")


@pytest.mark.parametrize(
    ("made", "word", "code"),
    [
        (verdict(GOOD), "pass", 0),
        (verdict(GOOD, BAD), "fail", 1),
        (verdict(), "fail", 1),
        (verdict(GOOD, error="no such arena"), "error", 2),
    ],
)
def test_word_and_exit_code(made: Verdict, word: str, code: int) -> None:
    assert (made.verdict, made.exit_code) == (word, code)


def test_json_has_the_documented_keys_and_no_infinities(tmp_path: Path) -> None:
    verdict(GOOD, BAD).write(tmp_path / "new" / "folder")
    text = (tmp_path / "new" / "folder" / "verdict.json").read_text(encoding="utf-8")
    data = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
    wanted = {"scenario", "seed", "verdict", "checks", "metrics", "digest", "versions", "cpu"}
    assert wanted <= set(data)
    assert data["checks"][0] == {
        "name": "energy", "passed": True, "value": 1.0, "limit": 2.0, "unit": "m", "at_s": 3.0, "reason": "",
        "margin": None, "worst_s": None,
    }  # fmt: skip
    assert data["checks"][1]["value"] is None


def test_junit_separates_failures_from_errors(tmp_path: Path) -> None:
    write_junit(tmp_path / "all.xml", [verdict(GOOD, BAD), verdict(error="no such arena\nat all")])
    root = ElementTree.parse(tmp_path / "all.xml").getroot()
    assert dict(root.attrib) == {"tests": "3", "failures": "1", "errors": "1", "time": "1.000"}
    first, second = root.findall("testsuite")
    assert [case.get("name") for case in first.findall("testcase")] == ["energy", "closed_loop"]
    failure = first.find("testcase/failure")
    assert failure is not None
    assert failure.get("message") == "bot <ends> [31mfar & away"
    error = second.find("testcase/error")
    assert error is not None
    assert (error.get("message"), error.text) == ("no such arena", "no such arena\nat all")
    assert {p.get("name") for p in first.findall("properties/property")} == {"seed", "digest", "cpu"}


def test_provenance_names_what_decides_the_bytes() -> None:
    found = versions()
    assert {"python", "twin", "mujoco", "numpy", "eclipse-zenoh"} <= set(found)
    assert all(found.values())
    assert cpu_class().count(",") >= 1
