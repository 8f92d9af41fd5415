"""Which rule is judged, what `mirotwin conform` begins with, and what it says of usual mistakes."""

import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.conform import run
from mirotwin.conform.rules import RULES, find, presupposed
from mirotwin.conform.run import Outcome, try_all, with_faults
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.verify.checks.interface import Failure
from tests.mirotwin.conform.images import FAULTS, HANGS, image_of
from tests.mirotwin.conform.mistakes import MISTAKES
from tests.mirotwin.verify.checks.rig import built, needs_sdcc, own_image

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.slow


def test_all_but_one_rule_presuppose_that_a_plain_frame_is_obeyed():
    assert [rule.id for rule in RULES if not rule.presupposes] == ["P24"]
    assert all(find("P24") in presupposed(rule) for rule in RULES if rule.id != "P24")


def test_a_presupposition_comes_behind_those_that_it_has_itself():
    for rule in RULES:
        found = [one.id for one in presupposed(rule)]
        assert all(set(find(id).presupposes) <= set(found[:place]) for place, id in enumerate(found))


def test_rules_that_may_be_a_cause_say_what_firmware_does_that_breaks_them():
    causes = {id for rule in RULES for id in rule.presupposes} | {rule.id for rule in RULES if rule.faults}
    assert {rule.id for rule in RULES if rule.broken} == causes


def test_a_rule_whose_presupposition_failed_is_not_judged_and_its_trial_not_run(monkeypatch):
    tried = []
    whole = run.try_rule

    def noted(rule, *others):
        tried.append(rule.id)
        return whole(rule, *others)

    monkeypatch.setattr(run, "try_rule", noted)
    outcomes = with_faults(list(try_all(RULES, image_of(HANGS))), RULES)
    assert tried == ["P24"]
    assert [one.rule for one in outcomes] == [rule.id for rule in RULES]
    assert {one.verdict for one in outcomes if one.cause == "P24"} == {"not judged"}
    assert [(one.rule, one.verdict) for one in outcomes if not one.cause] == [("P24", "failed")]


@given(st.sets(st.sampled_from([rule.id for rule in RULES])), st.sets(st.sampled_from(RULES)))
def test_no_rule_that_would_fail_passes_and_each_that_is_not_judged_has_a_cause_that_failed(failing, chosen):
    rules = [msgspec.structs.replace(rule, probe=None) for rule in RULES if rule in chosen]

    def tried(rule, *others):
        failed = (Failure("conforms_to", 0, 1, 7, "one", "another"),) if rule.id in failing else ()
        return Outcome(rule.id, failed)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "try_rule", tried)
        patch.setattr(run, "why_lost", lambda *_: "")
        outcomes = with_faults(list(try_all(rules, own_image())), rules)
    assert [one.rule for one in outcomes] == [rule.id for rule in rules]
    verdicts = {one.rule: one.verdict for one in outcomes}
    for one in outcomes:
        assert (one.verdict == "passed") <= (one.rule not in failing)
        assert (one.verdict == "failed") <= (one.rule in failing)
        assert (one.verdict == "not judged") == (verdicts.get(one.cause) == "failed")
    assert ("failed" in verdicts.values()) == bool(failing & set(verdicts))


def test_a_presupposition_that_is_not_tried_hides_nothing():
    (outcome,) = try_all([find("P44")], image_of(HANGS))
    assert (outcome.verdict, outcome.cause) == ("failed", "")


def test_a_presupposition_counts_by_way_of_rules_that_are_not_tried():
    found = list(try_all([find("P44"), find("P24")], image_of(HANGS)))
    assert [(one.rule, one.verdict) for one in found] == [("P24", "failed"), ("P44", "not judged")]


def test_a_rule_that_failed_after_a_firmware_fault_is_not_judged_and_the_fault_is_the_cause():
    rules = [find(id) for id in ("P24", "P29", "P54")]
    outcomes = with_faults(list(try_all(rules, image_of(FAULTS))), rules)
    assert [(one.rule, one.verdict, one.cause) for one in outcomes] == [
        ("P24", "not judged", "P54"),
        ("P29", "not judged", "P54"),
        ("P54", "failed", ""),
    ]


