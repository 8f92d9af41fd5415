"""The C of an interpreter's loop, reshaped by the build so that each arm jumps to the next by itself.

That the reshaped loop does the same is held by every test of the CPU, whose loop is one; here, what is left alone, and
that `mirotwin info` says whether it was done.
"""

import importlib
import importlib.util
import os
import shutil
from pathlib import Path

import pytest

from miro_exact import engine, hot_modules
from miro_exact.threaded import threaded
from tests import children

ROOT = Path(__file__).parents[2]
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
    assert threaded(plain, hot_modules.DISPATCH_MARK).count("goto *arm_of[") == 100
    said = []
    for name, text in (("plain", plain), ("threaded", threaded(plain, hot_modules.DISPATCH_MARK))):
        (tmp_path / f"{name}.c").write_text(text)
        children.run(["cc", "-o", tmp_path / name, tmp_path / f"{name}.c"], check=True)
        said.append(children.run([tmp_path / name], capture_output=True, text=True, check=True).stdout)
    assert said[0] == said[1] != "0 0\n"
    assert not hot_modules.dispatch_replicated([tmp_path / "plain"])
    assert hot_modules.dispatch_replicated([tmp_path / "plain", tmp_path / "threaded"])


def test_a_choice_in_a_function_before_does_not_hide_the_loop():
    other = "int other(int a) {\n    switch (a) {\n      case 1:\n      return 2;\n    }\n    return a;\n}\n"
    assert threaded(other + program(range(100)), hot_modules.DISPATCH_MARK).count("goto *arm_of[") == 100


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
    assert threaded(text, hot_modules.DISPATCH_MARK) == text


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
