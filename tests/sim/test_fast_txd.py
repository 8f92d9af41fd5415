"""A firmware may toggle TXD at any rate, for any time: the PC hears it piece by piece, however the run is cut."""

import itertools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_robot.image import Image, Symbols
from miro_sim.scenario import file as scenario_file
from miro_sim.world.bodies import Bodies
from miro_sim.world.network import Network
from miro_sim.world.world import World
from tests.robot.mcs51.asm import assemble
from tests.states import snapshot

SCENARIO = """
name = "fast"
duration_s = 10.0
stop_on_fault = false

[[network]]
radio = {{ latency_s = {latency_s} }}

[[network.robot]]
slot = 0
reference = {{ kind = "line", drive_s = 0.0 }}

[[network.robot]]
slot = 1
reference = {{ kind = "line", drive_s = 0.0 }}
"""
EVERY_CYCLE = "\n".join(["loop:", *["CPL TXD"] * 60, "SJMP loop"])
SLOW_AND_FAST = """
loop:
MOV R2,#{slow}
slow:
CPL TXD
MOV R3,#{wait}
wait:
DJNZ R3,wait
DJNZ R2,slow
MOV R2,#{fast}
fast:
CPL TXD
DJNZ R2,fast
SJMP loop
"""


def world(program, latency_s=0.003, seed=5):
    code = assemble(program)
    image = Image(
        Path("fast.ihx"), code.ljust(0x10000, b"\xff"), ((0, len(code)),), len(code), "", Symbols({})
    )
    return World(scenario_file.parse(SCENARIO.format(latency_s=latency_s), "fast"), seed, image)


def test_a_firmware_that_toggles_txd_in_every_cycle_runs_on():
    fast = world(EVERY_CYCLE)
    for _ in range(3):
        fast.step()
    assert fast.tick == 3 * CONTROL_PERIOD_TICKS
    assert not any(robot.board.fault_count for robot in fast.robots)
    kept = max(len(robot.board.cpu.txd.edges()) for robot in fast.networks[0].robots)
    assert kept < 0.003 * 24e6 / 12 + 2500 / 12 + 2100


class Unheard(Network):
    """All edges stay on the line until the robots have run."""

    def run(self, tick):
        for robot in self.robots:
            while robot.board.run(tick):
                robot.board.cpu.txd.hear(tick)  # so many as there are
        return False


def test_what_the_pc_hears_of_it_is_what_it_would_hear_of_one_endless_line():
    """With a line that takes a whole period there is nothing to hear early."""
    piecewise, whole = world(EVERY_CYCLE), world(EVERY_CYCLE)
    network = Unheard(whole.scenario.networks[0], whole.scenario, 0, whole.seed, whole.image, None)
    whole.networks[:] = [network]
    whole.bodies = Bodies(network.robots)
    for _ in range(2):
        assert piecewise.step() == whole.step()


@pytest.mark.parametrize("cut_ticks", [997, 24_583, 100_003, CONTROL_PERIOD_TICKS - 1])
def test_any_cutting_gives_the_same_state(cut_ticks):
    program = SLOW_AND_FAST.format(slow=3, wait=200, fast=250)
    whole, cut = world(program), world(program)
    end = CONTROL_PERIOD_TICKS + 400_000
    whole.run_to(end)
    for tick in itertools.chain(range(cut_ticks, end, cut_ticks), [end]):
        cut.run_to(tick)
    assert snapshot(cut) == snapshot(whole)
    assert whole.networks[0].uplink.now > CONTROL_PERIOD_TICKS  # it has heard something early


@pytest.mark.slow
@settings(max_examples=15)
@given(
    slow=st.integers(1, 255),
    wait=st.integers(1, 255),
    fast=st.integers(1, 255),
    latency_s=st.sampled_from([0.0, 0.0005, 0.003, 0.03]),
    cuts=st.lists(st.integers(1, 2 * CONTROL_PERIOD_TICKS - 1), max_size=6),
)
def test_any_rate_saved_and_cut_anywhere_goes_on_with_the_same_bits(slow, wait, fast, latency_s, cuts):
    program = SLOW_AND_FAST.format(slow=slow, wait=wait, fast=fast)
    whole, cut = world(program, latency_s), world(program, latency_s)
    whole.run_to(2 * CONTROL_PERIOD_TICKS - 1)
    for tick in [*sorted(cuts), 2 * CONTROL_PERIOD_TICKS - 1]:
        cut.run_to(tick)
        other = world(program, latency_s)
        other.load(cut.save())
        cut = other
    assert snapshot(cut) == snapshot(whole)
    assert cut.step().digest == whole.step().digest
