"""A mutant differs from its text in one small place, and every place where an operator applies is found."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.mutants.c_tokens import words
from tests.mutants.draw import mutants_of, source_files
from tests.mutants.operators import OPERATORS, changes

SOURCES = source_files()
MUTANTS = mutants_of(SOURCES)
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
