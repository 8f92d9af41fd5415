"""JUnit XML: what continuous integration shows of tests, as pytest writes it. XML has no control characters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal
from xml.etree import ElementTree

import msgspec

from miro_exact.bad_input import one_line


class TestCase(msgspec.Struct, frozen=True):
    """One test. `failure`: what was wanted is not so; `error`: it could not be judged. `lines`: all there is to say;
    the first one is the message. `time_s` None: nothing about times, so the same verdicts give the same bytes.
    """

    __test__ = False

    name: str
    classname: str
    time_s: float | None = None
    verdict: Literal["passed", "failure", "error", "skipped"] = "passed"
    lines: Sequence[str] = ()
    properties: Mapping[str, str] = {}


def junit_xml(suite: str, cases: Sequence[TestCase], properties: Mapping[str, str] = {}) -> bytes:
    """The file's content. `properties`: of the whole suite."""
    verdicts = [case.verdict for case in cases]
    times_s = [case.time_s for case in cases if case.time_s is not None]
    top = ElementTree.Element("testsuites")
    within = ElementTree.SubElement(
        top,
        "testsuite",
        name=suite,
        tests=str(len(cases)),
        failures=str(verdicts.count("failure")),
        errors=str(verdicts.count("error")),
        skipped=str(verdicts.count("skipped")),
        **_time(math.fsum(times_s) if times_s else None),
    )
    _properties(within, properties)
    for case in cases:
        element = ElementTree.SubElement(
            within,
            "testcase",
            classname=one_line(case.classname),
            name=one_line(case.name),
            **_time(case.time_s),
        )
        _properties(element, case.properties)
        if case.verdict != "passed":
            message = one_line(case.lines[0]) if case.lines else case.verdict
            outcome = ElementTree.SubElement(element, case.verdict, message=message)
            outcome.text = "\n".join(map(one_line, case.lines))
        elif case.lines:
            ElementTree.SubElement(element, "system-out").text = "\n".join(map(one_line, case.lines))
    ElementTree.indent(top)
    content: bytes = ElementTree.tostring(top, encoding="utf-8", xml_declaration=True)
    return content + b"\n"


def _time(time_s: float | None) -> dict[str, Any]:
    return {} if time_s is None else {"time": f"{time_s:.3f}"}


def _properties(within: ElementTree.Element, properties: Mapping[str, str]) -> None:
    if properties:
        listed = ElementTree.SubElement(within, "properties")
        for name, value in properties.items():
            ElementTree.SubElement(listed, "property", name=name, value=one_line(value))
