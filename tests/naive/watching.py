"""What a watched CPU did, found out from the outside: one `step()` at a time, registers read before and after.

It asks the CPU nothing but its public state, and knows an interrupt by the program counter at a vector with no
instruction executed.
"""

from collections import Counter
from typing import NamedTuple

VECTORS = {8 * source + 3: source for source in range(6)}
RETI = 0x32


class Step(NamedTuple):
    """`kind` is run, call (an interrupt's) or sleep; it began at `start` with the program counter at `pc`."""

    kind: str
    pc: int
    start: int
    end: int
    pc_after: int
    sp: int


def steps(cpu, until_cycle):
    """Everything until then; neighbouring cycles of sleep are one step."""
    found = []
    while cpu.cycles < until_cycle:
        pc, start, executed = cpu.pc, cpu.cycles, cpu.instructions
        asleep = bool(cpu.idle)
        cpu.step()
        if cpu.instructions != executed:
            found.append(Step("run", pc, start, cpu.cycles, cpu.pc, cpu.sp))
        elif cpu.pc in VECTORS and cpu.pc != pc and cpu.cycles == start + 2:
            found.append(Step("call", pc, start, cpu.cycles, cpu.pc, cpu.sp))
        elif asleep and found and found[-1].kind == "sleep":
            found[-1] = found[-1]._replace(end=cpu.cycles)
        else:
            found.append(Step("sleep", pc, start, cpu.cycles, cpu.pc, cpu.sp))
    return found


def executions(taken):
    return Counter(step.pc for step in taken if step.kind == "run")


def cycles(taken):
    total = Counter()
    for step in taken:
        if step.kind == "run":
            total[step.pc] += step.end - step.start
    return total


def routines(cpu, taken):
    """Durations of the finished interrupt routines by source, nested ones included."""
    found = {}
    serving = []
    for step in taken:
        if step.kind == "call":
            serving.append((VECTORS[step.pc_after], step.start))
        elif step.kind == "run" and cpu.code_at(step.pc) == RETI and serving:
            source, began = serving.pop()
            found.setdefault(source, []).append(step.end - began)
    return found
