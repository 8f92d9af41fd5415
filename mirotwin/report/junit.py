"""JUnit XML: what continuous integration shows of tests, as pytest writes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal
from xml.etree import ElementTree

import msgspec

from miro_exact.bad_input import one_line


class TestCase(msgspec.Struct, frozen=True):
    """One test. `failure`: what was wanted is not so; `error`: it could not be judged. `lines`: all there is to say."""

    __test__ = False

    name: str
    classname: str
    time_s: float
    verdict: Literal["passed", "failure", "error", "skipped"] = "passed"
    lines: Sequence[str] = ()
    properties: Mapping[str, str] = {}


def junit_xml(suite: str, cases: Sequence[TestCase]) -> bytes:
    """The file's content."""
    verdicts = [case.verdict for case in cases]
    time_s = 0.0
    for case in cases:
        time_s += case.time_s
    top = ElementTree.Element("testsuites")
    within = ElementTree.SubElement(
        top,
        "testsuite",
        name=suite,
        tests=str(len(cases)),
        failures=str(verdicts.count("failure")),
        errors=str(verdicts.count("error")),
        skipped=str(verdicts.count("skipped")),
        time=f"{time_s:.3f}",
    )
    for case in cases:
        one = ElementTree.SubElement(
            within,
            "testcase",
            classname=_clean(case.classname),
            name=_clean(case.name),
            time=f"{case.time_s:.3f}",
        )
        if case.properties:
            listed = ElementTree.SubElement(one, "properties")
            for name, value in case.properties.items():
                ElementTree.SubElement(listed, "property", name=name, value=_clean(value))
        if case.verdict != "passed":
            message = _clean(case.lines[0]) if case.lines else case.verdict
            said = ElementTree.SubElement(one, case.verdict, message=message)
            said.text = "\n".join(map(_clean, case.lines))
        elif case.lines:
            ElementTree.SubElement(one, "system-out").text = "\n".join(map(_clean, case.lines))
    ElementTree.indent(top)
    content: bytes = ElementTree.tostring(top, encoding="utf-8", xml_declaration=True)
    return content + b"\n"


def _clean(text: str) -> str:
    """XML has no control characters."""
    return one_line(text)
