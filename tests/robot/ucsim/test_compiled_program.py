"""A C program of SDCC on both machines, compared every 20000 instructions."""

import shutil
import subprocess
from pathlib import Path

import pytest
from miro_protocol import engine
from miro_robot.image import load_hex
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.xram import XramBus

from tests.robot.ucsim import s51
from tests.robot.ucsim.exclusions import COMPARED, P0

SOURCE = Path(__file__).with_name("programs") / "mix.c"
STRIDE = 20_000  # instructions between checkpoints
CHECKPOINTS = 40 if engine.active() == "compiled" else 2
FAR_BYTES = 512  # of external RAM, all that the program uses

pytestmark = pytest.mark.skipif(
    not (s51.installed() and shutil.which("sdcc")), reason="needs ucsim's s51 and sdcc"
)


@pytest.mark.parametrize("model", ["--model-small", "--model-large"])
def test_the_machines_agree_at_every_checkpoint(model, tmp_path):
    image = tmp_path / "mix.ihx"
    subprocess.run(["sdcc", "-mmcs51", model, SOURCE, "-o", image], check=True)
    code = load_hex(image, limit=65536).code
    step = f"step {STRIDE}"
    dump = f"dump /b xram 0 {FAR_BYTES - 1}"
    commands = ["fill iram 0 255 0", f"fill xram 0 {FAR_BYTES - 1} 0"]
    commands += [step, *s51.OBSERVE[1:], dump] * CHECKPOINTS
    reader = s51.Reader(s51.run(code, commands))
    bus = XramBus(lambda *_: None, lambda *_: None)
    cpu = Cpu(bus)
    cpu.load(code)
    for number in range(CHECKPOINTS):
        seen = reader.observed(step)
        xram = reader.raw(dump, FAR_BYTES)
        begin = cpu.cycles
        for _ in range(STRIDE):
            cpu.step()
        assert (number, cpu.pc, 12 * (cpu.cycles - begin)) == (number, seen.pc, seen.ticks)
        assert bytes([cpu.peek_iram(address) for address in range(256)]) == seen.iram
        differing = [
            f"{address:02X}h"
            for address in COMPARED
            if address != P0 and cpu.sfr(address) != seen.sfr[address - 0x80]
        ]
        assert differing == []
        assert bus.content()[:FAR_BYTES] == xram
