"""A world of a board alone with a terminal, driven as `fw run` does it."""

from miro_robot.board_spec import BoardSpec
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.terminal import InputPiece, TerminalSpec
from miro_sim.world.wire import Wire
from miro_sim.world.world import World
from mirotwin.firmware.bare_options import Ended, board_of, ended, terminal_of, wire_of
from mirotwin.firmware.fw_run import dumped


class Alone:
    """`image` alone on a wire. `stdin`: bytes, or pieces."""

    STATE = {"wire": Wire}

    def __init__(
        self,
        image,
        code_in_xram=False,
        stdin=b"",
        baud=None,
        output=None,
        stop_on_fault=True,
        crystal_hz=24_000_000,
        gap_ticks=0,
        live=False,
        pins=(),
        start=0,
        wait=False,
    ):
        pieces = (InputPiece(stdin),) if isinstance(stdin, bytes) else stdin
        scenario = BoardScenario(
            board=BoardSpec(crystal_hz=crystal_hz, code_in_xram=code_in_xram, start=start),
            stop_on_fault=stop_on_fault,
            stop_at_end=True,
            terminal=TerminalSpec(
                pieces=pieces, baud=baud, gap_ticks=gap_ticks, live=live, pins=pins, wait=wait
            ),
        )
        self.world = World(scenario, 0, image)
        self.wire = wire_of(self.world)
        self.board = board_of(self.world)
        self.cpu = self.board.cpu
        self.input = terminal_of(self.world).input
        self.pins = terminal_of(self.world).pins
        self.wire.output = output

    @property
    def faults(self):
        return self.world.faults

    def run(self, until=None, max_cycles=None, pause=None):
        """To the address, the limit, the end, a fault, or for the time being to the cycle `pause`."""
        self.board.stop_at = () if until is None else (until,)
        self.world.stopped = False
        cycles = min(cycle for cycle in (max_cycles, pause, 1 << 50) if cycle is not None)
        self.world.run_to(12 * cycles)
        return ended(self.world, max_cycles)

    def dump(self):
        return dumped(self.world)


__all__ = ["Alone", "Ended"]
