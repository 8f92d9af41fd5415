"""Every rule that was chosen can be read the other way, and then the chip does otherwise."""

from pathlib import Path

import msgspec
import pytest

from miro_exact.state import restore, snapshot, values
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.options import CHOICES, LENGTHS, Lm629Options
from tests.robot.lm629.bench import Bench

MOTOR_OFF, BREAKPOINT, EXCESS, COMPLETE, ERROR = 0x80, 0x40, 0x20, 0x04, 0x02
ACQUIRE_INDEX = 0x0001
README = Path(__file__).parents[3] / "robot_fw/miro_robot/lm629/README.md"


def flags(bench):
    bench.ready()
    return bench.chip.status


def busy_ticks(bench):
    bench.ready()
    bench.write(0, 0x02)
    return sum(bench.chip.status_at(bench.tick + n) & 1 for n in range(1000))


def lost_writes(bench):
    """A strobe that begins while the chip is busy and ends when it no longer is."""
    bench.command("DFH")
    bench.drive(ps=0, data=0x02, cs=0)
    bench.drive(wr=0)
    bench.wait(1000)
    bench.drive(wr=1)
    return bench.chip.writes_while_busy


def mask_after_one_byte(bench):
    """Half a word for LPEI, then MSKI and a single byte."""
    bench.command("LPEI")
    bench.ready()
    bench.write(1, 0x12)
    bench.command("MSKI")
    bench.ready()
    bench.write(1, 0x34)
    return bench.chip.signals.mask


def threshold_after_one_byte(bench):
    """The same with LPEI, whose value is the whole word."""
    bench.command("MSKI")
    bench.ready()
    bench.write(1, 0x12)
    bench.command("LPEI")
    bench.ready()
    bench.write(1, 0x34)
    return bench.chip.threshold


def error_after(*steps):
    def run(bench):
        bench.ready()
        for name, *arguments in steps:
            getattr(bench, str(name))(*arguments)
        return flags(bench) & ERROR

    return run


def velocity_too_large(bench):
    bench.load(0x0008, 0x80000002)
    return bench.chip.trajectory_buffer.velocity


def hi_when_unmasked_later(bench):
    bench.command("MSKI", 0)
    move(bench, position=2)
    bench.sample(10)
    bench.command("MSKI", COMPLETE)
    return bench.chip.hi


def move(bench, position=1000, samples=5):
    bench.load(0x002A, 0x8000, 0x20000, position)
    bench.command("STT")
    bench.sample(samples)
    return bench


def excess_again(bench):
    move(bench)
    bench.command("LPEI", 1)
    bench.sample()
    bench.command("RSTI", 0)
    bench.sample()
    return bench.chip.status & EXCESS


def after_reset(what, samples=0):
    def run(bench):
        bench.wait(1000)
        bench.reset()
        bench.sample(samples)
        return what(bench)

    return run


def ticks_to_84h(bench):
    bench.reset(wait=False)
    ticks = 0
    while bench.chip.status_at(bench.tick) != 0x84:
        bench.wait(4)
        ticks += 4
    return ticks


def status_while_resetting(bench):
    bench.command("RESET")
    return bench.status()


def after_software_reset(bit, *before):
    def run(bench):
        for name, *arguments in before:
            bench.command(str(name), *arguments)
        bench.command("RESET")
        bench.wait(30_000)
        return bench.signals() & bit

    return run


def status_after_a_short_pulse(bench):
    bench.chip.set_reset(bench.tick, 0)
    bench.chip.set_reset(bench.tick + 28, 1)
    bench.wait(30_000)
    return bench.status()


def target_loaded_after_stt(bench):
    bench.load(0x002A, 0x8000, 0x20000, 1000)
    bench.sample()
    bench.command("STT")
    bench.load(0x0002, 77)
    bench.sample()
    return bench.chip.trajectory.target


def stop_with_new_acceleration(bench):
    move(bench)
    bench.load(0x0420, 0x4000)
    bench.command("STT")
    return flags(bench) & ERROR


def velocity_at_the_second_stt(bench):
    move(bench)
    bench.load(0x0400)
    bench.command("STT")
    bench.sample(10)
    bench.command("STT")
    bench.sample()
    return bench.chip.desired_velocity


def velocity_not_sent(bench):
    move(bench)
    bench.load(0x0008, 0x30000)
    bench.load(0x0002, 2000)
    bench.command("STT")
    bench.sample()
    return bench.chip.trajectory.max_velocity


def relative_velocity(bench):
    move(bench)
    bench.load(0x0008, 0x30000)
    bench.load(0x000C, 0x100)
    return bench.chip.trajectory_buffer.velocity


def relative_position(bench):
    move(bench)
    desired = bench.chip.desired_position
    bench.load(0x0003, 100)
    bench.command("STT")
    bench.sample()
    assert desired == bench.chip.desired_position - (bench.chip.desired_velocity >> 16)
    return bench.chip.trajectory.target - 100


def turned(bench, counts):
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.sample()
    bench.turn(counts)
    return bench


