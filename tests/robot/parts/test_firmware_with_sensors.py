"""Programs in C that ask sensors and move displays by port pins, whose times are counted in instructions."""

from pathlib import Path

import pytest

from miro_robot.build import board_of
from miro_robot.image import load_hex
from miro_sim.scenario.board_file import load_board
from tests.robot.inspect.programs import build
from tests.states import restore, snapshot

FOLDER = Path(__file__).parent / "firmware"
CRYSTALS = pytest.mark.parametrize("hz", [11_059_200, 12_000_000])


class Bench:
    """A board around a program; `lines` are what it has sent since the last look."""

    def __init__(self, folder, program, parts, hz=11_059_200, options=()):
        self.image = load_hex(build(folder, (FOLDER / program).read_text("utf-8"), *options))
        self.file = folder / "a.board.toml"
        self.file.write_text(f'chip = "at89c52"\ncrystal_hz = {hz}\n{parts}')
        self.board = self.fresh()
        self.hz, self.tick, self.sent = hz, 0, bytearray()
        self.board.sent = lambda value, *_: self.sent.append(value)

    def fresh(self):
        """Another board like this one, at its begin."""
        return board_of(load_board(str(self.file)), self.image)

    def run(self, ms):
        self.tick += ms * self.hz // 1000
        self.board.run(self.tick)
        assert self.board.faults == []

    def put(self, path, value):
        self.board.put(*path.split("."), value, self.tick)

    def value(self, path):
        return self.board.value(*path.split("."))

    def lines(self):
        lines = self.sent.decode().split("\n")[:-1]
        del self.sent[:]
        return lines


PROBE = '[parts.probe]\npart = "ds18b20"\npins = { dq = "P3.7" }\n'
AIR = '[parts.air]\npart = "dht11"\npins = { data = "P1.3" }\n'
ADC = '[parts.adc]\npart = "pcf8591"\npins = { scl = "P2.0", sda = "P2.1" }\n'


@CRYSTALS
def test_a_program_reads_a_thermometer(tmp_path, hz):
    bench = Bench(tmp_path, "ds18b20.c", PROBE, hz)
    bench.put("probe.temperature_c", 21.5)
    bench.run(800)
    assert bench.lines() == ["21.5"]
    bench.put("probe.temperature_c", -10.125)
    bench.run(1700)
    assert bench.lines() == ["21.5", "-10.1"]
    bench.put("probe.broken", "crc")
    bench.run(800)
    assert bench.lines() == ["crc"]
    bench.put("probe.broken", "missing")
    bench.run(900)
    assert set(bench.lines()[1:]) == {"missing"}
    bench.put("probe.broken", "none")
    bench.run(900)
    assert bench.lines()[-1] == "-10.1"


@pytest.mark.parametrize("slot_us", [15, 60])
def test_it_does_so_from_the_fastest_chip_and_from_the_slowest(tmp_path, slot_us):
    bench = Bench(tmp_path, "ds18b20.c", f"{PROBE}slot_us = {slot_us}\n")
    bench.put("probe.temperature_c", 99.9)
    bench.run(800)
    assert bench.lines() == ["99.9"]


@CRYSTALS
def test_a_program_reads_voltages_and_puts_one_out(tmp_path, hz):
    bench = Bench(tmp_path, "pcf8591.c", ADC, hz)
    for number, volts in enumerate((1.25, 0.0, 5.0, 3.3)):
        bench.put(f"adc.ain{number}_v", volts)
    bench.run(60)
    assert bench.lines()[-1] == "1.25 0.00 4.98 3.28 "
    bench.put("adc.ain0_v", 2.5)
    bench.run(100)
    assert bench.lines()[-1] == "2.50 0.00 4.98 3.28 "
    assert (bench.value("adc.aout_v"), bench.value("adc.short_clocks")) == (2.5, 0)


