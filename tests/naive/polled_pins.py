"""When firmware that polls sees HI of an LM629: the chip runs first, alone; then the processor, one cycle at a time.

Before each cycle the processor's pin gets the level that the chip had at S5P2, tick 9 of that cycle.
"""

from miro_exact.clock import NEVER_TICK
from miro_robot.lm629.chip import Lm629
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import Cpu

HI_PINS = 0x0C  # P3.2 and P3.3, through inverters: both chips do the same
S5P2 = 9


def hi_edges(options, reset_tick, release_tick, until_tick):
    """(tick, level) of HI; the reset pulse is all that the chip gets."""
    chip = Lm629(options)
    chip.set_reset(reset_tick, 0)
    chip.set_reset(release_tick, 1)
    edges = [(0, 0)]
    while chip.next_tick <= until_tick:
        now = chip.next_tick
        chip.advance(now)
        if chip.hi != edges[-1][1]:
            edges.append((now, chip.hi))
    return edges


def run(code, edges, cycles):
    """A processor with this program that is shown these edges; after so many cycles."""
    cpu = Cpu(Bus())
    cpu.load(code)
    cpu.rxd.settled_tick = NEVER_TICK
    shown = 0xFF
    for cycle in range(cycles):
        high = [level for tick, level in edges if tick <= 12 * cycle + S5P2][-1]
        levels = 0xFF & ~HI_PINS if high else 0xFF
        if levels != shown:
            cpu.set_external(3, levels, 12 * cycle)
            shown = levels
        if cpu.cycles == cycle:
            cpu.run(cycle + 1)
    return cpu