def target_after_home(bench):
    turned(bench, 8).sample()
    bench.load(0x0002, 100)
    bench.command("DFH")
    return bench.chip.trajectory_buffer.position


def held_after_an_abrupt_stop(bench):
    move(bench)
    bench.load(0x0200)
    bench.command("STT")
    bench.sample()
    return bench.chip.desired_position


def fraction_after_a_smooth_stop(bench):
    bench.load(0x002A, 0x3000, 0x21000, 1000)
    bench.command("STT")
    bench.sample(5)
    bench.load(0x0400)
    bench.command("STT")
    bench.sample(20)
    assert bench.chip.status & COMPLETE
    return bench.chip.trajectory.position & 0xFFFF


def passed_breakpoint(bench):
    bench.command("SBPA", 0, 5)
    turned(bench, 8).sample()
    return bench.chip.status & BREAKPOINT


def position_between_samples(bench):
    return turned(bench, 8).ask("RDRP")


def closed(bench, error, samples=1, **coefficients):
    """The loop closed with a constant error."""
    bench.filter(**coefficients)
    bench.load(0x0200)
    bench.command("STT")
    bench.sample()
    bench.command("RSTI", 0)
    bench.sample()
    bench.chip.trajectory.position = error * 65536
    bench.sample(samples)
    return bench


def drive(error, **coefficients):
    def run(bench):
        closed(bench, error, **coefficients)
        return bench.chip.sign, bench.chip.pwm_magnitude

    return run


def rdsum(error, samples, **coefficients):
    def run(bench):
        closed(bench, error, samples, **coefficients)
        return bench.ask("RDSUM")

    return run


def remembers_in_open_loop(bench):
    closed(bench, 3000, 3, ki=10, il=1000)
    bench.load(0x0100)
    bench.command("STT")
    bench.sample(2)
    return bench.chip.pid.error_sum != 0


def remembers_over_udf(bench):
    closed(bench, 300, 5, ki=10, il=1000)
    bench.command("UDF")
    bench.sample()
    return bench.chip.pid.error_sum > 1000


def excess_beyond_16_bits(bench):
    return closed(bench, 40000, kp=1).chip.status & EXCESS


def first_edges(bench):
    closed(bench, 26, kp=10)
    start = bench.tick
    bench.edges.clear()
    bench.note(start)
    bench.wait(2047)
    return [(tick - start, pwm) for tick, pwm, _, _ in bench.edges]


def sign_when_switched_off(bench):
    closed(bench, -26, kp=10)
    bench.load(0x0100)
    bench.command("STT")
    bench.sample()
    return bench.chip.sign


def eight_bit_output(bench):
    bench.command("PORT12")
    return bench.signals() & 0x0100


def both_phases_at_once(bench):
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.wait(100)
    bench.chip.set_encoder(bench.tick, 1, 1)
    bench.wait(100)
    bench.sample()
    return bench.chip.real_position


def counts_of_a_short_state(bench):
    bench.chip.set_encoder(bench.tick, 0, 0)
    bench.wait(100)
    bench.chip.set_encoder(bench.tick, 1, 0)
    bench.wait(16)
    bench.chip.set_encoder(bench.tick, 1, 1)
    bench.wait(100)
    bench.sample()
    return bench.chip.real_position


