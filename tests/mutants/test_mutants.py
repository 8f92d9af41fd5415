"""Mutants of the firmware: how its C is read, what is changed and drawn, how it is built, and what the score says."""

import shutil
from collections import Counter
from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_robot.firmware import image_path
from tests import children
from tests.mutants.build import build, shipped
from tests.mutants.c_tokens import tokens, words
from tests.mutants.document import BEGIN, END, PAGE, render, replaced, rows_of, tables
from tests.mutants.draw import COUNT, SEED, SOURCE, drawn, mutants_of, source_files
from tests.mutants.operators import OPERATORS, changes
from tests.mutants.planted import PLANTED
from tests.mutants.score import Fate, Score, Survivor, fates, jobs_of, merged, problems, share, survivors
from tests.mutants.sdcc import needs_sdcc

SOURCES = source_files()
MUTANTS = mutants_of(SOURCES)

PIECES = ["#define A(b) 1", "#include <x.h>", "/* a", "*/", "// b", "\n", "\\\n", '"', "'", "x"]
PIECES += ["__asm", "__endasm"]
C_TEXT = st.lists(st.sampled_from(PIECES) | st.text(max_size=4), max_size=30).map("".join)


@given(C_TEXT)
def test_the_tokens_of_any_text_are_that_text_again(text):
    found = list(tokens(text))
    assert "".join(token.text for token in found) == text
    assert all(text.startswith(token.text, token.start) for token in found)
    assert all(one.end == other.start for one, other in pairwise(found))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a>>=b", ["a", ">>=", "b"]),
        ("x = -1; /* y = 2; */", ["x", "=", "-", "1", ";"]),
        ("x; // y\nz", ["x", ";", "z"]),
        ('"a /* b" + 1', ['"a /* b"', "+", "1"]),
        ("__bit b; __asm nop\n __endasm;", ["__bit", "b", ";", "__asm nop\n __endasm", ";"]),
        (
            "void f(void) __interrupt(4) __using(1)",
            ["void", "f", "(", "void", ")", "__interrupt", "(", "4", ")"],
        ),
        ("#define N 3\nM", ["#define N", "3", "M"]),
        ("#define F(a) \\\n  (a + 1)\nM", ["#define F(a)", "(", "a", "+", "1", ")", "M"]),
        ("#if A > 1\n#pragma save\n#endif\n", ["#if A > 1", "#pragma save", "#endif"]),
    ],
)
def test_a_text_has_these_words(text, expected):
    assert [token.text for token in words(text)][: len(expected)] == expected


def test_only_the_body_of_a_definition_belongs_to_a_macro():
    assert [token.text for token in words("#define N (2 + 1)\nint x = 5;") if token.macro] == list("(2+1)")


def test_what_begins_no_token_is_named_with_its_line():
    with pytest.raises(ValueError, match=r"^line 2: '@' begins no token of C$"):
        words("int x;\n@")


OF_A_TOKEN = [one for one in MUTANTS if one.change.operator not in ("condition", "statement")]


def texts(source):
    return [token.text for token in words(source)]


def made(source, operator):
    return [change.applied(source) for change in changes(source) if change.operator == operator]


@given(st.sampled_from(OF_A_TOKEN))
def test_a_changed_token_is_the_only_difference(mutant):
    before, after = texts(SOURCES[mutant.file]), texts(mutant.change.applied(SOURCES[mutant.file]))
    same = next(place for place, (one, other) in enumerate(zip(before, after, strict=False)) if one != other)
    new = texts(mutant.change.new)
    assert after == [*before[:same], *new, *before[same + 1 :]]
    assert len(new) == (4 if mutant.change.new.startswith("(-1") else 1)


@given(st.sampled_from(MUTANTS))
def test_a_mutant_keeps_the_balance_of_brackets_and_is_not_its_source(mutant):
    source = SOURCES[mutant.file]
    after = texts(mutant.change.applied(source))
    assert after != texts(source)
    for opening, closing in ("()", "[]", "{}"):
        assert after.count(opening) - after.count(closing) == 0


def test_all_operators_apply_to_the_firmware():
    assert {one.change.operator for one in MUTANTS} == set(OPERATORS)


