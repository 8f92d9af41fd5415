"""What the commands do: byte sequences of the data sheet, the programming guide and drivers of real chips, double
buffering, flags.
"""

import pytest

from miro_robot.lm629.commands import BY_NAME, COMMANDS
from tests.robot.lm629.bench import Bench

MOTOR_OFF, BREAKPOINT, EXCESS, WRAP, INDEX, COMPLETE, ERROR = 0x80, 0x40, 0x20, 0x10, 0x08, 0x04, 0x02
ON_TARGET = 0x0400  # of the signals


def send(bench, text):
    """`opcode | word word | word ...`, words in hex; several commands parted by `;`."""
    for command in text.split(";"):
        opcode, *words = command.replace("|", " ").split()
        bench.ready()
        bench.write(0, int(opcode, 16))
        for word in words:
            bench.word(int(word, 16))
    bench.ready()


def moving(acceleration=0x8000, velocity=0x20000, position=1000):
    """A position move that has run for 5 samples."""
    bench = Bench.running()
    bench.start(0x002A, acceleration, velocity, position, samples=5)
    return bench


# ------------------------------------------------------------------------------- published byte sequences


@pytest.mark.parametrize(
    ("text", "registers"),
    [
        ("1F | 002A | 0000 000F | 0006 D1EC | 0003 0D40; 01", (0xF, 0x6D1EC, 200000)),
        ("1F | 002A | 0000 0002 | 0000 346E | 0000 1F40; 01", (2, 13422, 8000)),
        ("1F | 002A | 0000 0100 | 0015 0000 | 0006 1A80; 01", (0x100, 0x150000, 400000)),
        ("1F | 000A | 0000 346E | 0000 1F40; 01", (0, 13422, 8000)),
    ],
)
def test_published_trajectories_reach_the_working_registers(text, registers):
    bench = Bench.running()
    send(bench, text)
    bench.sample()
    profile = bench.chip.trajectory
    assert (profile.acceleration, profile.max_velocity, profile.target) == registers
    assert bench.status() == 0


def test_published_filters_reach_the_working_registers_with_udf_only():
    bench = Bench.running()
    send(bench, "1E | 0008 | 000A")
    bench.sample()
    assert bench.chip.pid.kp == 0
    send(bench, "04")
    assert bench.signals() & 0x2000
    bench.sample()
    assert bench.signals() & 0x2000 == 0
    pid = bench.chip.pid
    assert (pid.kp, pid.ki, pid.kd, pid.il, pid.ds) == (10, 0, 0, 0, 0)
    send(bench, "1E | 060F | 0170 | 0322 | 0550 | 1510; 04")
    bench.sample()
    assert (pid.kp, pid.ki, pid.kd, pid.il, pid.ds) == (368, 802, 1360, 5392, 6)
    send(bench, "1E | 0000; 04")
    bench.sample()
    assert (pid.kp, pid.ds) == (368, 0)


def test_polarity_test_of_a_real_driver_gives_constant_full_drive():
    bench = Bench.running()
    send(bench, "1E | 0008 | 0870; 04; 1F | 002A | 0000 2000 | 0500 0000 | 3FFF FFFF; 01")
    bench.sample(80)
    assert bench.chip.desired_position >= 16
    for _ in range(3000):
        bench.sample()
        assert (bench.chip.sign, bench.chip.pwm_magnitude) == (0, 127)


def test_velocity_mode_words_of_the_field():
    bench = Bench.running()
    send(bench, "1F | 1828 | 0000 4000 | 0001 8000; 01")
    bench.sample(10)
    assert bench.signals() & 0x1800 == 0x1800
    assert bench.ask("RDDV") == 0x18000
    send(bench, "1F | 0808 | 0000 8000")
    assert bench.signals() & 0x1800 == 0x1800  # changes at the STT, not at the LTRJ
    send(bench, "01")
    bench.sample(20)
    assert bench.signals() & 0x1800 == 0x0800
    assert bench.ask("RDDV") == -0x8000
    assert bench.status() & COMPLETE == 0


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


# ------------------------------------------------------------------------------- starting and stopping


def test_a_move_with_a_position_alone_goes_there_from_a_target_that_was_reached():
    bench = moving(position=10)
    bench.sample(20)
    assert bench.signals() & ON_TARGET
    bench.start(0x0002, 0)
    assert bench.signals() & ON_TARGET == 0
    bench.sample(30)
    assert bench.ask("RDDP") == 0
    assert bench.signals() & ON_TARGET


def test_relative_parameters_add_to_the_working_ones_once():
    bench = moving(position=10)
    bench.sample(20)
    bench.start(0x003F, 0x100, -0x1000, -25)
    profile = bench.chip.trajectory
    assert (profile.acceleration, profile.max_velocity, profile.target) == (0x8100, 0x1F000, -15)
    bench.command("STT")
    bench.sample()
    assert profile.target == -15


def test_acceleration_loaded_in_motion_is_refused_at_stt_until_a_stop():
    bench = moving()
    bench.load(0x0020, 0x4000)
    assert bench.signals() & 0x4000
    bench.command("STT")
    bench.ready()
    assert bench.status() & ERROR
    bench.sample(3)
    assert bench.chip.trajectory.acceleration == 0x8000
    bench.start(0x0400, samples=10)
    assert bench.chip.trajectory.acceleration == 0x4000
    assert bench.signals() & (0x4000 | ON_TARGET) == ON_TARGET


