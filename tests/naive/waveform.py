"""The wires of a robot, looked at on every single tick.

Moves a board on by one instruction at a time and asks every part for its level on each tick of it; nothing is
remembered but the list of changes. Which pin is wired to what is taken from the table in `robot_fw/README.md`.
"""

from miro_exact.state import TICK
from miro_robot.mcs51.opcodes import CYCLES
from miro_robot.plant import Plant

RETI = 0x32
SOURCES = ("int0", "timer0", "int1", "timer1", "serial", "timer2")


class Treadmill(Plant):
    """Turns both shafts evenly, whatever the bridges do, and reports the edges of a period at its end."""

    STATE = {"told": TICK}

    LEFT, RIGHT, PERIOD = 137, -211, 2048  # ticks a count; backward

    def __init__(self):
        super().__init__()
        self.told = 0
        self.next_tick = self.PERIOD

    @staticmethod
    def phases(tick, period):
        return ((0, 0), (1, 0), (1, 1), (0, 1))[tick // period % 4]

    def attach(self, left, right):
        self.left, self.right = left, right
        left.set_encoder(0, 0, 0)
        right.set_encoder(0, 0, 0)

    def advance(self, tick):
        for at in range(self.told + 1, tick + 1):
            for chip, period in ((self.left, self.LEFT), (self.right, self.RIGHT)):
                if self.phases(at, period) != self.phases(at - 1, period):
                    chip.set_encoder(at, *self.phases(at, period))
        self.told = max(self.told, tick)
        self.next_tick = self.told // self.PERIOD * self.PERIOD + self.PERIOD


class Sampler:
    """`changes`: per signal, (tick, level) of each change since it was first looked at. For a board with a
    `Treadmill`, a robot in slot 0 of 3, or a `cpu` alone."""

    def __init__(self, cpu, board=None):
        self.cpu = cpu
        self.board = board
        self.changes = {}
        self.routines = []

    def run(self, end_tick):
        while 12 * self.cpu.cycles < end_tick:
            self._step()

    def _step(self):
        cpu = self.cpu
        begin, executed, pc = cpu.cycles, cpu.instructions, cpu.pc
        asleep = cpu.idle or cpu.powered_down
        opcode = cpu.code_at(pc)
        latches = [cpu.sfr(0x80 + 0x10 * port) for port in range(4)]
        # No pin of a chip moves before the instruction is over, so the chips may go ahead until then. An interrupt
        # that comes instead takes two cycles.
        ahead = begin + (1 if asleep else min(CYCLES[opcode], 2))
        chips = {tick: self._chips(tick, latches) for tick in range(12 * begin, 12 * ahead)}
        if self.board is None:
            cpu.run(begin + 1)
        else:
            self.board.run(12 * begin + 1)
        chips |= {tick: self._chips(tick, latches) for tick in range(12 * ahead, 12 * cpu.cycles)}
        entered = cpu.instructions == executed and cpu.pc != pc
        if entered:
            self.routines.append((cpu.pc - 3) // 8)
        for tick in range(12 * begin, 12 * cpu.cycles):
            levels = chips[tick] | self._lines(tick, latches, chips[tick])
            levels["asleep"] = int(bool(asleep) and not entered)
            levels |= self._interrupts()
            self._note(tick, levels)
        if opcode == RETI and cpu.instructions != executed and self.routines:
            self.routines.pop()

    def _interrupts(self):
        high = [bool(self.cpu.sfr(0xB8) >> source & 1) for source in self.routines]
        levels = {f"isr_{name}": int(source in self.routines) for source, name in enumerate(SOURCES)}
        return levels | {"low_priority": int(False in high), "high_priority": int(True in high)}

    def _lines(self, tick, latches, chips):
        """RXD, TXD and all pins; slot 0, three robots."""
        cpu = self.cpu
        levels = {"rxd": cpu.rxd.level_at(tick), "txd": cpu.txd.level_at(tick)}
        shifted = cpu.peripherals.shift.data.level_at(tick)
        outside = [0xFF, 0xFF, 0xFF, 0xFC | levels["rxd"] & shifted | levels["txd"] << 1]
        if self.board is not None:
            outside[0] = chips["d"]
            outside[1] = 0xF8
            outside[3] &= 0xF3 | (1 - chips["left_hi"]) << 2 | (1 - chips["right_hi"]) << 3
        return levels | {f"p{port}_": latches[port] & outside[port] for port in range(4)}

    def _chips(self, tick, latches):
        board = self.board
        if board is None:
            return {}
        board.sync(tick)
        levels = {"d": latches[0]}
        for name, chip, period, select in (
            ("left", board.left, Treadmill.LEFT, 3),
            ("right", board.right, Treadmill.RIGHT, 4),
        ):
            a, b = Treadmill.phases(tick, period)
            pins = {"ps": 0, "rd_n": 1, "wr_n": 2, "cs_n": select, "rst_n": 5}
            outputs = {
                "busy": int(chip.port.is_busy(tick)),
                "hi": chip.hi,
                "pwm": chip.pwm,
                "sign": chip.sign,
            }
            outputs |= {"magnitude": chip.pwm_magnitude, "a": a, "b": b}
            levels |= {f"{name}_{pin}": latches[2] >> bit & 1 for pin, bit in pins.items()}
            levels |= {f"{name}_{output}": level for output, level in outputs.items()}
            if chip.data_out(tick) >= 0:
                levels["d"] &= chip.data_out(tick)
        return levels

    def _note(self, tick, levels):
        for name, level in levels.items():
            found = self.changes.setdefault(name, [])
            if not found or found[-1][1] != level:
                found.append((tick, level))
