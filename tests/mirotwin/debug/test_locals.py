"""Local variables and arguments have the values that the C source sees, or none."""

import re
from itertools import product

import pytest

from miro_exact.bad_input import BadInput
from miro_robot.image import load_hex
from mirotwin.debug.expression import content, expression
from mirotwin.runs.inspected_run import InspectedRun
from tests import children
from tests.alone import Alone
from tests.mirotwin.debug.proofs import arguments
from tests.mirotwin.debug.runs import debugger_of, robot_run
from tests.mutants.sdcc import needs_sdcc

TYPES = ("unsigned char", "int", "char *", "long", "float", "unsigned long")
OPTIONS = ([], ["--stack-auto"], ["--model-large"], ["--opt-code-size"])
KINDS = ("", "__reentrant", "__using(1)")


def value(debugger, text, frame=0):
    return content(expression(text)(debugger.moment(frame)))


def compiled(folder, source, *options):
    (folder / "program.c").write_text(source)
    command = ["sdcc", "-mmcs51", "--debug", *options, "program.c"]
    children.run(command, cwd=folder, check=True, capture_output=True)
    return debugger_of(InspectedRun(Alone(load_hex(folder / "program.ihx", limit=65536)).world))


def every_convention():
    """A program that calls functions of all kinds with arguments that it has put into globals `FUNCTION_PARAMETER`."""
    functions, calls = (
        [
            "#include <8052.h>",
            "__xdata volatile unsigned char sink; __xdata volatile long wide; __xdata unsigned long noise;",
            "void touch(void) { sink ^= 1; }",
        ],
        [],
    )
    for number, (first, kind) in enumerate(product(TYPES, KINDS)):
        name, second = f"f{number}", TYPES[number % 4]
        functions += [
            f"{first} volatile __xdata {name}_a; {second} volatile __xdata {name}_b;",
            f"void {name}({first} a, {second} b, unsigned char c) {kind}",
            "{",
            f"    unsigned char i;\n    wide = (long){'a' if first != 'float' else '(long)a'};",
            # SDCC writes no types for a function that calls nothing
            "    for (i = 0; i < 3; ++i)\n        sink += (unsigned char)c;\n    touch();",
            "    wide = (long)b;" if number % 2 else "    b = 0;\n    wide = (long)b;",
            "    c = 0;" if number % 3 else "    sink = c;",
            "}",
        ]
        calls += [
            "noise = noise * 1664525 + 1013904223;",
            f"{name}_a = ({first})(noise >> 8); {name}_b = ({second})(noise >> 3);",
            f"{name}({name}_a, {name}_b, (unsigned char){name}_b);",
        ]
    return "\n".join(
        [*functions, "void main(void)", "{", "    noise = 7;", "    for (;;) {", *calls, "    }", "}", ""]
    )


@needs_sdcc
@pytest.mark.parametrize("options", OPTIONS)
def test_arguments_have_their_values_where_a_function_begins(tmp_path, options):
    debugger = compiled(tmp_path, every_convention(), *options, "--code-size", "65536")
    names = [one.name[1:] for one in debugger.symbols.debug.functions if re.fullmatch(r"_f\d+", one.name)]
    for name in names:
        debugger.add(name)
    known = dict.fromkeys(names, 0)
    for _ in range(3 * len(names)):
        assert debugger.move("continue").startswith("breakpoint")
        name = debugger.symbols.function(debugger.cpu.pc)
        parameters = [one for one in debugger.moment().locals() if one in ("a", "b")]
        for one in parameters:
            assert value(debugger, one) == value(debugger, f"{name}_{one}"), (name, one)
        known[name] += len(parameters)
    assert min(known.values()) > 0


@needs_sdcc
@pytest.mark.parametrize("options", [[], ["--model-large"], ["--opt-code-size"]])
def test_an_argument_of_eight_bytes_has_its_value_before_its_memory_has(tmp_path, options):
    source = (
        "volatile unsigned long long sum;\nvoid touch(void) { sum ^= 1; }\n"
        "void f(unsigned long long a, char b) { touch(); sum = a + b; }\n"
        "void main(void) { f(0x123456789abcdef0ULL, 1); f(2, 3); for (;;); }\n"
    )
    debugger = compiled(tmp_path, source, *options)
    debugger.add("f", "a == 2")
    assert debugger.move("continue") == "breakpoint 1"
    assert (value(debugger, "a"), value(debugger, "b")) == (2, 3)
    debugger.go_to(0)
    debugger.breakpoints.clear()
    debugger.add("f")
    debugger.move("continue")
    assert value(debugger, "a") == 0x123456789ABCDEF0


