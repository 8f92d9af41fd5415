"""Every rule that was chosen can be read the other way, and then the chip does otherwise."""

import re
from operator import attrgetter
from pathlib import Path

import msgspec
import pytest

from docs.site import tables
from miro_robot.lm629.chip import Lm629
from miro_robot.lm629.options import CHOICES, LENGTHS, Lm629Options
from tests.robot.lm629.bench import Bench
from tests.states import restore, snapshot, values

MOTOR_OFF, BREAKPOINT, EXCESS, COMPLETE, ERROR = 0x80, 0x40, 0x20, 0x04, 0x02
ACQUIRE_INDEX = 0x0001
MARK = "<!-- readings: miro_robot.lm629.options:Lm629Options -->"
README = Path(__file__).parents[3] / "robot_fw/miro_robot/lm629/README.md"


def play(bench, steps):
    """Steps are methods of a bench with their arguments; a dictionary at the end has named ones."""
    for name, *arguments in steps:
        named = arguments.pop() if arguments and isinstance(arguments[-1], dict) else {}
        getattr(bench, name)(*arguments, **named)


def seen(bench, what):
    """Fields of the chip, or what a function makes of the bench."""
    return what(bench) if callable(what) else attrgetter(*what.split())(bench.chip)


def status(bit):
    def of(bench):
        bench.ready()
        return bench.chip.status & bit

    return of


def signals(bit):
    return lambda bench: bench.signals() & bit


def asked(name):
    return lambda bench: bench.ask(name)


def remembers_errors(bench):
    return bench.chip.pid.error_sum > 1000


def fraction_at_the_end(bench):
    assert bench.chip.status & COMPLETE
    return bench.chip.trajectory.position & 0xFFFF


class ReadingBench(Bench):
    def phases(self, a, b, ticks=100):
        self.chip.set_encoder(self.tick, a, b)
        self.wait(ticks)

    def byte(self, name, byte):
        """A command and half a word of its data."""
        self.command(name)
        self.ready()
        self.write(1, byte)

    def short_reset(self):
        self.chip.set_reset(self.tick, 0)
        self.chip.set_reset(self.tick + 28, 1)
        self.wait(30_000)


def busy_ticks(bench):
    return sum(bench.chip.status_at(bench.tick + n) & 1 for n in range(1000))


def ticks_to_84h(bench):
    ticks = 0
    while bench.chip.status_at(bench.tick) != 0x84:
        bench.wait(4)
        ticks += 4
    return ticks


def first_edges(bench):
    start = bench.tick
    bench.edges.clear()
    bench.note(start)
    bench.wait(2047)
    return [(tick - start, pwm) for tick, pwm, _, _ in bench.edges]


