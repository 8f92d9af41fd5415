"""What came of the rules as JUnit XML, for the test pages of CI systems.

No wall time is in it: the same image gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

from miro_exact.bad_input import one_line
from mirotwin.verify.conform.rule import Rule
from mirotwin.verify.conform.run import Outcome, failure_text
from mirotwin.verify.conform.table import chapter_of, find


def junit(outcomes: Sequence[Outcome], rules: Sequence[Rule], properties: Mapping[str, str]) -> bytes:
    """One test case a rule, in a suite with these properties."""
    verdicts = [outcome.verdict for outcome in outcomes]
    suite = ElementTree.Element(
        "testsuite",
        name="mirotwin conform",
        tests=f"{len(outcomes)}",
        failures=f"{verdicts.count('failed')}",
        errors="0",
        skipped=f"{verdicts.count('not judged')}",
    )
    shown = ElementTree.SubElement(suite, "properties")
    for name, value in properties.items():
        ElementTree.SubElement(shown, "property", name=name, value=one_line(value))
    by_id = {rule.id: rule for rule in rules}
    for outcome in outcomes:
        rule = by_id[outcome.rule]
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"conform.{chapter_of(rule).title}", name=f"{rule.id} {rule.name}"
        )
        if outcome.cause:
            because = f"not judged: {outcome.cause} failed, {find(outcome.cause).broken}"
            ElementTree.SubElement(case, "skipped", message=because)
        elif outcome.failures:
            lines = [one_line(failure_text(failure)) for failure in outcome.failures]
            failure = ElementTree.SubElement(case, "failure", message=lines[0])
            failure.text = "\n".join([rule.text, f"({rule.source})", *lines])
    ElementTree.indent(suite)
    text: bytes = ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True)
    return text + b"\n"
