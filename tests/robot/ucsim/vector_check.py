"""Single-step vectors on ucsim: `python -m tests.robot.ucsim.vector_check DIR`, for what `tests.vectors.draw` wrote.

Vectors that `exclusions.py` rules out, or that hold pins low from outside, are not run.
"""

import sys
from pathlib import Path

from tests.robot.ucsim import s51
from tests.robot.ucsim.exclusions import ALIKE_AFTER_MOVX, COMPARED, MOVX, PSW, allowed
from tests.vectors.single_step import RESET, VectorRunner, decode

_BATCH = 2000  # vectors per start of the simulator


def comparable(vector, bench):
    """Whether ucsim is expected to agree."""
    state = vector.initial
    bench.prepare(state)
    code = dict(state.code)
    opcode, first, second = (code.get((state.pc + offset) & 0xFFFF, 0) for offset in range(3))
    return not state.pins and allowed(bench.cpu, opcode, first, second)


def differences(vectors):
    """What ucsim makes of vectors in another way, a line for each vector."""
    for begin in range(0, len(vectors), _BATCH):
        batch = vectors[begin : begin + _BATCH]
        reader = s51.Reader(s51.run(b"\x00", _commands(batch)))
        for vector in batch:
            found = list(_step_differences(vector, reader.observed(), _xram(vector, reader)))
            if found:
                yield f"{vector.name}: " + ", ".join(found)


def _commands(vectors):
    yield "fill iram 0 255 0"
    for vector in vectors:
        state = vector.initial
        yield from _set("rom", state.code)
        yield from _set("xram", state.xram)
        yield from _set("iram", state.iram)
        yield from _set("sfr", sorted(state.sfr, key=lambda cell: cell[0] != PSW))  # parity follows ACC
        yield f"pc {state.pc:#x}"
        yield from s51.OBSERVE
        for address, _ in vector.final.xram:
            yield f"dump /b xram {address} {address}"
        yield from _set("iram", [(address, 0) for address, _ in state.iram])
        yield from _set("sfr", [(address, RESET.get(address, 0)) for address, _ in state.sfr])


def _set(memory, cells):
    for address, value in cells:
        yield f"set mem {memory} {address:#x} {value:#x}"


def _xram(vector, reader):
    cells = [address for address, _ in vector.final.xram]
    return [(address, reader.raw(f"dump /b xram {address} {address}", 1)[0]) for address in cells]


def _step_differences(vector, seen, xram):
    final = vector.final
    iram, registers = dict(final.iram), {**RESET, **dict(final.sfr)}
    opcode = dict(vector.initial.code)[vector.initial.pc]
    addresses = ALIKE_AFTER_MOVX if opcode in MOVX else COMPARED
    expected = {address: registers.get(address, 0) for address in addresses}
    yield from s51.differences(seen, final.pc, [iram.get(at, 0) for at in range(256)], expected, "vector")
    if seen.ticks != 12 * len(vector.cycles):
        yield f"cycles vector {len(vector.cycles)} ucsim {seen.ticks / 12:g}"
    if xram != final.xram:
        yield f"external RAM vector {final.xram} ucsim {xram}"


def load(folder):
    return [vector for path in sorted(folder.glob("*.json")) for vector in decode(path.read_bytes())]


def main(folder):
    """Prints differences and figures; exit code 1 if there are any."""
    vectors = load(Path(folder))
    bench = VectorRunner()
    run = [vector for vector in vectors if comparable(vector, bench)]
    found = list(differences(run))
    for line in found:
        print(line)
    print(f"{s51.version()}: {len(run)} of {len(vectors)} vectors run, {len(found)} differ")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