DRIVE = "sign pwm_magnitude"
STANDS = "desired_position trajectory.target status"
MOVE = ("start", 0x002A, 0x8000, 0x20000, 1000, {"samples": 5})
ARRIVE = ("start", 0x002A, 0x8000, 0x20000, 2, {"samples": 15})
SMOOTH_STOP = ("start", 0x0400, {"samples": 20})
FASTER = ("load", 0x0008, 0x30000)
DFH, SIP, STT, UDF = (("command", name) for name in ("DFH", "SIP", "STT", "UDF"))
RSTI = [("command", "RSTI", 0), ("ready",)]
RESET_PIN = [("wait", 1000), ("reset",)]
SOFTWARE_RESET = [("command", "RESET"), ("wait", 30_000)]
LATE_STROBE = [DFH, ("drive", {"ps": 0, "cs": 0, "wr": 0}), ("wait", 1000), ("drive", {"wr": 1})]
AGAIN = [MOVE, ("command", "LPEI", 1), ("sample",), ("command", "RSTI", 0), ("sample",)]
LOADED_LATE = [("load", 0x2A, 0x8000, 0x20000, 1000), ("sample",), STT, ("load", 2, 77), ("sample",)]
ONWARD = [("sample",), ("load", 0x0003, 300), STT]
STOPPED = [("start", 0x002A, 0x3000, 0x21000, 1000, {"samples": 5}), SMOOTH_STOP]
TURNED = [("sample",), ("turn", 8)]
WOUND_UP = ("closed", 300, 5, {"ki": 10, "il": 1000})
SHORT_STATE = [("phases", 0, 0), ("phases", 1, 0, 16), ("phases", 1, 1), ("sample",)]
BOTH_AT_ONCE = [("phases", 0, 0), ("phases", 1, 1), ("sample",)]
READINGS = (  # option, its other reading, what is done, what is looked at, what it is by default, and otherwise
    ("busy_clocks", 160, [("ready",), ("write", 0, 0x02)], busy_ticks, 480 - 24, 640 - 24),
    ("busy_judged", "end", LATE_STROBE, "writes_while_busy", 1, 0),
    ("command_resets_phase", False, [("byte", "LPEI", 0x12), ("byte", "MSKI", 0x34)], "signals.mask", 0x3E, 0x34),
    ("command_resets_phase", False, [("byte", "MSKI", 0x12), ("byte", "LPEI", 0x34)], "threshold", 0x7FFF, 0x1234),
    ("unknown_opcode_flags", False, [("ready",), ("write", 0, 0x55)], status(ERROR), ERROR, 0),
    ("undue_data_flags", False, [("ready",), ("write", 1, 0x55)], status(ERROR), ERROR, 0),
    ("undue_data_flags", False, [("ready",), ("read", 1)], status(ERROR), ERROR, 0),
    ("unfinished_flags", False, [("command", "LPEI"), DFH], status(ERROR), ERROR, 0),
    ("status_read_flags", True, [("command", "LPEI"), ("ready",)], status(ERROR), 0, ERROR),
    ("range_flags", True, [("command", "LPEI", 0x8000)], status(ERROR), 0, ERROR),
    ("range_flags", True, [("command", "LFIL", 8, 0x8000)], status(ERROR), 0, ERROR),
    ("range_flags", True, [("load", 0x0020, 0x40000000)], status(ERROR), 0, ERROR),
    ("range_flags", True, [("load", 0x0002, 0x40000000)], status(ERROR), 0, ERROR),
    ("out_of_range", "clamped", [("load", 8, 0x80000002)], "trajectory_buffer.velocity", 2, 0x3FFFFFFF),
    ("interrupt", "event", [("command", "MSKI", 0), ARRIVE, ("command", "MSKI", COMPLETE)], "hi", 1, 0),
    ("interrupt", "event", [ARRIVE, ("command", "RSTI", 0x7E), ("ready",)], "hi", 1, 0),
    ("hi_falls", "latch", [ARRIVE, ("command", "RSTI", 0)], "hi", 1, 0),
    ("hi_falls", "latch", [ARRIVE, ("command", "MSKI", 0)], "hi", 1, 0),
    ("error_flag_repeats", False, AGAIN, status(EXCESS), EXCESS, 0),
    ("reset_interrupts", False, RESET_PIN, signals(0xFFFF), 0x8184, 0x0184),
    ("reset_clocks", 50, [("reset", False)], ticks_to_84h, 24576, 200),
    ("software_reset_busy", False, [("command", "RESET")], Bench.status, 0x01, 0x00),
    ("reset_breakpoint", "fires", [*RESET_PIN, ("sample",)], "status", 0x84, 0xC4),
    ("reset_breakpoint", "stays", RESET_PIN, "status", 0x84, 0xC4),
    ("reset_breakpoint", "stays", [*RESET_PIN, *RSTI], "status", 0x80, 0xC0),
    ("reset_restarts_samples", False, RESET_PIN, lambda bench: bench.chip.sample_tick % 8192 == 0, False, True),
    ("reset_clears_lpes", False, [("command", "LPES", 100), *SOFTWARE_RESET], signals(0x0200), 0, 0x0200),
    ("reset_clears_index", False, [SIP, *SOFTWARE_RESET], signals(ACQUIRE_INDEX), 0, ACQUIRE_INDEX),
    ("reset_pulse_clocks", 7, [("short_reset",)], Bench.status, 0x00, 0x84),
    ("start_takes", "sample", LOADED_LATE, "trajectory.target", 1000, 77),
    ("start_shows", "sample", [MOVE, ("load", 0x1808, 1), STT], signals(0x1800), 0x1800, 0),
    ("start_shows", "sample", [ARRIVE, STT], signals(0x0400), 0, 0x0400),
    ("start_shows", "sample", [("load", 0x0002, 9), STT], signals(0x0080), 0, 0x0080),
    ("second_start", "follows", [*ONWARD, *ONWARD[1:], ("sample",)], "trajectory.target", 300, 600),
    ("breakpoint_base", "working", [*ONWARD, ("command", "SBPR", 0, 9), ("ready",)], "breakpoint", 309, 9),
    ("stop_lifts_refusal", False, [MOVE, ("load", 0x0420, 0x4000), STT], status(ERROR), 0, ERROR),
    ("stop_bits_stay", True, [MOVE, SMOOTH_STOP, STT, ("sample",)], "desired_velocity", 0x8000, 0),
    ("unsent", "working", [MOVE, FASTER, ("start", 2, 2000)], "trajectory.max_velocity", 0x30000, 0x20000),
    ("relative_rates", "buffer", [MOVE, FASTER, ("load", 0xC, 0x100)], "trajectory_buffer.velocity", 0x20100, 0x30100),
    ("relative_base", "desired", [MOVE, ("start", 3, 100)], "trajectory.target", 1100, 107),
    ("relative_base", "real", [MOVE, ("start", 3, 100)], "trajectory.target", 1100, 100),
    ("home_shifts_buffer", True, [*TURNED, ("sample",), ("load", 2, 100), DFH], "trajectory_buffer.position", 100, 92),
    ("abrupt_stop_at", "desired", [MOVE, ("start", 0x0200)], STANDS, (0, 0, COMPLETE), (7, 7, COMPLETE)),
    ("stop_keeps_fraction", True, STOPPED, fraction_at_the_end, 0, 0xB000),
    ("breakpoint_exact", True, [("command", "SBPA", 0, 5), *TURNED, ("sample",)], status(BREAKPOINT), BREAKPOINT, 0),
    ("read_position", "live", TURNED, asked("RDRP"), 0, 8),
    ("pid_saturates", False, [("closed", 0x7FFF, {"kp": 0x0870})], DRIVE, (0, 127), (1, 9)),
    ("sum_reading", "sum", [("closed", 10000, 2, {"ki": 1000, "il": 500})], asked("RDSUM"), 500, 78),
    ("sum_rounding", "zero", [("closed", -1, {"ki": 100, "il": 1000})], asked("RDSUM"), -100, 0),
    ("open_loop_clears", False, [WOUND_UP, ("start", 0x100, {"samples": 2})], remembers_errors, False, True),
    ("update_clears", True, [WOUND_UP, UDF, ("sample",)], remembers_errors, True, False),
    ("error_test", "saturated", [("closed", 40000, {"kp": 1})], status(EXCESS), EXCESS, 0),
    ("output_rounding", "zero", [("closed", -1, {"kp": 10})], DRIVE, (1, 1), (0, 0)),
    ("sign_of_negative", 0, [("closed", -26, {"kp": 10})], DRIVE, (1, 2), (0, 2)),
    ("pulse_at", "end", [("closed", 26, {"kp": 10})], first_edges, [(0, 1), (16, 0)], [(0, 0), (2032, 1)]),
    ("off_keeps_sign", True, [("closed", -26, {"kp": 10}), ("start", 0x0100)], "sign", 0, 1),
    ("port12_clears", False, [("command", "PORT12")], signals(0x0100), 0, 0x0100),
    ("double_step", 2, BOTH_AT_ONCE, "real_position", 0, 2),
    ("double_step", -2, BOTH_AT_ONCE, "real_position", 0, -2),
    ("filter_clocks", 4, SHORT_STATE, "real_position", 0, 2),
)  # fmt: skip


