"""Command sequences of the data sheet, the programming guide and drivers of real chips that no other page plays."""

from fractions import Fraction

import pytest

from tests.robot.lm629.bench import Bench
from tests.robot.lm629.test_commands import moving, send

SAMPLE_S = Fraction(2048, 6_000_000)
COUNTS_PER_TURN = 2000


def test_the_unit_formulas_give_the_figures_of_the_data_sheet():
    """Its example takes 341 us for a sample; the true 341.33 give the second figures."""
    for sample_s, velocity, acceleration in ((Fraction(341, 10**6), 446_956, 15), (SAMPLE_S, 447_392, 15)):
        assert round(10 * COUNTS_PER_TURN * sample_s * 65536) == velocity
        assert round(COUNTS_PER_TURN * sample_s**2 * 65536) == acceleration


def test_the_reference_system_of_the_programming_guide_in_its_units():
    """AN-693: 8 MHz, 4000 counts a turn; 0.1 turn/s2, 0.2 turn/s, 2 turns."""
    sample_s = Fraction(2048, 8_000_000)
    assert round(Fraction(1, 10) * 4000 * sample_s**2 * 65536) == 2
    assert round(Fraction(2, 10) * 4000 * sample_s * 65536) == 0x346E


def test_initialising_with_a_software_reset():
    bench = Bench.running()
    send(bench, "00")  # busy polling is all the guard it needs
    send(bench, "1C | 0000; 1D | 0000")
    assert bench.status() == 0x80
    assert (bench.chip.signals.mask, bench.chip.hi) == (0, 0)


@pytest.mark.parametrize("word", ["0100", "0900"])
def test_the_stop_module_of_the_programming_guide(word):
    bench = moving()
    send(bench, f"1F | {word}")
    bench.sample()
    assert bench.status() & 0x80 == 0  # the STT acts, not the LTRJ
    send(bench, "01")
    bench.sample()
    assert bench.status() & 0x84 == 0x84


def test_the_threshold_of_a_published_example():
    bench = Bench.running()
    send(bench, "1B | 7F00")
    assert (bench.chip.threshold, bench.signals() & 0x0200) == (0x7F00, 0)


@pytest.mark.parametrize(("word", "velocity"), [("1808", 0x10000), ("0808", -0x10000)])
def test_velocity_alone_keeps_the_acceleration(word, velocity):
    bench = moving()
    send(bench, f"1F | {word} | 0001 0000; 01")
    bench.sample(12)
    assert bench.ask("RDDV") == velocity
    assert bench.chip.trajectory.acceleration == 0x8000


def test_the_reset_loop_that_four_drivers_share():
    """Pulse, look for 00h at once, wait for 84h or C4h, RSTI 0000h, look for 80h or C0h, else once more."""
    bench = Bench()
    for _ in range(3):
        bench.reset(wait=False)
        assert 0x00 in [bench.status() for _ in range(20)]
        bench.wait(36_000)  # 1.5 ms
        if bench.status() not in (0x84, 0xC4):
            continue
        bench.command("RSTI", 0)
        bench.ready()
        if bench.status() in (0x80, 0xC0):
            return
    pytest.fail("the loop never ends")


def test_polling_busy_before_each_byte_does_no_harm():
    bench = Bench.running()
    bench.command("SBPA")
    for byte in (0x00, 0x01, 0x02, 0x03):
        bench.ready()
        bench.write(1, byte)
    assert bench.chip.breakpoint == 0x00010203
    bench.command("RDSIGS")
    answer = []
    for _ in range(2):
        bench.ready()
        answer.append(bench.read(1))
    assert bytes(answer) == b"\x01\x80"


def command_error(bench):
    bench.ready()
    bench.write(0, 0x55)


def trajectory_complete(bench):
    bench.load(0x002A, 0x8000, 0x20000, 2)
    bench.command("STT")
    bench.sample(10)


def index_pulse(bench):
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.command("SIP")
    bench.chip.set_index(bench.tick, 0)
    bench.wait(100)
    bench.sample()


def wrap_around(bench):
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.chip.real_position = -(2**30)
    bench.turn(-4)
    bench.sample()


def excessive_error(bench):
    bench.command("LPEI", 1)
    bench.load(0x002A, 0x8000, 0x20000, 1000)
    bench.command("STT")
    bench.sample(5)


def breakpoint_reached(bench):
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.command("SBPA", 0, 4)
    bench.turn(8)
    bench.sample()


CONDITIONS = (
    command_error,
    trajectory_complete,
    index_pulse,
    wrap_around,
    excessive_error,
    breakpoint_reached,
)


@pytest.mark.parametrize(("bit", "provoke"), list(enumerate(CONDITIONS, start=1)))
def test_each_of_the_six_conditions_interrupts_by_its_own_bit_of_the_mask(bit, provoke):
    for mask, hi in ((1 << bit, 1), (0x7E & ~(1 << bit), 0)):
        bench = Bench.running()
        bench.command("MSKI", mask)
        provoke(bench)
        assert bench.chip.status & 0x7E == 1 << bit
        assert bench.chip.hi == hi == bench.signals() >> 15
        bench.command("RSTI", 0x7E & ~(1 << bit))
        bench.ready()
        assert bench.chip.hi == 0


@pytest.mark.parametrize("bit", [2, 5])
def test_the_conditions_that_switch_off_or_end_a_motion_set_their_flag_though_masked(bit):
    bench = Bench.running()
    bench.command("MSKI", 0)
    CONDITIONS[bit - 1](bench)
    assert (bench.status() >> bit & 1, bench.chip.hi) == (1, 0)
