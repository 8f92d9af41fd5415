"""A CPU with a recording bus, and short cuts for running assembled lines on it."""

from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import REACHED, Cpu
from tests.robot.mcs51.asm import SFRS, assemble


class RecordingBus(Bus):
    """Remembers every call; external memory is a dictionary."""

    def __init__(self):
        self.ports = []
        self.reads = []
        self.writes = []
        self.faults = []
        self.sent = []
        self.memory = {}

    def port_written(self, port, latch, tick):
        self.ports.append((port, latch, tick))

    def movx_read(self, address, tick):
        self.reads.append((address, tick))
        return self.memory.get(address, 0xFF)

    def movx_write(self, address, value, tick):
        self.writes.append((address, value, tick))
        self.memory[address] = value

    def fault(self, kind, pc, tick):
        self.faults.append((kind, pc, tick))

    def byte_sent(self, value, tick):
        self.sent.append((value, tick))


def cpu_with(text):
    """A CPU that has `text` assembled at 0 and a recording bus (`cpu.bus`)."""
    cpu = Cpu(RecordingBus())
    cpu.load(assemble(text))
    return cpu


def stepped(text, steps=None):
    """... after so many steps (default: as many as there are instructions)."""
    cpu = cpu_with(text)
    lines = [line.split(";")[0].strip() for line in text.splitlines()]
    for _ in range(
        steps if steps is not None else sum(1 for line in lines if line and not line.endswith(":"))
    ):
        cpu.step()
    return cpu


def run_to_loop(text, cycles=100_000):
    """... run until it hangs in `end: SJMP $`, which is appended."""
    cpu = cpu_with(text + "\nend:\nSJMP $")
    end = len(assemble(text))
    assert cpu.run_until_any((end,), cycles) == 2, f"never came to its end: {cpu}"
    return cpu


def sfr(cpu, name):
    return cpu.sfr(SFRS[name])


def whole_and_cut(prepare, until):
    """Two CPUs of `prepare()`: one runs to cycle `until` in one piece, one stops after each cycle it can stop in."""
    whole, cut = prepare(), prepare()
    whole.run(until)
    while cut.cycles < until and cut.run(cut.cycles + 1) == REACHED:
        pass
    return whole, cut