TOGETHER = {"reset_interrupts": {"interrupt": "event"}}
"""Rules that have two readings only with another one's other reading."""


@pytest.mark.parametrize(("field", "other", "steps", "what", "by_default", "otherwise"), READINGS)
def test_the_other_reading_of_a_rule_does_otherwise(field, other, steps, what, by_default, otherwise):
    with_it = TOGETHER.get(field, {})
    for options, expected in (({}, by_default), ({field: other}, otherwise)):
        bench = ReadingBench.running(**with_it, **options)
        play(bench, steps)
        assert seen(bench, what) == expected
    assert by_default != otherwise


def test_every_option_is_observed_and_documented():
    fields = set(Lm629Options.__struct_fields__)
    assert {field for field, *_ in READINGS} == fields
    documented = list(tables.readings(Lm629Options))
    assert [field for _, field, _ in documented] == list(Lm629Options.__struct_fields__)
    rules = [rule for rule, _, _ in documented]
    assert all(re.fullmatch("[A-Z][0-9]+", rule) for rule in rules)
    assert len(set(rules)) == len(rules)
    assert all(len(meaning) > 20 for _, _, meaning in documented)
    assert MARK in README.read_text()
    assert all(f"| {rule} | `{field}` |" in tables.filled(MARK) for rule, field, _ in documented)
    assert {name for name, *_ in LENGTHS} | set(CHOICES) == fields


def test_options_come_from_plain_values_and_say_what_they_may_be():
    assert msgspec.convert({"interrupt": "event", "double_step": -2}, Lm629Options) == Lm629Options(
        interrupt="event", double_step=-2
    )
    with pytest.raises(msgspec.ValidationError, match="busy_clock"):
        msgspec.convert({"busy_clock": 1}, Lm629Options)
    with pytest.raises(ValueError, match="sign_of_negative must be one of 1, 0, not 2"):
        Lm629Options(sign_of_negative=2)
    with pytest.raises(ValueError, match=r"busy_clocks must be 0\.\.1048576 clocks, not -1"):
        Lm629Options(busy_clocks=-1)


@pytest.mark.parametrize("reset", ["command", "pin"])
def test_an_index_caught_before_a_reset_ends_the_wait_for_it(reset):
    """SNVS781, RDSIGS: bit 0 stays set until the next index pulse, so no wait is left that R6 could keep."""
    bench = Bench.running(reset_clears_index=False)
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
    play(bench, AGAIN)
    assert bench.chip.status & EXCESS == 0
    other = Lm629(options)
    restore(other, snapshot(bench.chip))
    other.advance(bench.chip.sample_tick)
    bench.sample()
    assert snapshot(other) == snapshot(bench.chip)
    assert values(other)["excessive"] == 1
