"""C programs of SDCC on both machines: `python -m tests.robot.ucsim.compiled --instructions 20000000`."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from miro_robot.image import load_hex
from miro_robot.mcs51.cpu import Cpu
from miro_robot.mcs51.xram import XramBus
from tests import children
from tests.robot.ucsim import s51
from tests.robot.ucsim.exclusions import ALIKE_AFTER_MOVX

SOURCE = Path(__file__).with_name("programs") / "mix.c"
MODELS = ("--model-small", "--model-large")
STRIDE = 20_000  # instructions between checkpoints
FAR_BYTES = 512  # of external RAM, all that the program uses


def build(model, folder):
    """The program's code."""
    image = folder / "mix.ihx"
    children.run(["sdcc", "-mmcs51", model, str(SOURCE), "-o", str(image)], check=True)
    return load_hex(image, limit=65536).code


def differences(code, checkpoints, stride=STRIDE):
    """What differs at the first checkpoint where something does, a line each."""
    step, dump = f"step {stride}", f"dump /b xram 0 {FAR_BYTES - 1}"
    commands = ["fill iram 0 255 0", f"fill xram 0 {FAR_BYTES - 1} 0"]
    commands += [step, *s51.OBSERVE[1:], dump] * checkpoints
    reader = s51.Reader(s51.run(code, commands))
    bus = XramBus()
    cpu = Cpu(bus)
    cpu.load(code)
    for number in range(checkpoints):
        begin = cpu.cycles
        for _ in range(stride):
            cpu.step()
        seen = reader.observed(step)
        found = list(s51.cpu_differences(seen, cpu, ALIKE_AFTER_MOVX))
        if 12 * (cpu.cycles - begin) != seen.ticks:
            found.append(f"ticks ours {12 * (cpu.cycles - begin)} ucsim {seen.ticks}")
        if bus.xram()[:FAR_BYTES] != reader.raw(dump, FAR_BYTES):
            found.append("external RAM")
        if found:
            yield f"checkpoint {number}: " + ", ".join(found)
            return


def main():
    """Prints figures; exit code 1 if anything differed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--instructions", type=int, default=20_000_000, help="of each program")
    checkpoints = -(-parser.parse_args().instructions // STRIDE)
    differing = 0
    for model in MODELS:
        begin = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            found = list(differences(build(model, Path(folder)), checkpoints))
        differing += bool(found)
        print(
            f"{SOURCE.name} {model}: {checkpoints * STRIDE} instructions, {checkpoints} checkpoints, ", end=""
        )
        print("; ".join(found) or f"no difference, {time.monotonic() - begin:.0f} s", flush=True)
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
