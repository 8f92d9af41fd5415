"""A C file is cut into tokens without a remainder, SDCC's own words among them."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.mutants.c_tokens import tokens, words
from tests.mutants.draw import source_files

PIECES = (
    "#define A(b) 1",
    "#include <x.h>",
    "/* a",
    "*/",
    "// b",
    "\n",
    "\\\n",
    '"',
    "'",
    "__asm",
    "__endasm",
    "x",
    "0x1F",
)
C_TEXT = st.lists(st.sampled_from(PIECES) | st.text(max_size=4), max_size=30).map("".join)


@given(C_TEXT)
def test_the_tokens_of_any_text_are_that_text_again(text):
    found = list(tokens(text))
    assert "".join(token.text for token in found) == text
    assert all(text.startswith(token.text, token.start) for token in found)
    assert all(one.end == other.start for one, other in pairwise(found))


@pytest.mark.parametrize("file", source_files())
def test_every_file_of_the_firmware_consists_of_tokens_of_c(file):
    assert words(source_files()[file])


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