def test_the_table_begins_with_the_rule_that_hides_most_and_folds_those_that_it_hides(mirotwin, tmp_path):
    image = tmp_path / "hangs.ihx"
    image.write_bytes(b":0200000080FE80\n:00000001FF\n")
    code, out, _ = mirotwin("conform", image)
    lines = out.splitlines()
    others = len(RULES) - 1
    assert code == 1
    assert lines[0] == (
        f"{others} rules were not judged because a plain team frame is not obeyed; begin with P24:"
        " its serial port takes no character: not set up, or off"
    )
    assert lines[2].split()[:4] == ["P24", "both", "types", "failed"]
    assert lines[-2].startswith(f"{others} rules were not judged because P24 failed: P01 to P")
    assert (
        lines[-1] == f"{len(RULES)} rules: 0 passed, 1 failed, {others} not judged; --long tries P61, P62 too"
    )


def test_all_also_tries_rules_of_which_a_presupposition_failed():
    late = load_firmware(f"{ROOT / 'examples' / 'firmware' / 'late.ihx'}")
    rules = [find(id) for id in ("P29", "P30", "P43")]
    assert [one.cause for one in try_all(rules, late)] == ["", "P29", "P29"]
    outcomes = list(try_all(rules, late, everything=True))
    assert [one.verdict for one in outcomes] == ["failed", "failed", "passed"]


def planted_image(name):
    return built(*MISTAKES[name][:3]).path


@needs_sdcc
@pytest.mark.parametrize("name", [name for name, mistake in MISTAKES.items() if mistake.says])
def test_a_usual_mistake_is_named_in_the_first_three_lines(name, mirotwin):
    code, out, _ = mirotwin("conform", planted_image(name), "-q")
    assert code in (1, 3)
    found = re.sub(r"\s+", " ", " ".join(out.splitlines()[:3]))
    for said in MISTAKES[name].says:
        assert said in found


@needs_sdcc
def test_a_timeline_tells_what_was_sent_received_commanded_and_answered(mirotwin):
    out = mirotwin.succeeds("conform", "--explain", "P44")
    lines = out.splitlines()
    assert lines[0].startswith("P44 full duplex: A robot MUST hear the next frame while it answers")
    assert lines[3] == "net0/robot1 (N = 3): 9 expectations passed"
    rows = [line.split(maxsplit=4) for line in lines[4 : lines.index("", 4)]]
    ticks = [int(row[0]) for row in rows]
    assert ticks == sorted(ticks)
    assert all(abs(int(row[0]) / 24_000 - float(row[1])) < 0.001 and row[2] == "ms" for row in rows)
    assert {row[3] for row in rows} == {"sent", "received", "commanded", "answered", "passed"}
    said = {row[3]: row[4] for row in reversed(rows)}
    assert said["sent"].endswith(": team_ask seq=22, this robot 978 (03D2h), -983 (FC29h)")
    assert "left STT: 978 (03D2h)" in out
    assert "telemetry seq=22 slot=1 flags=10h accepted=1 rejected=0" in said["answered"]


@needs_sdcc
def test_a_timeline_shows_where_the_rule_failed_with_the_words_of_the_table(mirotwin):
    image = planted_image("stops 15 ms late")
    code, out, _ = mirotwin("conform", image, "--explain", "p29")
    assert code == 1
    failed = [line for line in out.splitlines() if " FAILED " in line]
    assert "net0/robot1 (N = 3): 8 expectations, 4 failed" in out
    first = failed[0].split(" FAILED ")[1].strip()
    _, table, _ = mirotwin("conform", image, "--rule", "P29")
    assert first in re.sub(r"\s+", " ", table)


@needs_sdcc
@pytest.mark.parametrize("instead", ["", "    halt_both(TRJ_MOTOR_OFF);\n"])
def test_wheels_that_are_never_told_to_turn_break_the_rule_without_a_guess_at_the_reason(instead):
    image = built("motion.c", "    start_both();\n    state = STATE_DRIVING;\n", instead)
    (outcome,) = try_all([find("P28")], image)
    assert outcome.verdict == "failed"
    assert not [one for one in outcome.failures if "acceleration" in one.found]


@needs_sdcc
def test_characters_that_are_no_answer_are_told_with_their_times():
    image = built("telemetry.c", "tx_frame[TX_AT_SYNC] = SYNC_0;", "tx_frame[TX_AT_SYNC] = 0;")
    (outcome,) = try_all([find("P50")], image)
    assert re.search(
        r"found 19 characters, 55 55 55 55 FF 00 D4 .. .* \(ticks \d+ to \d+, \d+\.\d+ to \d+\.\d+ ms\): no sync 2D D4",
        str(outcome.failures[0]),
    )
