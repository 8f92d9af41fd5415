"""Small C programs, built by SDCC with its debug files, for tests of what reads those."""

import os
import shutil

import pytest

from tests import children

PROGRAM = """\
#include <8052.h>
unsigned char total;
__code const unsigned char table[5] = {0xA5, 1, 2, 3, 0x12};

static void add(unsigned char value)
{
    if (value > 2)
        total += value;
    else
        total++;
}

void never(void)
{
    total = 0;
}

void main(void)
{
    unsigned char i;
    for (i = 0; i < 5; i++)
        add(table[i]);
    for (;;)
        ;
}
"""


def line_of(text):
    """Number of the line of PROGRAM that begins so."""
    return next(
        number for number, line in enumerate(PROGRAM.splitlines(), 1) if line.strip().startswith(text)
    )


def build(folder, text=PROGRAM, *options):
    """`program.ihx` with everything that SDCC leaves beside it."""
    (folder / "program.c").write_text(text)
    _sdcc(folder, *(options or ("--debug",)), "program.c")
    return folder / "program.ihx"


def build_modules(folder, *modules, options=()):
    """An image of several C files that are in `folder` already; it has the first one's name."""
    for module in modules:
        _sdcc(folder, "--debug", *options, "-c", f"{module}.c")
    _sdcc(folder, "--debug", *options, *(f"{module}.rel" for module in modules))
    return folder / f"{modules[0]}.ihx"


def _sdcc(folder, *arguments):
    if shutil.which("sdcc") is None:
        assert not os.environ.get("CI"), "CI needs sdcc"
        pytest.skip("needs sdcc")
    command = ["sdcc", "-mmcs51", "--model-small", "--iram-size", "256", *arguments]
    children.run(command, cwd=folder, check=True, capture_output=True)


CASES = "\n".join(f"    case {number}: return {(37 * number + 11) % 256};" for number in range(20))
SWITCH = f"""\
unsigned char out;
unsigned char pick(unsigned char which)
{{
    switch (which) {{
{CASES}
    }}
    return 0;
}}
void main(void)
{{
    unsigned char i;
    for (i = 0; i < 20; i++)
        out = pick(i);
    for (;;)
        ;
}}
"""