READINGS = (
    ("busy_clocks", 160, busy_ticks, 480 - 24, 640 - 24),
    ("busy_judged", "end", lost_writes, 1, 0),
    ("command_resets_phase", False, mask_after_one_byte, 0x3E, 0x34),
    ("command_resets_phase", False, threshold_after_one_byte, 0x7FFF, 0x1234),
    ("unknown_opcode_flags", False, error_after(("write", 0, 0x55)), ERROR, 0),
    ("undue_data_flags", False, error_after(("write", 1, 0x55)), ERROR, 0),
    ("undue_data_flags", False, error_after(("read", 1)), ERROR, 0),
    ("unfinished_flags", False, error_after(("command", "LPEI"), ("command", "DFH")), ERROR, 0),
    ("status_read_flags", True, error_after(("command", "LPEI"), ("ready",)), 0, ERROR),
    ("range_flags", True, error_after(("command", "LPEI", 0x8000)), 0, ERROR),
    ("range_flags", True, error_after(("command", "LFIL", 8, 0x8000)), 0, ERROR),
    ("range_flags", True, error_after(("load", 0x0020, 0x40000000)), 0, ERROR),
    ("range_flags", True, error_after(("load", 0x0002, 0x40000000)), 0, ERROR),
    ("out_of_range", "clamped", velocity_too_large, 2, 0x3FFFFFFF),
    ("interrupt", "level", hi_when_unmasked_later, 0, 1),
    ("error_flag_repeats", False, excess_again, EXCESS, 0),
    ("reset_interrupts", False, after_reset(lambda bench: bench.signals()), 0x8184, 0x0184),
    ("reset_clocks", 50, ticks_to_84h, 24576, 200),
    ("software_reset_busy", False, status_while_resetting, 0x01, 0x00),
    ("reset_disarms_breakpoint", False, after_reset(lambda bench: bench.chip.status, 1), 0x84, 0xC4),
    (
        "reset_restarts_samples",
        False,
        after_reset(lambda bench: bench.chip.sample_tick % 8192 == 0),
        False,
        True,
    ),
    ("reset_clears_lpes", False, after_software_reset(0x0200, ("LPES", 100)), 0, 0x0200),
    ("reset_clears_index", False, after_software_reset(0x0001, ("SIP",)), 0, 0x0001),
    ("reset_pulse_clocks", 7, status_after_a_short_pulse, 0x00, 0x84),
    ("start_takes", "sample", target_loaded_after_stt, 1000, 77),
    ("stop_lifts_refusal", False, stop_with_new_acceleration, 0, ERROR),
    ("stop_bits_stay", True, velocity_at_the_second_stt, 0x8000, 0),
    ("unsent", "working", velocity_not_sent, 0x30000, 0x20000),
    ("relative_rates", "buffer", relative_velocity, 0x20100, 0x30100),
    ("relative_base", "desired", relative_position, 1000, 7),
    ("relative_base", "real", relative_position, 1000, 0),
    ("home_shifts_buffer", True, target_after_home, 100, 92),
    ("abrupt_stop_at", "desired", held_after_an_abrupt_stop, 0, 7),
    ("stop_keeps_fraction", True, fraction_after_a_smooth_stop, 0, 0xB000),
    ("breakpoint_exact", True, passed_breakpoint, BREAKPOINT, 0),
    ("read_position", "live", position_between_samples, 0, 8),
    ("pid_saturates", False, drive(0x7FFF, kp=0x0870), (0, 127), (1, 9)),
    ("sum_reading", "sum", rdsum(10000, 2, ki=1000, il=500), 500, 78),
    ("sum_rounding", "zero", rdsum(-1, 1, ki=100, il=1000), -100, 0),
    ("open_loop_clears", False, remembers_in_open_loop, False, True),
    ("update_clears", True, remembers_over_udf, True, False),
    ("error_test", "saturated", excess_beyond_16_bits, EXCESS, 0),
    ("output_rounding", "zero", drive(-1, kp=10), (1, 1), (0, 0)),
    ("sign_of_negative", 0, drive(-26, kp=10), (1, 2), (0, 2)),
    ("pulse_at", "end", first_edges, [(0, 1), (16, 0)], [(0, 0), (2032, 1)]),
    ("off_keeps_sign", True, sign_when_switched_off, 0, 1),
    ("port12_clears", False, eight_bit_output, 0, 0x0100),
    ("double_step", 2, both_phases_at_once, 0, 2),
    ("double_step", -2, both_phases_at_once, 0, -2),
    ("filter_clocks", 4, counts_of_a_short_state, 0, 2),
)


@pytest.mark.parametrize(("field", "other", "observe", "by_default", "otherwise"), READINGS)
def test_the_other_reading_of_a_rule_does_otherwise(field, other, observe, by_default, otherwise):
    assert observe(Bench.running()) == by_default
    assert observe(Bench.running(**{field: other})) == otherwise
    assert by_default != otherwise


def test_every_option_is_observed_and_documented():
    fields = set(Lm629Options.__struct_fields__)
    assert {field for field, *_ in READINGS} == fields
    assert {field for field in fields if f"`{field}`" not in README.read_text()} == set()
    assert {name for name, *_ in LENGTHS} | set(CHOICES) == fields


def test_options_come_from_plain_values_and_say_what_they_may_be():
    assert msgspec.convert({"interrupt": "level", "double_step": -2}, Lm629Options) == Lm629Options(
        interrupt="level", double_step=-2
    )
    with pytest.raises(msgspec.ValidationError, match="busy_clock"):
        msgspec.convert({"busy_clock": 1}, Lm629Options)
    with pytest.raises(ValueError, match="sign_of_negative must be one of 1, 0, not 2"):
        Lm629Options(sign_of_negative=2)
    with pytest.raises(ValueError, match=r"busy_clocks must be 0\.\.1048576 clocks, not -1"):
        Lm629Options(busy_clocks=-1)


def test_an_index_caught_before_a_reset_ends_the_wait_for_it():
    """SNVS781, RDSIGS: bit 0 stays set until the next index pulse, so no wait is left that R6 could keep."""
    for reset in ("command", "pin"):
        bench = Bench.running(reset_clears_index=False)
        bench.chip.set_encoder(bench.tick, 0, 0)
        bench.command("SIP")
        bench.chip.set_index(bench.tick, 0)
        bench.wait(64)
        if reset == "command":
            bench.command("RESET")
        else:
            bench.chip.set_reset(bench.tick, 0)
        assert bench.chip.signals.word & ACQUIRE_INDEX == 0


def test_a_chip_with_other_readings_is_saved_with_what_they_need():
    options = Lm629Options(error_flag_repeats=False)
    bench = Bench(Lm629(options))
    bench.reset()
    assert excess_again(bench) == 0
    other = Lm629(options)
    restore(other, snapshot(bench.chip))
    other.advance(bench.chip.sample_tick)
    bench.sample()
    assert snapshot(other) == snapshot(bench.chip)
    assert values(other)["excessive"] == 1
