"""Verdicts as JUnit XML: a suite per run, a case per check; failed check = failure, failed run = error."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(verdicts: Sequence[Mapping[str, Any]]) -> bytes:
    """Return a JUnit document of verdicts as `Verdict.to_dict` gives them."""
    suites = [_suite(verdict) for verdict in verdicts]
    root = ElementTree.Element("testsuites")
    for key in ("tests", "failures", "errors"):
        root.set(key, str(sum(int(suite.get(key, "0")) for suite in suites)))
    root.set("time", f"{sum(float(suite.get('time', '0')) for suite in suites):.3f}")
    root.extend(suites)
    ElementTree.indent(root)
    return b'<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, encoding="utf-8") + b"\n"


def _suite(verdict: Mapping[str, Any]) -> ElementTree.Element:
    name, error = str(verdict["scenario"]), verdict["error"]
    cases = [_case(name, check) for check in verdict["checks"]]
    if error is not None:
        case = ElementTree.Element("testcase", classname=_text(name), name="run")
        ElementTree.SubElement(case, "error", message=_text(error.partition("\n")[0])).text = _text(error)
        cases.insert(0, case)
    suite = ElementTree.Element(
        "testsuite",
        name=_text(name),
        tests=str(len(cases)),
        failures=str(sum(case.find("failure") is not None for case in cases)),
        errors=str(sum(case.find("error") is not None for case in cases)),
        time=f"{verdict['metrics'].get('wall_time_s', 0.0):.3f}",
    )
    properties = ElementTree.SubElement(suite, "properties")
    for key in ("seed", "digest", "cpu"):
        ElementTree.SubElement(properties, "property", name=key, value=_text(str(verdict[key])))
    suite.extend(cases)
    return suite


def _case(suite: str, check: Mapping[str, Any]) -> ElementTree.Element:
    case = ElementTree.Element("testcase", classname=_text(suite), name=_text(check["name"]))
    known = {key: check[key] for key in ("margin", "unit", "worst_s") if check.get(key) not in (None, "")}
    if "margin" in known:
        properties = ElementTree.SubElement(case, "properties")
        for key, value in known.items():
            ElementTree.SubElement(properties, "property", name=key, value=_text(str(value)))
    if not check["passed"]:
        failure = ElementTree.SubElement(case, "failure", message=_text(check["reason"]))
        failure.text = _text(f"value {check['value']} limit {check['limit']} {check['unit']}".rstrip())
    return case


def _text(text: str) -> str:
    """Drop what XML cannot hold, such as the escape codes of a terminal."""
    return _NOT_XML.sub("", text)
