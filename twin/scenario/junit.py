"""Verdicts as JUnit XML: a suite per run, in it the run itself and each check as a test case.

A check that fails is a failure. A run that could not be made or finished is an error, of the case `run`.
Elements and attributes are those of Jenkins' schema (xunit-plugin, junit-10.xsd), which GitLab reads, too.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

from twin.scenario.verdict_text import lines_of

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PROPERTIES = ("seed", "digest", "cpu", "command")


def junit_xml(verdicts: Sequence[Mapping[str, Any]]) -> bytes:
    """Return a JUnit document of verdicts as `Verdict.to_dict` gives them."""
    suites = [_suite(verdict) for verdict in verdicts]
    root = ElementTree.Element("testsuites", name="twin")
    for key in ("tests", "failures", "errors"):
        root.set(key, str(sum(int(suite.get(key, "0")) for suite in suites)))
    root.set("time", f"{sum(float(suite.get('time', '0')) for suite in suites):.3f}")
    root.extend(suites)
    ElementTree.indent(root)
    return b'<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, encoding="utf-8") + b"\n"


def _suite(verdict: Mapping[str, Any]) -> ElementTree.Element:
    scenario, name = _text(str(verdict["scenario"])), _text(str(verdict.get("test") or verdict["scenario"]))
    which = name.removeprefix(scenario)  # such as [seed=3]; a dot in it would begin a package in Jenkins
    time = f"{verdict['metrics'].get('wall_time_s', 0.0):.3f}"
    cases = [
        _run(verdict, ElementTree.Element("testcase", classname=scenario, name=f"run{which}", time=time))
    ]
    for check in verdict["checks"]:
        case = ElementTree.Element(
            "testcase", classname=scenario, name=f"{_text(check['name'])}{which}", time="0"
        )
        cases.append(_check(check, case))
    suite = ElementTree.Element(
        "testsuite",
        name=name,
        tests=str(len(cases)),
        failures=str(sum(case.find("failure") is not None for case in cases)),
        errors=str(sum(case.find("error") is not None for case in cases)),
        time=time,
    )
    properties = ElementTree.SubElement(suite, "properties")
    for key in _PROPERTIES:
        if verdict.get(key) not in (None, ""):
            ElementTree.SubElement(properties, "property", name=key, value=_text(str(verdict[key])))
    for fault in verdict.get("faults", ()):
        told = _text(": ".join(filter(None, (fault["outcome"], fault["effect"]))))
        ElementTree.SubElement(properties, "property", name=_text(f"fault.{fault['name']}"), value=told)
    suite.extend(cases)
    return suite


def _run(verdict: Mapping[str, Any], case: ElementTree.Element) -> ElementTree.Element:
    """Fill the case of the run itself: its error, and what is to be read of it."""
    error = verdict["error"]
    if error is not None:
        ElementTree.SubElement(case, "error", message=_text(error.partition("\n")[0])).text = _text(error)
    lines = [] if error is not None else list(lines_of(verdict))
    if verdict.get("command"):
        lines.append(f"run it again: {verdict['command']}")
    if lines:
        ElementTree.SubElement(case, "system-out").text = _text("\n".join(lines))
    return case


def _check(check: Mapping[str, Any], case: ElementTree.Element) -> ElementTree.Element:
    if not check["passed"]:
        failure = ElementTree.SubElement(case, "failure", message=_text(check["reason"]))
        failure.text = _text(f"value {check['value']} limit {check['limit']} {check['unit']}".rstrip())
    return case


def _text(text: str) -> str:
    """Drop what XML cannot hold, such as the escape codes of a terminal."""
    return _NOT_XML.sub("", text)
