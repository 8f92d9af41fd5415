"""What of the product the frozen runs of bare images reach into: the one file that follows its classes."""

import shlex
from typing import Any, NamedTuple

from miro_exact.state import Flat
from miro_robot.image import load_hex
from mirotwin.firmware.bare_options import board_of, ended, load_bare_image, make_world, target_of, wire_of
from mirotwin.firmware.fw_run import FwRunOptions, run, run_world
from mirotwin.fuzz.bare import BareTarget
from mirotwin.fuzz.oracle import BareProcessorOracle
from mirotwin.runs.bare_case import rerun_bare_case
from mirotwin.shell.command import _read
from mirotwin.verify.bare.exchange import check_named
from mirotwin.verify.bare.run import BarePlayback
from tests.vectors.bare_runs import program_of

CHECKS = {
    "too_long": """
def too_long(run):
    return f"{len(run.sent)} are too many" if len(run.sent) > 2 else None
""",
    "counts": """
def counts(run):
    received, counted = len(run.received), run.memory.iram[0x30]
    return f"it counted {counted} of {received}" if counted > 2 else None
""",
}


class End(NamedTuple):
    """The machine as a run left it. `sent`: characters with their ticks; `faults`: kind, tick and PC of each."""

    cpu: dict[str, Any]
    cycles: int
    xram: bytes
    sent: list[tuple[int, int]]
    faults: list[tuple[int, int, int]]
    why: str
    verdict: str = ""


def run_image(entry, folder):
    """`fw run` to its end."""
    program = program_of(entry.program, folder, origin=entry.origin)
    words = [f"{program}", *shlex.split(entry.options)]
    for name, text in entry.inputs.items():
        (folder / name).write_bytes(text.encode())
        words = [f"{folder / name}" if word == name else word for word in words]
    given = run.make_context("run", words, resilient_parsing=False).params
    options = _read(FwRunOptions, given)
    image = load_bare_image(options.image, options.bare, named=False)
    world = make_world(image, options.bare, target_of(options.image, image, options.bare))
    run_world(world, options.bare)
    sent = [(event.value, event.tick) for _, event in wire_of(world).log.since(0, ("heard",))]
    board, why = board_of(world), ended(world, options.bare.max_cycles)
    return _end(board.cpu, board.xram(), sent, world.faults[:100], f"{why}")


def run_case(entry, folder):
    """A case played again from power-on, by its file."""
    program = program_of(entry.program, folder)
    image = load_hex(program)
    check = None
    if entry.check:
        file = folder / f"{entry.check}.py"
        file.write_text(CHECKS[entry.check])
        check = f"{file}:{entry.check}"
    path = entry.data
    if isinstance(path, bytes):
        path = folder / "case.stream"
        judge = check_named(check) if check else None
        target = BareTarget(image, entry.input, None, judge, entry.crystal_hz, entry.baud)
        assert target.run(entry.data)
        path.write_text(BareProcessorOracle(target, judge).confirm(entry.data, target.failure).case())
    if entry.other:
        image = load_hex(program_of(entry.other, folder, "other.ihx"))
    again, verdict = rerun_bare_case(path, image, check)
    processor = BarePlayback(image, again.line, again.script, again.end_tick).play().processor
    xram, sent = processor.bus.content(), processor.bus.said
    return _end(processor.cpu, xram, sent, processor.faults, verdict.verdict, verdict.texts[0])


def _end(cpu, xram, sent, faults, why, verdict=""):
    flat = Flat(cpu)
    faults = [(int(fault.kind), fault.tick, fault.pc) for fault in faults]
    fields = flat.decode(flat.save())
    return End(fields, cpu.cycles, xram, list(sent), faults, why, verdict)
