"""What a debugger finds, told from a list of all moments of a run: each instruction executed, with a shadow stack."""

from typing import NamedTuple

from miro_robot.inspect.watcher import Watcher, attach, detach
from miro_robot.mcs51.opcodes import LENGTH, is_call

RETURNS = (0x22, 0x32)


class Moment(NamedTuple):
    """Before the instruction at `pc`: in which cycle, with which calls under way, and what internal RAM held."""

    cycle: int
    pc: int
    calls: tuple
    ram: bytes


class History(Watcher):
    """All moments of a CPU while it is attached; a moment after a sleep is one of the routine that woke it."""

    def __init__(self):
        self.calls = []
        self.moments = []

    def note(self, cpu):
        ram = bytes(cpu.peek_iram(at) for at in range(256))
        self.moments.append(Moment(cpu.cycles, cpu.pc, tuple(self.calls), ram))

    def executed(self, cpu, pc, start):
        opcode = cpu.code_at(pc)
        if is_call(opcode):
            self.calls.append((pc + LENGTH[opcode], cpu.pc, False))
        elif opcode in RETURNS and self.calls:
            self.calls.pop()
        self.note(cpu)

    def interrupted(self, cpu, source, pc, start):
        self.calls.append((pc, cpu.pc, True))
        self.note(cpu)


def history(run, until_tick):
    """The moments of a run from its start on."""
    watcher = History()
    watcher.note(run.cpu)
    attach(run.cpu, watcher)
    run.to(until_tick)
    detach(run.cpu, watcher)
    return watcher.moments


def next_line(moments, now, starts, line_of):
    """Where `next` stops: the moment at which another line begins in this function, or any in its caller."""
    here = moments[now]
    depth, line = len(here.calls), line_of(here.pc)
    for moment in moments[now + 1 :]:
        if len(moment.calls) > depth or moment.pc not in starts:
            continue
        if moment.calls[:depth] != here.calls or line_of(moment.pc) != line:
            return moment
    return None
