"""What of the product the frozen runs of bare images reach into: the one file that follows its classes."""

import shlex
from typing import Any, NamedTuple

from miro_exact.state import Flat
from miro_robot.image import load_hex
from mirotwin.firmware.bare_options import ended, load_bare_image, make_world, target_of, wire_of
from mirotwin.firmware.fw_run import FwRunOptions, run, run_world
from mirotwin.fuzz.board_target import BoardTarget
from mirotwin.fuzz.oracle import BoardOracle
from mirotwin.runs.job import load_stream
from mirotwin.runs.run import Run
from mirotwin.shell.command import _read
from mirotwin.verify.expectations import checks_alone
from tests.mirotwin.verify.own_checks import source_of
from tests.vectors.bare_runs import program_of

COUNTED = "self.subject.memory.iram[0x30]"
CHECKS = {
    "too_long": ("len(self.sent) > 2", "f'{len(self.sent)} are too many'"),
    "counts": (f"{COUNTED} > 2", f"f'it counted {{{COUNTED}}} of {{len(self.received)}}'"),
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
    options = _read(FwRunOptions, run.make_context("run", words).params)
    image = load_bare_image(options.image, options.bare, named=False)
    world = make_world(image, options.bare, target_of(options.image, image, options.bare))
    run_world(world, options.bare)
    sent = [(event.value, event.tick) for _, event in wire_of(world).log.since(0, ("heard",))]
    why = ended(world, options.bare.max_cycles)
    return _end(world, sent, f"{why}")


def run_case(entry, folder):
    """A case played again from power-on, by its file."""
    program = program_of(entry.program, folder)
    checks = []
    if entry.check:
        file = folder / f"{entry.check}.py"
        file.write_text(source_of("Own", entry.check, *CHECKS[entry.check]))
        checks = checks_alone([f"{file}:Own"])
    path = entry.data
    if isinstance(path, bytes):
        path = folder / "case.stream"
        image = load_hex(program)
        target = BoardTarget(image, entry.input, None, checks, entry.crystal_hz, entry.baud)
        assert target.run(entry.data)
        path.write_text(BoardOracle(target, {}).confirm(entry.data, target.failure).case())
    firmware = program_of(entry.other, folder, "other.ihx") if entry.other else program
    job = load_stream(f"{path}", f"{firmware}")
    again = Run(job.spec).play()
    sent = [(event.value, event.tick) for _, event in again.world.devices[0].log.since(0, ("transmitted",))]
    begin_tick = job.spec.scenario.begin_tick
    result = job.result_of_case(again)
    return _end(again.world, [one for one in sent if one[1] >= begin_tick], result.verdict, result.texts[0])


def _end(world, sent, why, verdict=""):
    board = world.devices[0].board
    flat = Flat(board.cpu)
    faults = [(int(fault.kind), fault.tick, fault.pc) for fault in world.faults[:100]]
    fields = flat.decode(flat.save())
    return End(fields, board.cpu.cycles, board.xram(), sent, faults, why, verdict)
