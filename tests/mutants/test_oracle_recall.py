"""How many of the checks' failures the fuzzer's fast oracle sees: counted on some mistakes, and the table."""

import csv

import pytest

from benchmarks import oracle_recall
from benchmarks.oracle_recall import (
    BEGIN,
    END,
    NOT_FUZZED,
    PAGE,
    TABLE,
    Row,
    judged,
    render,
    replaced,
    sessions,
    shipped,
    table,
)
from miro_robot.image import load_hex
from mirotwin.fuzz.target import RobotTarget
from tests.mutants.build import build
from tests.mutants.draw import source_files
from tests.mutants.for_fuzzing import FOR_FUZZING
from tests.mutants.planted import PLANTED
from tests.mutants.sdcc import needs_sdcc


def test_the_sessions_are_the_same_every_time_and_all_differ():
    assert sessions() == sessions()
    assert len(set(sessions())) == len(sessions()) > 60


def test_the_shipped_firmware_fails_neither_by_the_oracle_nor_by_the_checks():
    assert judged("none", shipped().image, sessions()[::6]) == Row("none")


@needs_sdcc
@pytest.mark.parametrize("name", ["stops 15 ms late", "never answers"])
def test_the_oracle_fails_the_sessions_that_the_checks_fail(name):
    one = PLANTED[name]
    image = load_hex(build({one.file: one.applied(source_files()[one.file])}).image)
    row = judged(name, image, sessions()[:8])
    assert row.found
    assert (row.missed, row.extra) == (0, 0)


@needs_sdcc
def test_a_failure_that_the_oracle_does_not_see_is_counted_with_its_check(monkeypatch):
    class Blind:
        """A target whose oracle finds nothing."""

        code = 0
        finding = None

        def __init__(self, *arguments):
            self.seeing = RobotTarget(*arguments)

        def run(self, data):
            self.seeing.run(data)
            return 0

        def __getattr__(self, name):
            return getattr(self.seeing, name)

    one = PLANTED["never answers"]
    image = load_hex(build({one.file: one.applied(source_files()[one.file])}).image)
    shipped()
    monkeypatch.setattr(oracle_recall, "RobotTarget", Blind)
    row = judged("never answers", image, sessions()[:4])
    assert row.missed == row.checks["answers_within_ms"] > 0
    assert (row.found, row.extra) == (0, 0)


def test_the_page_gives_recall_over_all_sessions_and_the_table_what_was_missed():
    rows = [Row("a", 3, 1, 2, {"no_fault": 1}), Row("b", refused="comes up with a fault"), Row("c")]
    text = render(rows)
    assert "fails 3 of the 4 sessions that the checks fail (75.0 %), and 2 that they do not" in text
    assert "Of 1 mistakes that some session shows to the checks it finds 1. In 0" in text
    assert "\na,3,1,2,no_fault 1\nb,not fuzzed,not fuzzed,not fuzzed,\nc,0,0,0,\n" in table(rows)


def recorded():
    """The rows of the table."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_table_has_every_mistake_once():
    names = [row["mistake"] for row in recorded()]
    assert names == ["none: the shipped firmware", *dict.fromkeys([*PLANTED, *FOR_FUZZING])]


def test_the_page_says_what_the_table_has():
    page = PAGE.read_text("utf-8")
    part = page.split(BEGIN)[1].split(END)[0]
    assert replaced(page, part) == page
    counts = [row for row in recorded() if row["found"] != NOT_FUZZED]
    rows = [Row(row["mistake"], *(int(row[key]) for key in ("found", "missed", "extra"))) for row in counts]
    assert part.partition(" In ")[0] == render(rows).partition(" In ")[0]
