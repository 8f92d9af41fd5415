"""JUnit XML for continuous integration, in the form that pytest writes. XML has no control characters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import msgspec

from miro_exact.bad_input import BadInput, one_line
from miro_exact.inputs import read_input
from mirotwin.shell.verdicts import VERDICTS, Kind, Verdict


class TestCase(msgspec.Struct, frozen=True):
    """One test, rule, run or crash. `counts`: the verdict affects the exit code; otherwise the case is "skipped" in
    JUnit. `lines`: the report; the first line is the message. `time_s` None: nothing about times, so the same verdicts
    give the same bytes. `facts`: further properties, by the names in docs/formats/results.md.
    """

    __test__ = False

    name: str
    classname: str
    time_s: float | None = None
    verdict: Verdict = "passed"
    counts: bool = True
    lines: Sequence[str] = ()
    facts: Mapping[str, str | int | float] = {}

    @property
    def kind(self) -> Kind:
        """Its verdict in JUnit's words."""
        kind = VERDICTS[self.verdict].junit
        return "skipped" if not self.counts and kind != "passed" else kind


def junit_xml(
    suite: str, cases: Sequence[TestCase], properties: Mapping[str, str | int | float] = {}
) -> bytes:
    """The file's content. `properties`: of the whole suite."""
    kinds = [case.kind for case in cases]
    times_s = [case.time_s for case in cases if case.time_s is not None]
    top = ElementTree.Element("testsuites")
    within = ElementTree.SubElement(
        top,
        "testsuite",
        name=suite,
        tests=str(len(cases)),
        failures=str(kinds.count("failure")),
        errors=str(kinds.count("error")),
        skipped=str(kinds.count("skipped")),
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
            **_place(case),
        )
        _properties(element, case.facts)
        if case.kind != "passed":
            message = one_line(case.lines[0]) if case.lines else case.kind
            outcome = ElementTree.SubElement(element, case.kind, message=message)
            outcome.text = "\n".join(map(one_line, case.lines))
        elif case.lines:
            ElementTree.SubElement(element, "system-out").text = "\n".join(map(one_line, case.lines))
    ElementTree.indent(top)
    content: bytes = ElementTree.tostring(top, encoding="utf-8", xml_declaration=True)
    return content + b"\n"


def _time(time_s: float | None) -> dict[str, Any]:
    return {} if time_s is None else {"time": f"{time_s:.3f}"}


def _place(case: TestCase) -> dict[str, Any]:
    return {name: one_line(f"{case.facts[name]}") for name in ("file", "line") if name in case.facts}


def _properties(within: ElementTree.Element, properties: Mapping[str, str | int | float]) -> None:
    if properties:
        listed = ElementTree.SubElement(within, "properties")
        for name, value in properties.items():
            ElementTree.SubElement(listed, "property", name=name, value=one_line(f"{value}"))


class ReadCase(msgspec.Struct, frozen=True):
    """A test of a JUnit file, of ours or of another tool. `facts`: its properties; pytest's without `mirotwin_`."""

    name: str
    kind: Kind
    message: str
    facts: Mapping[str, str]

    @property
    def place(self) -> str:
        """FILE:LINE, or the known part of it."""
        return ":".join(self.facts[name] for name in ("file", "line") if self.facts.get(name))


_KINDS: tuple[Kind, ...] = ("failure", "error", "skipped")


def read_junit(path: Path) -> list[ReadCase] | None:
    """The tests of a file; None for XML that is no JUnit. Raises BadInput."""
    try:
        top = ElementTree.fromstring(read_input(path))
    except ElementTree.ParseError as error:
        raise BadInput(path, error.position[0], "is no XML that is whole", "write it again") from None
    except OSError as error:
        raise BadInput(path, "", error.strerror or f"{error}", "name another file") from None
    if top.tag not in ("testsuites", "testsuite"):
        return None
    return [_read_case(element) for element in top.iter("testcase")]


def _read_case(element: ElementTree.Element) -> ReadCase:
    name = one_line(element.get("name", ""))
    facts = {key: one_line(element.get(key, "")) for key in ("file", "line") if element.get(key)}
    for fact in element.iter("property"):
        facts[fact.get("name", "").removeprefix("mirotwin_")] = one_line(fact.get("value", ""))
    kind = next((kind for kind in _KINDS if element.find(kind) is not None), None)
    outcome = None if kind is None else element.find(kind)
    if kind is None or outcome is None:
        return ReadCase(name, "passed", "", facts)
    lines = (outcome.get("message") or outcome.text or "").strip().splitlines()
    return ReadCase(name, kind, one_line(lines[0]) if lines else kind, facts)
