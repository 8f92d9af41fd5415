"""Random C programs on both machines: `python -m tests.robot.ucsim.csmith --programs 1000`. Needs csmith, SDCC and s51.

    csmith --seed N ──► C ──► sdcc ──► image ──┬──► twin, to its end ──┐
                                               └──► s51, as many steps ┴──► PC, RAM, registers, UART equal?

A program that SDCC refuses, that does not fit 64 KB, or that has not ended after MOST_CYCLES is counted and left out.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from miro_robot.image import load_hex
from tests import children
from tests.alone import Alone, Ended
from tests.robot.ucsim import s51
from tests.robot.ucsim.exclusions import ALIKE_AFTER_MOVX

HEADER = Path(__file__).with_name("programs")
MOST_CYCLES = 4_000_000
XRAM_BYTES = 0x2000
SHAPE = (
    "--no-safe-math --no-argc --no-longlong --no-math64 --no-packed-struct --no-volatiles --no-bitfields "
    "--no-structs --no-unions "  # SDCC passes none to functions
    "--max-funcs 3 --max-block-depth 2 --max-expr-complexity 5 "
    "--max-array-len-per-dim 5 --max-array-dim 2 --quiet --concise"
)
EQUAL, LEFT_OUT = "equal", "left out"


def build(seed, folder):
    """The image of the program with this seed; None where SDCC does not make one."""
    source = folder / "program.c"
    make = ["csmith", "--seed", f"{seed}", *SHAPE.split(), "-o", str(source)]
    children.run(make, check=True, capture_output=True, cwd=folder)  # which leaves a platform.info there
    command = ["sdcc", "-mmcs51", "--model-large", "--xram-size", f"{XRAM_BYTES}", f"-I{HEADER}"]
    done = children.run([*command, str(source)], cwd=folder, capture_output=True)
    return None if done.returncode else load_hex(folder / "program.ihx", limit=0x10000)


def differences(image):
    """What is not the same when the program has ended; None where it does not end."""
    end = image.symbols.find("_finished")
    assert end is not None
    sent = []
    machine = Alone(image, output=sent.append, stop_on_fault=False)
    if machine.run(until=end.address, max_cycles=MOST_CYCLES) is not Ended.UNTIL:
        return None
    step, dump = f"step {machine.cpu.instructions}", f"dump /b xram 0 {XRAM_BYTES - 1}"
    commands = ["fill iram 0 255 0", f"fill xram 0 {XRAM_BYTES - 1} 0", step, *s51.OBSERVE[1:], dump]
    with tempfile.TemporaryDirectory() as folder:
        heard = Path(folder, "uart")
        reader = s51.Reader(s51.run(image.code[: image.used[-1][1]], commands, heard))
        characters = heard.read_bytes()
    found = list(s51.cpu_differences(reader.observed(step), machine.cpu, ALIKE_AFTER_MOVX))
    if machine.board.xram()[:XRAM_BYTES] != reader.raw(dump, XRAM_BYTES):
        found.append("external RAM")
    if b"".join(sent) != characters:
        found.append(f"UART ours {b''.join(sent).hex(' ')} ucsim {characters.hex(' ')}")
    return found


def tried(seed):
    """The seed, and EQUAL, LEFT_OUT or what differs."""
    with tempfile.TemporaryDirectory() as folder:
        image = build(seed, Path(folder))
        found = None if image is None else differences(image)
    return seed, LEFT_OUT if found is None else "; ".join(found[:3]) or EQUAL


def main():
    """Prints figures; exit code 1 if anything differed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=int, default=1000, help="that end and are compared")
    parser.add_argument("--first", type=int, default=1, metavar="SEED")
    options = parser.parse_args()
    begin = time.monotonic()
    counts = Counter()
    with children.pool() as executor:
        seed = options.first
        while counts[EQUAL] + counts["different"] < options.programs:
            some = range(seed, seed + min(64, options.programs))
            seed = some.stop
            print(f"{dict(counts)}, {time.monotonic() - begin:.0f} s", file=sys.stderr)
            for one, what in executor.map(tried, some):
                counts[what if what in (EQUAL, LEFT_OUT) else "different"] += 1
                if what not in (EQUAL, LEFT_OUT):
                    print(f"seed {one}: {what}", flush=True)
    print(
        f"seeds {options.first} to {seed - 1}: {counts[EQUAL]} equal, {counts['different']} different,"
        f" {counts[LEFT_OUT]} left out, {time.monotonic() - begin:.0f} s"
    )
    return 1 if counts["different"] else 0


if __name__ == "__main__":
    sys.exit(main())
