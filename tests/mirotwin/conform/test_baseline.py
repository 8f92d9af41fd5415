"""`mirotwin conform --baseline`: what is known to fail is listed, what is new fails, what passes again is reported."""

import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.conform import baseline
from mirotwin.conform.rules import ALL
from mirotwin.conform.run import Outcome
from mirotwin.verify.checks.interface import Failure
from tests.mirotwin.conform.images import FAULTS, HANGS
from tests.mirotwin.conftest import hex_file

LATE = Path(__file__).parents[3] / "examples" / "firmware" / "late.ihx"
LATE_RULES = ("--rule", "P29", "--rule", "P24")


@pytest.fixture
def known(tmp_path):
    """A baseline, as a user edits it."""
    path = tmp_path / "known.toml"
    path.write_text('P29 = "stops late: ticket 12"\n')
    return path


def test_a_rule_that_is_known_to_fail_is_listed_and_does_not_count(mirotwin, known, tmp_path):
    junit = tmp_path / "j.xml"
    out = mirotwin.succeeds("conform", LATE, *LATE_RULES, "--baseline", known, "--junit", junit)
    assert "P29   stop        failed   known: stops late: ticket 12; net0/robot1: tick" in out
    assert out.splitlines()[-1] == "2 rules: 1 passed, 1 failed (1 of them known)"
    (skipped,) = ElementTree.parse(junit).getroot().iter("skipped")
    assert skipped.get("message") == "known to fail: stops late: ticket 12"


def test_a_rule_that_is_not_known_to_fail_is_exit_code_1(mirotwin, known):
    known.write_text('P24 = "another one"\n')
    code, _, err = mirotwin("conform", LATE, *LATE_RULES, "--baseline", known)
    assert code == 1
    assert "P24: known to fail, but passed" in err


def test_a_rule_that_passes_again_is_reported_and_no_failure(mirotwin, known):
    code, _, err = mirotwin("conform", "--rule", "P29", "--baseline", known, "-q")
    assert (code, err) == (
        0,
        f"mirotwin: P29: known to fail, but passed; take it out of {known}, or give --write-baseline\n",
    )


def test_what_is_not_judged_behind_a_known_failure_does_not_count(mirotwin, known, tmp_path):
    known.write_text('P24 = "no serial port yet"\n')
    image = hex_file(tmp_path / "hangs.ihx", HANGS)
    mirotwin.succeeds("conform", image, "--rule", "P24", "--rule", "P44", "--baseline", known)


def test_a_firmware_fault_counts_unless_the_rule_against_it_is_known_to_fail(mirotwin, known, tmp_path):
    image = hex_file(tmp_path / "faults.ihx", FAULTS)
    ids = ("--rule", "P54")
    assert mirotwin("conform", image, *ids, "--baseline", known)[0] == 3
    known.write_text('P54 = "jumps into nothing"\n')
    assert mirotwin("conform", image, *ids, "--baseline", known)[0] == 0


def test_writing_keeps_reasons_and_rules_that_were_not_tried_and_takes_out_what_passes(mirotwin, known):
    known.write_text('P29 = "ticket 12"\nP24 = "passes now"\nP45 = "not tried"\n')
    mirotwin.succeeds("conform", LATE, *LATE_RULES, "--baseline", known, "--write-baseline")
    assert tomllib.loads(known.read_text()) == {"P29": "ticket 12", "P45": "not tried"}
    assert known.read_text().splitlines()[1:] == ['P29 = "ticket 12"', 'P45 = "not tried"']


def test_a_new_baseline_says_what_is_broken(mirotwin, tmp_path):
    path = tmp_path / "new.toml"
    mirotwin.succeeds("conform", LATE, *LATE_RULES, "--baseline", path, "--write-baseline")
    assert tomllib.loads(path.read_text()) == {
        "P29": "the wheels are not told to stop 110 ms after the last frame"
    }


REFUSED = {
    "P29 = 3\n": 'P29: is not a rule with its reason; write P29 = "reason"',
    'p29 = "late"\n': 'p29: is not a rule with its reason; write P29 = "reason"',
    'P99 = "late"\n': "P99: there is no rule 'P99'",
    "P29\n": "not TOML",
}


@pytest.mark.parametrize("text", REFUSED)
def test_a_file_that_is_no_baseline_is_refused_with_its_place(mirotwin, known, text):
    known.write_text(text)
    err = mirotwin.ends(2, "conform", LATE, "--baseline", known)
    assert f"{known}: " in err
    assert REFUSED[text] in err


def test_a_baseline_that_is_not_there_is_refused_with_the_remedy(mirotwin, tmp_path):
    err = mirotwin.ends(2, "conform", LATE, "--baseline", tmp_path / "none.toml")
    assert "none.toml: there is no such file; --write-baseline writes it" in err
    assert "needs --baseline" in mirotwin.ends(2, "conform", LATE, "--write-baseline")


REASONS = st.dictionaries(st.sampled_from([rule.id for rule in ALL]), st.text(min_size=1), max_size=5)


@given(REASONS)
def test_what_is_written_is_read_again(tmp_path_factory, reasons):
    path = tmp_path_factory.mktemp("baseline") / "known.toml"
    failed = [Outcome(id, (Failure("conforms_to", 0, 1, 7, "one", "another"),)) for id in reasons]
    written = baseline.write(path, reasons, failed)
    read = baseline.read(path)
    assert list(read) == list(written) == [rule.id for rule in ALL if rule.id in reasons]
    assert baseline.write(path, read, failed) == read
