"""Random single steps in lockstep with ucsim: `python -m tests.robot.ucsim.lockstep --steps 2000000`.

Each step is compared in PC, cycles, all of internal RAM and every register that both machines have; external RAM at
the end of a walk. Of two walks one is scattered: each of its steps begins in a random state of all that is compared.
The other is a program: each step begins in the state that the one before left. Walk number i of seed s is the same
wherever it runs.
"""

import argparse
import sys
import time
from collections import Counter
from typing import NamedTuple

from miro_robot.mcs51.opcodes import disassemble
from tests import children
from tests.robot.ucsim import s51, states
from tests.robot.ucsim.exclusions import COMPARED, P0
from tests.robot.ucsim.walk import PROLOGUE, Walker

_ALIGN_P0 = "set mem sfr 0x80 0xff"  # p0-after-movx
_XRAM = "dump /b xram 0 65535"


class Outcome(NamedTuple):
    """Of one walk: how often each opcode was executed, and the first difference ("" if none)."""

    seed: int
    opcodes: tuple[int, ...]
    difference: str


def compare(seed, steps):
    """One walk on both machines; those of odd seeds are scattered."""
    walk = Walker(seed, scattered=bool(seed & 1)).walk(steps)
    output = s51.run(walk.code, _commands(walk))
    counts = Counter(step.opcode for step in walk.steps)
    difference = next(_differences(walk, s51.Reader(output)), "")
    return Outcome(seed, tuple(counts[opcode] for opcode in range(256)), difference)


def _commands(walk):
    yield f"run 0 {len(PROLOGUE):#x}"
    for step in walk.steps:
        if step.state:
            yield f"set mem sfr 0x82 {step.state & 0xFF:#x} {step.state >> 8:#x}"  # DPTR
            yield f"run {states.AT:#x} {states.END:#x}"
        if step.moved:
            yield f"pc {step.pc_before:#x}"
        yield from s51.OBSERVE
        if step.movx_changed_p0:
            yield _ALIGN_P0
    yield _XRAM


def _differences(walk, reader):
    for number, step in enumerate(walk.steps):
        seen = reader.observed()
        registers = dict(zip(COMPARED, step.sfr, strict=True))
        if step.movx_changed_p0:
            del registers[P0]
        found = list(s51.differences(seen, step.pc, step.iram, registers))
        if 12 * step.cycles != seen.ticks:
            found.append(f"ticks ours {12 * step.cycles} ucsim {seen.ticks}")
        if found:
            shown = disassemble(walk.code, step.pc_before)
            yield f"step {number}, {step.pc_before:04X}h {step.opcode:02X}h {shown}: " + ", ".join(found)
    xram = reader.raw(_XRAM, 0x10000)
    for address in range(0x10000):
        if xram[address] != walk.xram[address]:
            yield f"external RAM {address:04X}h ours {walk.xram[address]:02X}h ucsim {xram[address]:02X}h"


def main():
    """Prints figures; exit code 1 if anything differed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=2_000_000, help="instructions in all")
    parser.add_argument("--walk", type=int, default=10_000, help="instructions per walk")
    parser.add_argument("--seed", type=int, default=0, help="of the first walk; the others count up")
    parser.add_argument("--jobs", type=int, default=2, help="walks at a time")
    options = parser.parse_args()
    walks = -(-options.steps // options.walk)
    seeds = range(options.seed, options.seed + walks)
    begin = time.monotonic()
    totals = [0] * 256
    differing = 0
    with children.pool(options.jobs) as pool:
        for done, outcome in enumerate(pool.map(compare, seeds, [options.walk] * walks), 1):
            totals = [total + count for total, count in zip(totals, outcome.opcodes, strict=True)]
            if outcome.difference:
                differing += 1
                print(f"walk {outcome.seed}: {outcome.difference}", flush=True)
            print(f"\r{done} of {walks} walks ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    rarest = min(range(256), key=lambda opcode: totals[opcode])
    print(
        f"{s51.version()}: {sum(totals)} single steps in {walks} walks, "
        f"{sum(1 for total in totals if total)} opcodes, the rarest ({rarest:02X}h) {totals[rarest]} times, "
        f"{differing} walks with a difference, {time.monotonic() - begin:.0f} s"
    )
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
