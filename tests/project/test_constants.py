"""Names that a module sets once, to a number, are constants in its C."""

import pytest

from miro_exact.threaded import constants


def c_of(c_type, *settings):
    start = "".join(f"  __pyx_v_4miro__A = {setting};\n" for setting in settings)
    return f"static {c_type} __pyx_v_4miro__A;\nint f() {{ return __pyx_v_4miro__A; }}\nvoid start() {{\n{start}}}\n"


@pytest.mark.parametrize(
    ("c_type", "number"),
    [("int", "-1"), ("int", "0x140"), ("PY_LONG_LONG", "24000000"), ("double", "-1.9e-05")],
)
def test_a_name_that_is_set_once_to_a_number_is_a_constant(c_type, number):
    assert constants(c_of(c_type, number)) == (
        f"static {c_type} const __pyx_v_4miro__A = {number};\n"
        "int f() { return __pyx_v_4miro__A; }\nvoid start() {\n}\n"
    )


def test_names_that_are_set_together_are_constants():
    names = "__pyx_v_4miro__A", "__pyx_v_4miro__B"
    declared = "".join(f"static int {name};\n" for name in names)
    start = "  __pyx_t_1 = 0x88;\n\n  __pyx_t_2 = 3;\n\n"
    text = f"{declared}{start}  {names[0]} = __pyx_t_1;\n  {names[1]} = __pyx_t_2;\n  __pyx_t_1 = 7;\n"
    assert constants(text) == (
        f"static int const {names[0]} = 0x88;\nstatic int const {names[1]} = 3;\n{start}  __pyx_t_1 = 7;\n"
    )


def test_a_temporary_that_is_no_number_makes_no_constant():
    text = "  __pyx_t_1 = 7;\n  __pyx_t_1 = f();\n" + c_of("int", "__pyx_t_1")
    assert constants(text) == text


@pytest.mark.parametrize("settings", [("__pyx_t_1",), ("1", "2"), ("1", "__pyx_t_1"), ()])
def test_a_name_that_is_set_otherwise_stays_a_variable(settings):
    text = c_of("int", *settings)
    assert constants(text) == text


def test_what_is_done_already_stays_as_it_is():
    once = constants(c_of("int", "7"))
    assert constants(once) == once
