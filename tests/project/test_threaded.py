"""C that the build reshapes: an interpreter's loop, whose arms jump to the next one themselves, and constants.

That the reshaped loop does the same is held by every test of the CPU, whose loop is one; here, what is left alone, and
that `mirotwin info` says whether it was done.
"""

import importlib
import os
import runpy
import shutil
from pathlib import Path

import pytest

from miro_exact import engine, hot_modules
from tests import children

SETUP = runpy.run_path(str(Path(__file__).parents[2] / "setup.py"))
constants, threaded = SETUP["constants"], SETUP["threaded"]
info = importlib.import_module("mirotwin.shell.info_command")  # the package has the command under this name
PROGRAM = """
#include <stdio.h>
#define unlikely(x) __builtin_expect(!!(x), 0)
int main(void) {{
  int at = 0, steps = 0, sum = 0, row, __pyx_t_1;
  while (1) {{

    /* asked before each instruction */
    __pyx_t_1 = (steps >= 1000);
    if (__pyx_t_1) {{
      goto __pyx_L4_break;
    }}
    row = (at * 7 + sum + steps) & 0x7F;
    steps = steps + 1;
    switch (row) {{
{arms}
      default: break;
    }}
    __pyx_L3_continue:;
  }}
  __pyx_L4_break:;
  printf("%d %d\\n", at, sum);
  return 0;
}}
"""


def program(arms):
    lines = (
        f"      case 0x{n:02X}:\n      at = (at + {n}) % 1009;\n      sum = (sum * 5 + at) % 10007;\n      break;"
        for n in arms
    )
    return PROGRAM.format(arms="\n".join(lines))


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_a_loop_over_many_instructions_is_threaded_and_does_the_same(tmp_path):
    plain = program(range(100))  # rows 100 to 127 have no arm
    assert threaded(plain).count("goto *arm_of[") == 100
    said = []
    for name, text in (("plain", plain), ("threaded", threaded(plain))):
        (tmp_path / f"{name}.c").write_text(text)
        children.run(["cc", "-o", tmp_path / name, tmp_path / f"{name}.c"], check=True)
        said.append(children.run([tmp_path / name], capture_output=True, text=True, check=True).stdout)
    assert said[0] == said[1] != "0 0\n"
    assert not hot_modules.dispatch_replicated([tmp_path / "plain"])
    assert hot_modules.dispatch_replicated([tmp_path / "plain", tmp_path / "threaded"])


def test_a_choice_in_a_function_before_does_not_hide_the_loop():
    other = "int other(int a) {\n    switch (a) {\n      case 1:\n      return 2;\n    }\n    return a;\n}\n"
    assert threaded(other + program(range(100))).count("goto *arm_of[") == 100


@pytest.mark.parametrize(
    "text",
    [
        program(range(10)),
        program(range(250, 350)),
        program(range(100)).replace("default: break;", "default: at = 1;"),
        program(range(100)).replace("while (1)", "if (1)"),
        program(range(100)).replace("__pyx_L3_continue:;", "at = 2;"),
    ],
    ids=["few arms", "rows above a byte", "an else", "no loop", "something after the choice"],
)
def test_anything_else_stays_as_it_is(text):
    assert threaded(text) == text


@pytest.mark.skipif(engine.active() != "compiled", reason="nothing is compiled")
@pytest.mark.skipif(os.name == "nt", reason="labels as values are of GCC and Clang")
def test_the_loop_of_the_cpu_that_is_installed_is_threaded():
    """Fails where Cython writes other C than `threaded` knows: see there."""
    assert hot_modules.dispatch_replicated(engine.install().compiled())


@pytest.mark.parametrize(
    ("mark", "said"),
    [
        (hot_modules.DISPATCH_MARK, "dispatch replicated"),
        (b"", f"dispatch plain: slower, the same bits; {info.PLAIN_REMEDY}"),
    ],
)
def test_info_says_whether_the_loop_is_threaded(mark, said, tmp_path, monkeypatch):
    compiled = tmp_path / "execute.so"
    compiled.write_bytes(b"\x7fELF" + mark + b"\0")
    monkeypatch.setattr(engine.EngineFinder, "compiled", lambda self: [compiled])
    assert info._engine_line("compiled").endswith(f" modules), {said}")


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
