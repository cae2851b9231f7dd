"""Verdict files: complete, strict JSON, valid JUnit, never half-written."""

from __future__ import annotations

import json
import re
from dataclasses import replace
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
    told = {"name": "twin", "tests": "4", "failures": "1", "errors": "1", "time": "1.000"}
    assert dict(root.attrib) == told
    first, second = root.findall("testsuite")
    assert [case.get("name") for case in first.findall("testcase")] == ["run", "energy", "closed_loop"]
    failure = first.find("testcase/failure")
    assert failure is not None
    assert failure.get("message") == "bot <ends> [31mfar & away"
    error = second.find("testcase/error")
    assert error is not None
    assert (error.get("message"), error.text) == ("no such arena", "no such arena\nat all")
    assert {p.get("name") for p in first.findall("properties/property")} <= {"seed", "digest", "cpu"}


def test_junit_names_the_test_its_run_and_how_to_make_it_again(tmp_path: Path) -> None:
    made = replace(verdict(BAD), test="demo[seed=3,speed=0.5]", command="twin run demo.yaml --seed 3")
    write_junit(tmp_path / "junit.xml", [made])
    (suite,) = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert suite.get("name") == "demo[seed=3,speed=0.5]"
    cases = suite.findall("testcase")
    # Jenkins takes what stands before the last dot of a class for its package
    assert {case.get("classname") for case in cases} == {"demo"}
    assert [case.get("name") for case in cases] == [
        "run[seed=3,speed=0.5]",
        "closed_loop[seed=3,speed=0.5]",
    ]
    out = cases[0].findtext("system-out") or ""
    assert "FAIL  closed_loop" in out
    assert out.endswith("run it again: twin run demo.yaml --seed 3")
    assert sum(float(case.get("time", "0")) for case in cases) == float(suite.get("time", "0"))


JENKINS = {
    "testsuites": ({"testsuite"}, set(), {"name", "time", "tests", "failures", "errors"}),
    "testsuite": (
        {"properties", "testcase", "system-out"},
        {"name", "tests", "failures", "errors"},
        {"time"},
    ),
    "properties": ({"property"}, set(), set()),
    "property": (set(), {"name", "value"}, set()),
    "testcase": ({"error", "failure", "system-out"}, {"name"}, {"time", "classname"}),
    "error": (set(), set(), {"message", "type"}),
    "failure": (set(), set(), {"message", "type"}),
    "system-out": (set(), set(), set()),
}
"""What its junit-10.xsd allows, of what we write: children, attributes that must be there, and others."""


def test_junit_is_as_the_schema_of_jenkins_has_it(tmp_path: Path) -> None:
    write_junit(tmp_path / "all.xml", [verdict(GOOD, BAD), verdict(error="no"), verdict()])
    for element in ElementTree.parse(tmp_path / "all.xml").getroot().iter():
        children, required, optional = JENKINS[element.tag]
        assert {child.tag for child in element} <= children
        assert required <= set(element.attrib) <= required | optional
        if "time" in element.attrib:
            assert re.fullmatch(r"\d+(\.\d{1,3})?", element.attrib["time"])


def test_provenance_names_what_decides_the_bytes() -> None:
    found = versions()
    assert {"python", "twin", "mujoco", "numpy", "eclipse-zenoh"} <= set(found)
    assert all(found.values())
    assert cpu_class().count(",") >= 1
