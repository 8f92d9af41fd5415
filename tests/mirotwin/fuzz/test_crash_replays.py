"""A crash is left as a case: its replay gives the same verdict on both engines and whatever the processor offers."""

import os
import sys
from pathlib import Path

import pytest

from miro_robot.image import load_hex
from mirotwin.fuzz.oracle import RobotOracle
from mirotwin.fuzz.target import target_for
from tests import children
from tests.mutants.build import build
from tests.mutants.draw import source_files
from tests.mutants.planted import PLANTED
from tests.mutants.sdcc import needs_sdcc

pytestmark = pytest.mark.slow

MIROTWIN = Path(sys.executable).with_name("mirotwin")
CRASHES = {
    "takes frames with a bad CRC": (b"\x0c\x09\x01\x00\x10\x00\x20\x00", "accepts_only_sent", 1),
    "lets go of a chip in the middle of a command": (b"\x05\x00\x01" + bytes(10), "no_fault", 3),
}
SPINS = (
    "motion.c",
    "    case OPCODE_FILTER:\n",
    "    case OPCODE_FILTER:\n        lm629_command(0xFF); lm629_select(1); P2 = 0;\n",
)
OFFERED = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2",
    "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX",
    "PYTHONHASHSEED": "12345",
}
"""Another processor, and another order of what has none."""


def firmware(name):
    file, right, wrong = SPINS
    if name in PLANTED:
        mistake = PLANTED[name]
        return build({mistake.file: mistake.applied(source_files()[mistake.file])}).image
    source = source_files()[file]
    assert source.count(right) == 1
    return build({file: source.replace(right, wrong)}).image


def case_of(name, folder):
    """The case file of a crash, and the image that it is about."""
    image = load_hex(firmware(name))
    data, check, _ = CRASHES[name]
    target = target_for(image)
    assert target.run(data)
    assert target.failure.check in (check, "moves_only_when_fresh")
    judged = RobotOracle(target).confirm(data, target.failure)
    case = folder / "crash.stream"
    case.write_text(judged.case())
    return case, image.path


@needs_sdcc
@pytest.mark.parametrize("name", CRASHES)
def test_a_crash_replays_to_the_same_verdict_everywhere(mirotwin, name, tmp_path):
    case, image = case_of(name, tmp_path)
    arguments = ("replay", case, "--firmware", image)
    first = mirotwin(*arguments)
    assert first[0] == CRASHES[name][2], first
    assert "fails as recorded" in first[2]
    for options, change in ((("--engine", "python"), {}), ((), OFFERED)):
        command = [MIROTWIN, *arguments, *options]
        done = children.run(command, capture_output=True, text=True, env={**os.environ, **change})
        assert (done.returncode, done.stdout, done.stderr) == first, (options, change)