@needs_sdcc
@pytest.mark.parametrize(
    ("options", "why"),
    [
        ([], "no debug file says where this function keeps it"),
        (["--stack-auto"], "it is in a register of the compiler's own"),
    ],
)
def test_a_bit_that_no_debug_file_places_is_said_to_be_of_the_function(tmp_path, options, why):
    source = "void touch(void) { }\nvoid f(__bit a) { touch(); if (a) touch(); }\nvoid main(void) { f(1); for (;;); }\n"
    debugger = compiled(tmp_path, source, *options)
    debugger.add("f")
    assert debugger.move("continue") == "breakpoint 1"
    with pytest.raises(BadInput, match=f"a is not live: {why}"):
        value(debugger, "a")


def test_a_condition_on_an_argument_is_met_at_the_first_call_with_it():
    debugger = debugger_of(robot_run())
    debugger.add("lm629_command", "opcode == 1")
    assert debugger.move("continue") == "breakpoint 1"
    first = debugger.timeline.tick
    assert debugger.cpu.sfr(0x82) == 1
    debugger.breakpoints.clear()
    debugger.go_to(0)
    debugger.add("lm629_command", "DPL == 1")
    assert debugger.move("continue") == "breakpoint 2"
    assert debugger.timeline.tick == first


def test_arguments_of_the_robots_firmware_are_those_that_its_functions_use():
    calls, wrong = arguments(robot_run(), 2_400_000)
    assert {("lm629_command", "opcode"), ("lm629_word", "low"), ("load_velocity", "velocity")} <= calls.keys()
    assert not wrong


STALE = """
#include <8052.h>
volatile unsigned char sink;
void address(unsigned char *p) { *p += 1; }
void counts(unsigned char first, unsigned char n)
{
    address(&sink);
    sink = first;
    while (n--)
        sink = n;
    sink = first;
}
void taken(unsigned char x)
{
    address(&x);
    sink = x;
}
unsigned char loops(unsigned char n)
{
    unsigned char i, sum = 0;

    for (i = 0; i < n; i++) {
        sum += P1;
        address(&sink);
    }
    return sum;
}
void main(void)
{
    for (;;) {
        counts(9, 5);
        taken(7);
        loops(4);
    }
}
"""


def line_of(text):
    return 1 + next(at for at, line in enumerate(STALE.splitlines()) if text in line)


@pytest.fixture
def stale(tmp_path):
    return compiled(tmp_path, STALE)


def stands_at(debugger, text):
    debugger.breakpoints.clear()
    debugger.add(f"program.c:{line_of(text)}")
    assert debugger.move("continue").startswith("breakpoint")


@needs_sdcc
def test_an_argument_that_is_counted_down_in_a_register_is_not_read_from_where_it_came(stale):
    stale.add("counts")
    stale.move("continue")
    assert (value(stale, "first"), value(stale, "n")) == (9, 5)
    stands_at(stale, "sink = n;")
    with pytest.raises(BadInput, match="n is not live: its value is not needed from here on"):
        value(stale, "n")
    assert value(stale, "first") == 9


@needs_sdcc
def test_an_argument_is_not_read_from_its_memory_before_it_has_come_there(stale):
    stale.add("taken")
    stale.move("continue")
    assert value(stale, "x") == value(stale, "taken:x") == 7
    stands_at(stale, "address(&x);")
    assert value(stale, "x") == 7
    stands_at(stale, "sink = x;")
    assert value(stale, "x") == 8


@needs_sdcc
def test_a_local_variable_has_no_value_before_one_is_assigned(stale):
    stale.add("loops")
    stale.move("continue")
    assert value(stale, "n") == 4
    for name in ("i", "sum"):
        with pytest.raises(BadInput, match=f"{name} is not live"):
            value(stale, name)
    for count in range(4):
        stands_at(stale, "sum += P1;")
        assert (value(stale, "n"), value(stale, "i")) == (4, count)


@needs_sdcc
@pytest.mark.parametrize(
    ("text", "condition", "why"),
    [
        ("sink = n;", "n == 3", "n is not live: its value is not needed from here on"),
        ("sink = n;", "sink && n || 1", "n is not live"),
        ("for (i = 0", "n == 3 && i", "i is not live"),
    ],
)
def test_a_condition_that_never_has_a_value_is_refused(stale, text, condition, why):
    with pytest.raises(BadInput, match=why):
        stale.add(f"program.c:{line_of(text)}", condition)
    assert not stale.breakpoints
