"""The host port: strobes, byte phase, busy bit, command errors, the reset handshake."""

from miro_robot.lm629.chip import SAMPLE_TICKS
from tests.robot.lm629.bench import Bench

BUSY = 480


def test_the_chip_is_dead_until_its_first_reset():
    bench = Bench()
    bench.wait(10 * SAMPLE_TICKS)
    assert bench.status() == 0x00


def test_the_reset_handshake_shows_00_then_84_then_80():
    bench = Bench()
    bench.reset(wait=False)
    assert bench.status() == 0x00
    bench.wait(3 * SAMPLE_TICKS)
    assert bench.status() == 0x84
    assert bench.signals() == 0x8184
    bench.command("RSTI", 0)
    bench.ready()
    assert bench.status() == 0x80
    assert bench.signals() == 0x0180


def test_busy_lasts_120_clocks_after_a_command_byte_and_after_the_second_byte_of_a_word():
    bench = Bench.running()
    bench.ready()

    def busy_span():
        start, spans = bench.tick, 0
        while bench.chip.status_at(start + spans) & 1:
            spans += 1
        return spans

    bench.drive(ps=0, cs=0, data=0x1C)
    bench.drive(wr=0)
    bench.chip.set_bus(bench.tick, 0, 1, 1, 0, 0x1C)
    assert busy_span() == BUSY
    bench.drive(wr=1)
    bench.drive(cs=1)
    bench.ready()
    bench.write(1, 0)
    assert bench.status() & 1 == 0
    bench.drive(ps=1, cs=0, data=0x3E)
    bench.drive(wr=0)
    bench.chip.set_bus(bench.tick, 0, 1, 1, 1, 0x3E)
    assert busy_span() == BUSY


def test_bus_access_while_busy_is_dropped_without_a_command_error():
    bench = Bench.running()
    bench.command("LPEI", 0x1234)
    bench.write(0, 0x02)  # still busy: lost
    assert bench.chip.writes_while_busy == 1
    bench.ready()
    assert bench.status() == 0x80
    bench.write(0, 0x1B)
    bench.write(1, 0x11)  # lost, and does not move the byte phase
    assert bench.chip.writes_while_busy == 2
    bench.word(0x0456)
    bench.ready()
    assert bench.chip.threshold == 0x0456
    bench.write(0, 0x0C)
    assert bench.read(1) == 0x56  # busy: the last byte that passed
    bench.ready()
    assert (bench.read(1), bench.read(1)) == (0x01, 0x80)
    assert bench.chip.writes_while_busy == 2


def test_a_command_byte_before_the_last_word_abandons_the_earlier_command():
    bench = Bench.running()
    bench.command("LTRJ", 0x002A, 0x0001, 0x0002, 0x0003)
    bench.command("DFH")
    bench.ready()
    assert bench.status() == 0x82
    buffer = bench.chip.trajectory_buffer
    assert (buffer.acceleration, buffer.velocity) == (0x00010002, 0)
    assert [opcode for _, opcode, _ in bench.chip.commands] == [0x1D, 0x02]


def test_software_reset_is_busy_for_the_reset_time_and_keeps_the_error_threshold():
    bench = Bench.running()
    bench.command("LPES", 100)
    bench.command("RESET")
    assert bench.status() == 0x01
    bench.write(0, 0x01)
    assert bench.chip.writes_while_busy == 1
    start = bench.tick
    bench.ready()
    assert abs(bench.tick - start - 3 * SAMPLE_TICKS) < 200
    assert bench.status() == 0x84
    assert bench.signals() == 0x8184
    assert bench.chip.threshold == 100
    bench.reset()
    assert bench.chip.threshold == 0x7FFF


def test_the_last_byte_is_always_on_record():
    bench = Bench.running()
    bench.command("LPEI", 0x1234)
    bench.signals()
    bench.command("LTRJ", 0x000A, 1, 2, 3, 4)
    assert [entry[1:] for entry in bench.chip.commands] == [
        (0x1D, bytes(2)),
        (0x1B, b"\x12\x34"),
        (0x0C, b"\x01\x80"),
        (0x1F, bytes.fromhex("000A 0001 0002 0003 0004")),
    ]


def test_a_write_ends_with_cs_as_well_as_with_wr():
    for last in ("cs", "wr"):
        bench = Bench.running()
        bench.ready()
        bench.drive(ps=0, cs=0, data=0x02)
        bench.drive(wr=0)
        assert not bench.chip.status_at(bench.tick) & 1
        bench.drive(**{last: 1})
        assert bench.chip.status_at(bench.tick) & 1
        assert bench.chip.commands[-1][1:] == (0x02, b"")


def test_the_byte_that_counts_is_the_one_before_the_strobe_ends():
    bench = Bench.running()
    bench.ready()
    bench.drive(ps=0, cs=0, data=0x55)
    bench.drive(wr=0)
    bench.drive(data=0x02)
    bench.drive(wr=1, data=0x77, ps=1)
    assert bench.chip.commands[-1][1:] == (0x02, b"")


def test_read_data_is_fixed_when_the_strobe_begins_and_gone_when_it_ends():
    bench = Bench.running()
    bench.command("DFH")
    assert bench.chip.data_out(bench.tick) == -1
    bench.drive(ps=0, cs=0)
    bench.drive(rd=0)
    assert bench.chip.data_out(bench.tick) == 0x81
    bench.wait(2 * BUSY)
    assert bench.chip.data_out(bench.tick) == 0x81
    bench.drive(cs=1)
    assert bench.chip.data_out(bench.tick) == -1
    bench.drive(rd=1)
    assert bench.status() == 0x80


def test_reading_when_a_write_is_due_and_writing_when_a_read_is_due_raise_the_command_error():
    bench = Bench.running()
    bench.command("LPEI")
    bench.ready()
    bench.read(1)
    assert bench.status() == 0x82
    bench.word(0x0777)
    assert bench.chip.threshold == 0x0777
    bench.command("RSTI", 0)
    bench.command("RDSIGS")
    bench.ready()
    bench.write(1, 0x12)
    assert bench.status() == 0x82
    assert (bench.read(1), bench.read(1)) == (0x01, 0x80)