@pytest.mark.parametrize(
    ("operator", "source", "expected"),
    [
        ("constant", "x = 7;", ["x = 0;", "x = 1;", "x = (-1);", "x = 8;", "x = 6;"]),
        ("constant", "x = 1;", ["x = 0;", "x = (-1);", "x = 2;"]),
        (
            "constant",
            "#define N 0x0FUL",
            [f"#define N {n}" for n in ("0x00UL", "0x01UL", "(-1UL)", "0x10UL", "0x0EUL")],
        ),
        ("constant", "return true;", ["return false;"]),
        ("constant", '#include "x1.h"\n/* 2 */ char *t = "3";', []),
        ("relational", "if (a < b)", [f"if (a {mark} b)" for mark in ("<=", ">", ">=", "==", "!=")]),
        ("arithmetic", "x = a + -b;", [f"x = a {mark} -b;" for mark in "-*/%"]),
        ("arithmetic", "x = (u16)-a; y = *p; return -z;", []),
        ("arithmetic", "x = (a)-b;", ["x = (a)+b;", "x = (a)*b;", "x = (a)/b;", "x = (a)%b;"]),
        ("arithmetic", "#define N -5\n", []),
        ("shift", "x = a >> 8;", ["x = a << 8;"]),
        ("bitwise", "x = a[0] & b; y = &z;", ["x = a[0] | b; y = &z;", "x = a[0] ^ b; y = &z;"]),
        ("logical", "if (!a && b)", ["if (!a || b)"]),
        ("step", "a[i++] = --j;", ["a[i--] = --j;", "a[i++] = ++j;"]),
        ("assignment", "x |= 1;", [f"x {mark} 1;" for mark in ("+=", "-=", "&=", "^=")]),
        (
            "condition",
            "do { if (a) b(); } while (c(d));",
            ["do { if (!(a)) b(); } while (c(d));", "do { if (a) b(); } while (!(c(d)));"],
        ),
        ("condition", "for (;;) switch (x) { }", []),
    ],
)
def test_an_operator_makes_these_mutants(operator, source, expected):
    assert made(source, operator) == expected


BODY = """static u8 a[2] = {1, 2};
u8 f(void) __using(1)
{
    u8 x, y = 1;
    for (x = 0; x != 2; ++x)
        g(x, (y));
    if (y)
        y = 2;
    else
        ;
    do {
        --y;
    } while (y);
    switch (x) {
    case 1:
        break;
    default:
        h();
    }
    return y;
}
int z;
"""


def test_simple_statements_are_deleted_and_declarations_stay():
    deleted = [change.old for change in changes(BODY) if change.operator == "statement"]
    assert deleted == ["g(x, (y));", "y = 2;", "--y;", "break;", "h();", "return y;"]


def test_the_order_is_that_of_the_places_and_names_are_unique():
    places = [(one.file, one.line, one.column) for one in MUTANTS]
    assert places == sorted(places)
    assert len({one.id for one in MUTANTS}) == len(MUTANTS) > 2000


def test_a_name_says_where_the_old_text_stands():
    for one in MUTANTS:
        line = "\n".join(SOURCES[one.file].splitlines()[one.line - 1 :])
        assert line.startswith(one.change.old, one.column - 1), one.id


@settings(max_examples=30)
@given(st.integers(0, 200), st.integers(0, 200), st.integers(0, 1 << 62))
def test_a_longer_draw_begins_with_the_shorter_one(one, other, seed):
    short, long = sorted((one, other))
    some = MUTANTS[::10]
    found = drawn(some, long, seed)
    assert found[:short] == drawn(some, short, seed)
    assert len(set(found)) == long


def test_another_seed_draws_others():
    assert drawn(MUTANTS, COUNT, SEED) != drawn(MUTANTS, COUNT, SEED + 1)


def test_every_operator_in_every_file_is_drawn_and_the_rest_is_in_proportion():
    found = drawn(MUTANTS)
    there = Counter((one.file, one.change.operator) for one in MUTANTS)
    taken = Counter((one.file, one.change.operator) for one in found)
    assert set(taken) == set(there)
    highest_taken = max(Fraction(taken[group] - 1, count) for group, count in there.items())
    lowest_left = min(Fraction(taken[group], count) for group, count in there.items() if taken[group] < count)
    assert highest_taken <= lowest_left


def changed(file, right, wrong):
    assert right in SOURCES[file]
    return {file: SOURCES[file].replace(right, wrong)}


@needs_sdcc
def test_the_sources_as_they_are_make_the_shipped_image():
    assert shipped().image.read_bytes() == image_path().read_bytes()
    assert build(changed("main.c", "/* The robot's", "/* A robot's")).is_shipped


@pytest.mark.slow
@needs_sdcc
@pytest.mark.parametrize(
    "change",
    [
        changed("failsafe.c", "age == FAILSAFE_STOP_MS", "age == 90"),
        changed("protocol.h", "110     /* smooth stop */", "90      /* smooth stop */"),
    ],
    ids=["a C file", "a header"],
)
def test_an_image_is_that_of_a_build_from_nothing(change, tmp_path):
    source = shutil.copytree(SOURCE, tmp_path / "firmware")
    for name, text in change.items():
        (source / name).write_text(text)
    make = ["make", "-s", "-C", source, f"OUT={tmp_path / 'out'}", f"BUILD={tmp_path / 'made'}"]
    children.run(make, check=True)
    built = build(change, tmp_path / "cache")
    assert built.image.read_bytes() == (tmp_path / "out" / "miro.ihx").read_bytes()
    assert not built.is_shipped


