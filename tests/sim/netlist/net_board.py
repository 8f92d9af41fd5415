"""MIRO's board as a net list: the slow, obvious twin of `miro_robot.board.Board`, for tests alone.

It shows what a `Board` shows, and its state is a view: that of a `Board`, field by field, with the levels that `Board`
keeps taken from the nets. The state of the net list itself (drives and times of the parts) is not part of it.
"""

import msgspec

from miro_exact import state
from miro_exact.clock import CYCLE_TICKS
from miro_robot.board import Board
from miro_robot.build import parts_of
from miro_robot.empty_board import EmptyBoard
from miro_robot.lm629.options import Lm629Options
from miro_robot.parts.lm629 import Lm629Keys
from miro_robot.parts.resolve import resolve
from miro_robot.wired_board import WiredBoard
from miro_sim.scenario.board_file import load_board

_SIDES = ("left", "right")
_AT_CHIPS = (0xFF, 0, 0x3F, 0)  # by port, the pins that inputs of the LM629 are wired to
_SAMPLED = 9  # S5P2: the tick of a cycle at which pins are sampled


def strapped(spec, slot, robots, options):
    """The board of a robot of a network, with LM629 of these readings."""
    levels = {f"slot{bit}": slot >> bit & 1 for bit in range(3)} | {"three": int(robots == 3)}
    straps = {name: msgspec.structs.replace(strap, level=levels[name]) for name, strap in spec.straps.items()}
    parts = dict(spec.parts)
    for side in _SIDES:
        keys = Lm629Keys(options=options or Lm629Options())
        parts[side] = msgspec.structs.replace(parts[side], keys=keys)
    return msgspec.structs.replace(spec, straps=straps, parts=parts)


class NetBoard(WiredBoard):
    """What `Board` is with the same `plant`, `slot`, .. and options."""

    def __init__(self, plant, slot=0, robots=3, options=None, stop_on_fault=True, *, image, spec=None):
        spec = strapped(spec or load_board("miro"), slot, robots, options)
        netlist = resolve(spec)
        parts = parts_of(spec, netlist, 0)
        by_name = dict(zip(spec.parts, parts, strict=True))
        by_name["drive"].plant = plant
        self.plant = plant
        self.sides = [by_name["left"], by_name["right"]]
        self.left, self.right = (part.chip for part in self.sides)
        WiredBoard.__init__(self, spec, image, netlist, parts, stop_on_fault)
        self.left.tell(self.log, 0)
        self.right.tell(self.log, 1)
        self.input_tick = 0  # characters may come at any time: it never ends

    # A run of a `Board` does what is due on its last tick, too; actions come after that.

    def run(self, until_tick):
        stopped = WiredBoard.run(self, until_tick)
        self.sync(min(until_tick, self.cpu.cycles * CYCLE_TICKS) if stopped else until_tick)
        return stopped

    def run_to_any(self, addresses, until_tick):
        stopped = WiredBoard.run_to_any(self, addresses, until_tick)
        self.sync(min(until_tick, self.cpu.cycles * CYCLE_TICKS) if stopped else until_tick)
        return stopped

    def set_power(self, on):
        if on != self.powered:
            self.sync(self.cpu.cycles * CYCLE_TICKS)
        WiredBoard.set_power(self, on)

    def fault(self, kind, pc, tick):
        """A main loop without time is a fault of a robot's firmware."""
        EmptyBoard.fault(self, kind, pc, tick)

    # What a `Board` keeps of its wires.

    @property
    def bank(self):
        """Ports, of the LM629's pins those that are shorted, too; latches of MOVX (MIRO has none), a constant."""
        ports = zip(
            self.nets.latches, _AT_CHIPS, map(self.cpu.peripherals.ports.driven, range(4)), strict=True
        )
        return bytes(latch & ~mask | driven & mask for latch, mask, driven in ports) + b"\xff" * 9

    @property
    def external(self):
        return bytes(self.nets.external)

    @property
    def bus_levels(self):
        return self.nets.external[0]

    @property
    def bridge_enable(self):
        return bytes(self._wire(f"{side}.mag") for side in _SIDES)

    @property
    def bridge_sign(self):
        return bytes(self._wire(f"{side}.sign") for side in _SIDES)

    def _wire(self, net):
        return self.nets.levels[self.nets.names.index(net)]

    @property
    def busy_writes(self):
        return self.left.writes_while_busy + self.right.writes_while_busy

    @property
    def contention(self):
        return self.sides[0].contention


def settle(board):
    """Chips and plant have done what is due before the pins are sampled next.

    At the end of a run they may be short of that, and the two boards not by as much.
    """
    board.sync(board.cpu.cycles * CYCLE_TICKS + _SAMPLED)


def _entries():
    """The state of a `Board`."""
    for name, kind in state.table(Board).items():
        if isinstance(kind, type):
            yield state.Below(name, False, True)
        else:
            yield state.Group([(name, state.kind_of(kind))], name not in Board.NOT_HASHED)


state._ENTRIES[NetBoard] = list(_entries())