@CRYSTALS
@pytest.mark.parametrize(
    ("part", "options", "shown"),
    [("dht11", (), ["37001700", "25003000"]), ("dht22", ("-DDHT22",), ["022b00eb", "017201da"])],
)
def test_a_program_reads_humidity_and_degrees(tmp_path, hz, part, options, shown):
    bench = Bench(
        tmp_path, "dht.c", f'[parts.air]\npart = "{part}"\npins = {{ data = "P1.3" }}\n', hz, options
    )
    bench.put("air.temperature_c", 23.5 - 0.5 * (part == "dht11"))
    bench.put("air.humidity_percent", 55.5 - 0.5 * (part == "dht11"))
    bench.run(4500)
    first, *others = bench.lines()
    assert (first, others[-1]) == ("silent", shown[0])  # it is asked at once
    bench.put("air.temperature_c", 47.4 if part == "dht22" else 48)
    bench.put("air.humidity_percent", 37.0)
    bench.run(5000)
    assert bench.lines()[-1] == shown[1]
    bench.put("air.broken", "sum")
    bench.run(2500)
    assert bench.lines()[-1] == "sum"
    bench.put("air.broken", "missing")
    bench.run(2500)
    assert bench.lines()[-1] == "silent"


def shifted(data, clock, first):
    """Two shift registers; bit 0 of a byte is at output `first`."""
    text = f"""\
[parts.segments]
part = "hc595"
pins = {{ ser = "{data}", srclk = "{clock}", rclk = "P1.2", q7s = "link" }}
[parts.digits]
part = "hc595"
pins = {{ ser = "link", srclk = "{clock}", rclk = "P1.2" }}
[parts.clock]
part = "seven_segment"
[parts.clock.pins]
"""
    text += "".join(f'{pin} = "segments.q{abs(first - bit)}"\n' for bit, pin in enumerate([*"abcdefg", "dp"]))
    return text + "".join(f'dig{number + 1} = "digits.q{abs(first - number)}"\n' for number in range(4))


SHIFTED = shifted("P1.0", "P1.1", 0)
MODE_0 = shifted("P3.0", "P3.1", 7)  # the serial port sends the lowest bit first
PORTS = '[parts.clock]\npart = "seven_segment"\ncommon = "anode"\n[parts.clock.pins]\n'
PORTS += "".join(f'{pin} = "P0.{bit}"\n' for bit, pin in enumerate([*"abcdefg", "dp"]))
PORTS += "".join(f'dig{number + 1} = "!P2.{number}"\n' for number in range(4))


@pytest.mark.parametrize(
    ("parts", "options"),
    [(SHIFTED, ()), (MODE_0, ("-DMODE0",)), (PORTS, ("-DPORTS",))],
    ids=["shift registers", "serial port", "port pins"],
)
def test_a_program_shows_a_clock(tmp_path, parts, options):
    bench = Bench(tmp_path, "clock.c", parts, options=options)
    bench.run(100)
    assert bench.value("clock.text") == "12.34"
    bench.run(1100)
    assert (bench.value("clock.text"), bench.value("clock.digits")) == ("12.35", 4)
    bench.run(25_000)
    assert bench.value("clock.text") == "13.00"
    if parts != PORTS:
        assert bench.value("digits.late_bits") == bench.value("segments.late_bits") == 0


def test_a_program_switches_a_relay_above_a_voltage(tmp_path):
    parts = ADC + '[parts.load]\npart = "relay"\npins = { coil = "P1.7", contact = "P1.6" }\n'
    bench = Bench(tmp_path, "guard.c", parts)
    bench.put("adc.ain0_v", 2.9)
    bench.run(100)
    assert (bench.value("load.closed"), bench.lines()) == (True, ["on"])
    bench.put("adc.ain0_v", 3.1)
    bench.run(30)
    assert (bench.value("load.closed"), bench.lines()) == (False, ["off"])
    bench.put("load.stuck", "closed")
    bench.run(30)
    assert bench.lines() == ["stuck"]


@pytest.mark.parametrize(
    ("program", "parts", "begin_ms"),
    [("ds18b20.c", PROBE, 0), ("dht.c", AIR, 1166), ("pcf8591.c", ADC, 0), ("clock.c", SHIFTED, 68)],
)
def test_a_board_that_is_saved_anywhere_goes_on_the_same(tmp_path, program, parts, begin_ms):
    bench = Bench(tmp_path, program, parts)
    bench.run(begin_ms)
    cut, whole = bench.fresh(), bench.board
    restore(cut, snapshot(whole))
    seen = set()
    for tick in range(bench.tick, bench.tick + 150_000, 1_237):
        cut.run(tick)
        state = snapshot(cut)
        seen.add(state)
        cut = bench.fresh()
        restore(cut, state)
        assert snapshot(cut) == state
    whole.run(tick)
    assert snapshot(whole) == snapshot(cut)
    assert len(seen) > 100
