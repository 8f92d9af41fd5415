"""Small C programs, built by SDCC with its debug files, for tests of what reads those."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

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


def line_of(text: str) -> int:
    """Number of the line of PROGRAM that begins so."""
    return next(
        number for number, line in enumerate(PROGRAM.splitlines(), 1) if line.strip().startswith(text)
    )


def build(folder: Path) -> Path:
    """`program.ihx` with everything that SDCC leaves beside it."""
    if shutil.which("sdcc") is None:
        assert not os.environ.get("CI"), "CI needs sdcc"
        pytest.skip("needs sdcc")
    (folder / "program.c").write_text(PROGRAM)
    command = ["sdcc", "-mmcs51", "--model-small", "--iram-size", "256", "--debug", "program.c"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "program.ihx"
