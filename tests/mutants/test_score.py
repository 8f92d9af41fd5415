"""The score counts what could be killed, and says what is not as it has to be."""

import pytest

from tests.mutants.document import BEGIN, END, PAGE, render, replaced
from tests.mutants.draw import COUNT, SEED, drawn, mutants_of, source_files
from tests.mutants.planted import PLANTED
from tests.mutants.score import Fate, Score, fates, jobs_of, merged, problems, share
from tests.mutants.sdcc import needs_sdcc
from tests.mutants.survivors import Survivor, survivors

EQUIVALENT = Survivor("equivalent", "It is the same.")
MISSING = Survivor("missing", "No rule looks there.")


def of_draw(number, what, *rules):
    return Fate(f"a.c:{number}:1:constant:0", "1 -> 0", False, what, rules, 2.0)


def planted(what, *rules):
    return Fate("never stops", "", True, what, rules)


KILLED = [of_draw(number, "killed", "P01") for number in range(19)]
OTHERS = [of_draw(90, "does not compile"), of_draw(91, "same bytes"), planted("killed", "P02")]


def objected(*fates, known):
    return problems(Score(0, ("P01", "P02"), 2.0, (*KILLED, *OTHERS, *fates)), known)


def test_what_no_right_rule_can_kill_is_not_counted():
    alive = [of_draw(number, "alive") for number in range(50, 55)]
    verdicts = ("equivalent", "allowed", "unreachable", "missing")
    known = {one.id: Survivor(verdict, "") for one, verdict in zip(alive, verdicts, strict=False)}
    assert share([*KILLED, *OTHERS, *alive], known) == (19, 22)


def test_a_score_of_95_percent_with_all_survivors_explained_is_as_it_has_to_be():
    alive = of_draw(50, "alive")
    assert objected(alive, known={alive.id: MISSING}) == []


@pytest.mark.parametrize(
    ("fates", "known", "problem"),
    [
        ((of_draw(50, "alive"), of_draw(51, "alive")), (50, 51), "killed 19 of 21, wanted 95 %"),
        (
            (of_draw(50, "alive"),),
            (),
            "a.c:50:1:constant:0 is alive, and survivors.toml does not say why: 1 -> 0",
        ),
        (
            (of_draw(50, "killed", "P01"),),
            (50,),
            "a.c:50:1:constant:0 is in survivors.toml, but P01 kills it",
        ),
        ((planted("alive"),), (), "planted mistake 'never stops': alive"),
    ],
)
def test_what_is_not_as_it_has_to_be_is_said(fates, known, problem):
    table = {of_draw(number, "alive").id: MISSING for number in known}
    assert objected(*fates, known=table) == [problem]


def test_a_rule_that_kills_nobody_is_named():
    score = Score(0, ("P01", "P02", "P03"), 2.0, (*KILLED, *OTHERS))
    assert problems(score, {}) == ["rule P03 kills nobody"]


def test_every_survivor_of_the_table_is_a_mutant_of_the_draw_and_its_reason_a_sentence():
    there = {one.id for one in drawn(mutants_of(source_files()))}
    for name, one in survivors().items():
        assert name in there
        assert one.because.endswith(".")


def test_the_page_shows_each_fate_and_can_be_written_again():
    alive = of_draw(50, "alive")
    score = Score(7, ("P01", "P02"), 2.25, (*KILLED, *OTHERS, alive))
    part = render(score, {alive.id: EQUIVALENT}, 2000)
    assert "Seed 7: 22 of 2000 mutants. **Killed 19 of the 19 that do not conform, 100.0 %**" in part
    assert "| constant | 22 | 1 | 1 | 19 | 1 | 0 | 0 | 0 |\n" in part
    assert "| `a.c:50:1:constant:0` | `1 -> 0` | equivalent | It is the same. |\n" in part
    assert f"| never stops | {PLANTED['never stops'].breaks} | P02 |\n" in part
    assert "| P01 | 19 | 19 | 1 |\n" in part
    page = PAGE.read_text("utf-8")
    assert replaced(replaced(page, part), part) == replaced(page, part) != page
    assert page.split(BEGIN)[1].split(END)[0].startswith("Seed ")


def test_every_survivor_stands_on_the_page_with_its_reason():
    page = PAGE.read_text("utf-8")
    for name, one in survivors().items():
        assert f"| `{name.replace('|', chr(92) + '|')}` |" in page
        assert one.because in page


def test_rules_that_are_tried_again_replace_their_old_verdict_alone():
    rules = ("P01", "P02", "P03")
    killed, alive = of_draw(1, "killed", "P01", "P02"), of_draw(1, "alive")
    assert merged(killed, of_draw(1, "killed", "P03"), ("P02", "P03"), rules).rules == ("P01", "P03")
    assert merged(of_draw(1, "killed", "P02"), alive, ("P02",), rules).what == "alive"
    assert merged(alive, of_draw(1, "killed", "P03"), ("P03",), rules) == of_draw(1, "killed", "P03")
    assert merged(of_draw(1, "same bytes"), of_draw(1, "same bytes"), ("P03",), rules).what == "same bytes"


@needs_sdcc
def test_mutants_of_the_draw_meet_their_fate():
    wanted = {
        "decode.h:17:31:arithmetic:/": "does not compile",
        "lm629.c:51:18:constant:-1": "same bytes",
        "motion.c:86:47:shift:>>": "killed",
        "uart.h:14:25:constant:-1": "alive",
    }
    jobs = [job for job in jobs_of(COUNT, SEED, tried=("P24",)) if job.id in wanted]
    found = list(fates(jobs, 1))
    assert {one.id: one.what for one in found} == wanted
    assert {one.id: one.rules for one in found if one.rules} == {"motion.c:86:47:shift:>>": ("P24",)}
    assert [one.error for one in found if one.error] == [
        "motion.c:86: error 106: invalid operand for 'divide' operation"
    ]