@pytest.mark.slow
@needs_sdcc
def test_a_text_is_built_once(tmp_path):
    change = changed("failsafe.c", "age == FAILSAFE_STOP_MS", "age == 90")
    first = build(change, tmp_path)
    time_ns = first.image.stat().st_mtime_ns
    assert build(change, tmp_path) == first
    assert first.image.stat().st_mtime_ns == time_ns
    assert build(change, tmp_path / "other").image.read_bytes() == first.image.read_bytes()


@needs_sdcc
def test_what_does_not_compile_says_why_and_leaves_no_image(tmp_path):
    built = build(changed("main.c", "    EA = 1;", "    EB = 1;"), tmp_path)
    assert built.error == "main.c:46: error 20: Undefined identifier 'EB'"
    assert not built.image.exists()
    assert not built.is_shipped
    assert not list(tmp_path.glob("making-*"))


@needs_sdcc
def test_a_file_that_the_firmware_does_not_have_is_refused():
    with pytest.raises(ValueError, match=r"^the firmware has no file mian\.c$"):
        build({"mian.c": ""})


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


def test_the_page_and_the_tables_show_each_fate_and_can_be_written_again():
    alive, missed = of_draw(50, "alive"), of_draw(51, "alive")
    score = Score(7, ("P01", "P02"), 2.25, (*KILLED, *OTHERS, alive, missed))
    known = {alive.id: EQUIVALENT, missed.id: MISSING}
    part = render(score, known, 2000)
    assert "Seed 7: 23 of 2000 mutants. **Killed 19 of the 20 that do not conform, 95.0 %**" in part
    assert "1 does not compile, 1 same bytes, 19 killed, 1 equivalent, 0 allowed" in part
    assert "* `a.c:51:1:constant:0`, `1 -> 0`, missing: No rule looks there.\n" in part
    assert alive.id not in part
    written = tables(score, known)
    assert "\nconstant,23,1,1,19,1,0,0,1\n" in written["operators.csv"]
    assert "\na.c:50:1:constant:0,1 -> 0,equivalent\n" in written["alive.csv"]
    assert f"\nnever stops,{PLANTED['never stops'].breaks},P02\n" in written["planted.csv"]
    assert "\nP01,19,19,1\n" in written["rules.csv"]
    page = PAGE.read_text("utf-8")
    assert replaced(replaced(page, part), part) == replaced(page, part) != page
    assert page.split(BEGIN)[1].split(END)[0].startswith("Seed ")


def test_every_survivor_stands_in_the_table_and_those_that_do_not_conform_on_the_page_with_their_reason():
    page = PAGE.read_text("utf-8")
    known = survivors()
    assert {row["mutant"]: row["verdict"] for row in rows_of("alive.csv")} == {
        name: one.verdict for name, one in known.items()
    }
    for name, one in known.items():
        assert (f"* `{name}`, " in page) == (one.verdict in ("unreachable", "missing"))
        assert one.conforms or one.because in page


def test_the_figures_on_the_page_are_those_of_the_tables():
    page = PAGE.read_text("utf-8")
    (total,) = [row for row in rows_of("operators.csv") if row["operator"] == "all"]
    counts = [f"{total[fate]} {fate}" for fate in list(total)[2:]]
    assert f"All mutants: {', '.join(counts)}." in page
    assert (
        f"Seed {SEED}: {total['drawn']} of {len(MUTANTS)} mutants. **Killed {total['killed']} of the " in page
    )
    rules = rows_of("rules.csv")
    alone = len([row for row in rules if row["it alone"] != "0"])
    assert f"Each of the {len(rules)} rules" in page
    assert f"{alone} of them kill a mutant alone" in page
    assert "0" not in {row["kills"] for row in rules}


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
        "lm629.c:49:16:constant:2": "same bytes",
        "motion.c:89:47:shift:>>": "killed",
        "uart.h:14:25:constant:-1": "alive",
    }
    jobs = [job for job in jobs_of(COUNT, SEED, tried=("P24",)) if job.id in wanted]
    found = list(fates(jobs, 1))
    assert {one.id: one.what for one in found} == wanted
    assert {one.id: one.rules for one in found if one.rules} == {"motion.c:89:47:shift:>>": ("P24",)}
    assert [one.error for one in found if one.error] == [
        "motion.c:89: error 106: invalid operand for 'divide' operation"
    ]