@pytest.mark.parametrize("word", [0x0100, 0x0900])
def test_motor_off_drops_the_drive_and_a_new_start_begins_at_the_real_position(word):
    bench = moving()
    bench.filter(kp=1000)
    bench.sample()
    assert bench.chip.pwm_magnitude > 0
    bench.load(word)
    bench.sample()
    assert bench.status() & MOTOR_OFF == 0
    bench.command("STT")
    bench.sample()
    assert bench.status() & (MOTOR_OFF | COMPLETE) == MOTOR_OFF | COMPLETE
    assert (bench.chip.pwm, bench.chip.sign, bench.chip.pwm_magnitude) == (0, 0, 0)
    bench.turn(50)
    bench.sample()
    assert bench.ask("RDDP") == 50
    bench.start(0x0002, 50)
    assert bench.status() & MOTOR_OFF == 0
    assert bench.chip.desired_position == 50


def test_define_home_shifts_the_move_in_progress():
    bench = moving()
    bench.turn(8)
    bench.sample()
    desired = bench.ask("RDDP")
    bench.command("DFH")
    assert bench.ask("RDRP") == 0
    assert bench.ask("RDDP") - (desired - 8) in (0, 2)  # a sample may have passed
    assert bench.chip.trajectory.target == 992
    assert bench.chip.trajectory_buffer.position == 1000


def test_the_port_commands_of_the_lm628_move_bit_8_and_no_pin():
    """SNVS781C p. 23: PORT12 clears the bit, PORT8 sets it; there is no exception for the LM629."""
    bench = moving(position=1000)
    bench.filter(kp=10)
    bench.sample(30)
    driven = (bench.chip.sign, bench.chip.pwm_magnitude)
    assert driven != (0, 0)
    for command, bit in (("PORT12", 0), ("PORT8", 0x0100)):
        bench.command(command)
        assert bench.signals() & 0x0100 == bit
        assert (bench.chip.sign, bench.chip.pwm_magnitude) == driven


# ------------------------------------------------------------------------------- flags and interrupts


def command_error(bench):
    bench.ready()
    bench.write(0, 0x55)


def trajectory_complete(bench):
    bench.start(0x002A, 0x8000, 0x20000, 2, samples=10)


def index_pulse(bench):
    bench.command("SIP")
    bench.chip.set_index(bench.tick, 0)
    bench.wait(100)
    bench.sample()


def wrap_around(bench):
    bench.chip.real_position = -(2**30)
    bench.turn(-4)
    bench.sample()


def excessive_error(bench):
    bench.command("LPEI", 1)
    bench.start(0x002A, 0x8000, 0x20000, 1000, samples=5)


def breakpoint_reached(bench):
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


@pytest.mark.parametrize(("bit", "provoke"), list(enumerate(CONDITIONS, start=1)))
def test_a_flag_is_reset_by_its_own_bit_of_rsti_and_the_interrupt_with_it(bit, provoke):
    bench = Bench.running()
    bench.command("MSKI", 0x7E)
    provoke(bench)
    for word, left, hi in ((0x7E, 1 << bit, 1), (0x7E & ~(1 << bit), 0, 0)):
        bench.command("RSTI", word)
        bench.ready()
        assert (bench.chip.status & 0x7E, bench.chip.hi) == (left, hi)


def test_a_relative_breakpoint_counts_from_the_target():
    bench = moving(position=40)
    bench.command("SBPR", 0xFFFF, 0xFFF6)
    bench.ready()
    assert bench.chip.breakpoint == 30


def test_out_of_range_parameters_are_taken_modulo_their_width():
    bench = Bench.running()
    bench.load(0x002A, 0xC0000001, 0x80000002, 0x7FFFFFFF)
    bench.filter(kp=0x8001)
    bench.command("LPEI", 0xFFFF)
    bench.ready()
    buffer = bench.chip.trajectory_buffer
    assert (buffer.acceleration, buffer.velocity, buffer.position) == (1, 2, -1)
    assert bench.chip.filter_buffer.coefficients[0] == 1
    assert bench.chip.threshold == 0x7FFF


def test_the_table_has_every_opcode_once():
    assert len(COMMANDS) == len(BY_NAME) == len({command.opcode for command in COMMANDS}) == 22


def test_a_reset_selects_the_8_bit_output_again():
    bench = Bench.running()
    bench.command("PORT12")
    bench.command("RESET")
    bench.wait(30000)
    assert bench.signals() & 0x0100


def test_excessive_error_flags_or_stops():
    for name, status in (("LPEI", EXCESS), ("LPES", MOTOR_OFF | EXCESS | COMPLETE)):
        bench = moving()
        bench.filter(kp=100)
        bench.command(name, 30)
        while abs(bench.chip.desired_position - bench.chip.real_position) <= 30:
            assert bench.chip.status == 0
            bench.sample()
            if bench.chip.status:
                break
        assert bench.chip.status == status
        assert (bench.chip.pwm_magnitude == 0) == (name == "LPES")
        assert bench.signals() & 0x0200 == (0x0200 if name == "LPES" else 0)


def test_wrap_around_is_flagged_when_desired_or_real_leave_the_space():
    bench = Bench.running()
    bench.start(0x1828, 0x100000, 0x100000, samples=2)
    bench.chip.trajectory.position = (2**30 - 20) * 65536
    bench.sample()
    assert bench.status() & WRAP == 0
    bench.sample()
    assert bench.status() & WRAP
    assert bench.ask("RDDP") == -(2**30) + 12
    bench.command("RSTI", 0x006E)
    bench.chip.real_position = -(2**30)
    bench.turn(-1)
    bench.sample()
    assert bench.status() & WRAP
    assert bench.ask("RDRP") == 2**30 - 1
