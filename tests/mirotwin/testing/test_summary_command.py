"""`mirotwin summary`: a page of JUnit files as a reader sees it, and lines that GitHub shows at the source."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.shell.junit import TestCase, junit_xml, read_junit
from mirotwin.testing.summary_command import MOST, annotation, page

PLACE = {"file": "firmware/main.c", "line": 60, "at_ms": 213.717}
COMMANDS = {"replay": "mirotwin replay failed/P29.stream", "debug": "mirotwin debug failed/P29.stream"}
STOP = TestCase(
    "P29 stop", "conform.Failsafe", verdict="failed", lines=("found | left",), facts=PLACE | COMMANDS
)
BOOT = TestCase("P01", "conform.Power-on")
LATE = TestCase("P45", "conform", verdict="failed", counts=False, lines=("known to fail: ticket 12",))
PYTEST = """<testsuites><testsuite><testcase classname="tests.test_mine" name="test_stops">
<properties><property name="mirotwin_at_ms" value="12.5"/><property name="mirotwin_file" value="tests/test_mine.py"/>
<property name="mirotwin_line" value="3"/><property name="mirotwin_reproduce" value="pytest tests/test_mine.py"/>
</properties><failure message="assert 1 == 2&#10; +  where 1 = one">traceback</failure></testcase>
</testsuite></testsuites>"""


@pytest.fixture
def reports(tmp_path, monkeypatch):
    """The folder of the reports: `build`, below the current one."""
    monkeypatch.chdir(tmp_path)
    Path("build").mkdir()
    Path("build/conform.xml").write_bytes(junit_xml("mirotwin conform", [STOP, BOOT, LATE]))
    return Path("build")


def test_the_page_says_what_failed_when_where_and_how_to_play_it_again(mirotwin, reports):
    (reports / "pytest.xml").write_text(PYTEST)
    out = mirotwin.succeeds("summary", "build")
    assert out == (
        "## 2 of 4 tests failed\n\n"
        "| report | passed | failed | skipped |\n|---|---|---|---|\n"
        "| conform.xml | 1 | 1 | 1 |\n| pytest.xml | 0 | 1 | 0 |\n\n"
        "| failed | at ms | where | what |\n|---|---|---|---|\n"
        "| P29 stop | 213.717 | firmware/main.c:60 | found \\| left |\n"
        "| test\\_stops | 12.5 | tests/test\\_mine.py:3 | assert 1 == 2 |\n\n"
        "Again, and with the debugger at the failure:\n\n"
        "    mirotwin replay failed/P29.stream  # P29 stop\n"
        "    mirotwin debug failed/P29.stream  # P29 stop\n"
        "    pytest tests/test_mine.py  # test_stops\n"
    )


def test_where_nothing_failed_the_page_has_the_counts_alone(mirotwin, tmp_path):
    (tmp_path / "j.xml").write_bytes(junit_xml("mirotwin", [BOOT, LATE]))
    out = mirotwin.succeeds("summary", tmp_path / "j.xml", "--out", tmp_path / "summary.md")
    assert out == ""
    assert (tmp_path / "summary.md").read_text() == (
        "## 2 tests passed or skipped\n\n"
        "| report | passed | failed | skipped |\n|---|---|---|---|\n| j.xml | 1 | 0 | 1 |\n"
    )


def test_many_failures_are_counted_not_listed(tmp_path):
    path = tmp_path / "j.xml"
    path.write_bytes(junit_xml("mirotwin", [STOP] * (MOST + 5)))
    lines = [*page({path: read_junit(path)})]
    assert len([line for line in lines if line.startswith("| P29 stop")]) == MOST
    assert "5 more are in the reports." in lines


def test_an_annotation_names_the_line_of_a_file_of_the_project(mirotwin, reports, monkeypatch):
    out = mirotwin.succeeds("summary", "build", "--annotations", "--out", "s.md")
    assert out == "::error title=P29 stop::firmware/main.c:60: found | left\n"
    Path("firmware").mkdir()
    Path("firmware/main.c").write_text("")
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    out = mirotwin.succeeds("summary", "build", "--annotations", "--out", "s.md")
    assert out == "::error file=firmware/main.c,line=60,title=P29 stop::found | left\n"
    monkeypatch.setenv("GITHUB_WORKSPACE", f"{Path.cwd().parent}")
    out = mirotwin.succeeds("summary", "build", "--annotations", "--out", "s.md")
    assert f"file={Path.cwd().name}/firmware/main.c,line=60," in out


@pytest.mark.parametrize("content", [None, b"<coverage/>", junit_xml("mirotwin", [])])
def test_where_no_test_ran_the_page_says_so_and_it_is_an_error(mirotwin, tmp_path, content):
    if content is not None:
        (tmp_path / "a.xml").write_bytes(content)
    code, out, err = mirotwin("summary", tmp_path, "--out", tmp_path / "s.md")
    assert (code, out, (tmp_path / "s.md").read_text()) == (2, "", "## No test ran\n")
    assert err.startswith(
        f"mirotwin: error: {tmp_path}: no test is in it, so nothing was tested; write JUnit with"
    )


def test_a_report_that_was_broken_off_is_refused_with_its_line(mirotwin, reports):
    whole = (reports / "conform.xml").read_bytes()
    (reports / "conform.xml").write_bytes(whole[:400])
    assert "build/conform.xml:" in (err := mirotwin.ends(2, "summary", "build"))
    assert "is no XML that is whole" in err
    assert "none.xml: No such file" in mirotwin.ends(2, "summary", "none.xml")


TEXT = st.text(min_size=1)
CASES = st.builds(
    TestCase,
    TEXT,
    TEXT,
    verdict=st.sampled_from(["passed", "failed", "error", "fault", "not judged", "not observable"]),
    counts=st.booleans(),
    lines=st.lists(TEXT, min_size=1, max_size=3),
    facts=st.dictionaries(st.sampled_from([*PLACE, *COMMANDS, "reproduce"]), TEXT),
)


@given(st.lists(CASES, max_size=5))
def test_what_is_written_is_read_and_no_text_leaves_its_cell_or_its_line(tmp_path_factory, cases):
    path = tmp_path_factory.mktemp("junit") / "j.xml"
    path.write_bytes(junit_xml("mirotwin", cases))
    read = read_junit(path) or []
    assert [one.kind for one in read] == [case.kind for case in cases]
    lines = [*page({path: read})]
    assert not [line for line in lines if len(line.splitlines()) > 1]
    for line in lines:
        if line.startswith("|"):
            assert len(re.findall(r"(?<!\\)(?:\\\\)*\|", line)) == 5
    for case in read:
        assert len(annotation(case).splitlines()) == 1
        properties = annotation(case).removeprefix("::error ").partition("::")[0]
        assert all(re.fullmatch("(file|line|title)=[^,:]*", one) for one in properties.split(","))


def test_the_file_is_xml_of_other_tools_too(tmp_path):
    path = tmp_path / "j.xml"
    suite = ElementTree.Element("testsuite")
    ElementTree.SubElement(suite, "testcase", name="one", file="a.c", line="3").append(
        ElementTree.Element("error")
    )
    path.write_bytes(ElementTree.tostring(suite))
    (case,) = read_junit(path) or []
    assert (case.kind, case.place, case.message) == ("error", "a.c:3", "error")
