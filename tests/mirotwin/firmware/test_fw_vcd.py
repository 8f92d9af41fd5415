"""`mirotwin fw vcd`: files, windows, what is refused, and that sigrok reads out of them what was on the wires."""

import io
import os
import re
import shutil
from itertools import pairwise

import pytest

from miro_exact.clock import (
    CONTROL_PERIOD_TICKS,
    HOST_CHARACTER_TICKS,
    LM629_SAMPLE_TICKS,
    TICKS_PER_SECOND,
    ticks,
)
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.inspect.waveform import Waveform
from miro_sim.scenario import file as scenario_file
from miro_sim.world.world import World
from tests import children
from tests.mirotwin import program
from tests.mirotwin.conftest import hex_file
from tests.robot.inspect.reading import read
from tests.robot.mcs51.asm import assemble

QUIET = """name = "quiet"
title = "A radio without noise"
duration_s = 0.3

[[network]]
[network.radio]
carrier = "on"
bit_error_rate = 0.0
latency_s = 0.0002

[[network.robot]]
slot = 1
reference.kind = "line"
"""
ECHO = """
MOV RCAP2H,#0FFh
MOV RCAP2L,#0B2h
MOV T2CON,#34h
MOV SCON,#50h
loop:
JNB RI,$
MOV A,SBUF
CLR RI
MOV SBUF,A
JNB TI,$
CLR TI
SJMP loop
"""
US_TICKS = TICKS_PER_SECOND // 1_000_000


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    path = tmp_path_factory.mktemp("quiet") / "quiet.toml"
    path.write_text(QUIET)
    return path


def characters(vcd, wire, baud=9600):
    """What sigrok makes of a UART wire at 1 us: (us at which the data bits begin, byte)."""
    if shutil.which("sigrok-cli") is None:
        if "CI" not in os.environ:
            pytest.skip("sigrok-cli is not installed (Debian package sigrok-cli)")
        pytest.fail("sigrok-cli is missing: install the Debian package sigrok-cli")
    command = ["sigrok-cli", "-I", "vcd:downsample=1000", "-i", vcd, "-P", f"uart:baudrate={baud}:rx={wire}"]
    command += ["-A", "uart=rx-data:rx-warnings", "--protocol-decoder-samplenum"]
    done = children.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    lines = [re.fullmatch(r"(\d+)-\d+ uart-1: ([0-9A-F]{2})", line) for line in done.stdout.splitlines()]
    assert all(lines), done.stdout
    return [(int(line[1]), int(line[2], 16)) for line in lines if line is not None]


def test_sigrok_reads_the_bytes_that_the_link_carried(mirotwin, quiet, tmp_path):
    out = tmp_path / "quiet.vcd"
    mirotwin.succeeds("fw", "vcd", quiet, "--seed", 3, "--out", out)
    scenario = scenario_file.load(str(quiet)).scenario
    world = World(scenario, 3, load_hex(image_path()))
    wire = []
    while not world.finished:
        wire += world.step().wire
    latency = ticks(scenario.networks[0].radio.latency_s)
    bit = HOST_CHARACTER_TICKS // 10
    down = [
        (run.tick + latency + index * HOST_CHARACTER_TICKS + bit, byte)
        for run in wire
        if run.direction == ">"
        for index, byte in enumerate(run.data)
    ]
    end = read(out.read_bytes()).last_tick
    down = [(tick, byte) for tick, byte in down if tick + 9 * bit < end]
    heard = characters(out, "rxd")
    assert len(heard) > 180
    assert [byte for _, byte in heard] == [byte for _, byte in down]
    late = [us * US_TICKS - tick for (us, _), (tick, _) in zip(heard, down, strict=True)]
    assert max(map(abs, late)) <= 2 * US_TICKS
    up = bytes(byte for run in wire if run.direction == "<" for byte in run.data)
    sent = characters(out, "txd")
    assert len(up) > 40
    assert bytes(byte for _, byte in sent) == up


def test_sigrok_reads_what_a_bare_processor_hears_and_says(mirotwin, tmp_path):
    image = hex_file(tmp_path / "echo.ihx", assemble(ECHO))
    (tmp_path / "in").write_bytes(b"Hello, sigrok\n")
    out = tmp_path / "echo.vcd"
    mirotwin.ends(42, "fw", "vcd", image, "--stdin", tmp_path / "in", "--max-cycles", 100_000, "--out", out)
    for wire in ("rxd", "txd"):
        assert bytes(byte for _, byte in characters(out, wire, 9615)) == b"Hello, sigrok\n"
    vcd = read(out.read_bytes())
    assert "left_pwm" not in vcd.wires
    assert vcd.last_tick == 12 * 100_000


def test_a_save_file_shows_every_wire_of_the_waveform(mirotwin, short, tmp_path):
    out = tmp_path / "short.vcd"
    code, said, _ = mirotwin("fw", "vcd", short, "--to", "40ms", "--out", out)
    assert code == 0
    assert said == f"0.000000 s to 0.040000 s; gtkwave {out} {out.with_suffix('.gtkw')}\n"
    save = out.with_suffix(".gtkw").read_text()
    vcd = read(out.read_bytes())
    shown = re.findall(r"robot\.[\w.]+", save)
    assert sorted(shown) == sorted(f"{scope}.{wire}" for wire, scope in vcd.scopes.items())
    assert '[dumpfile] "short.vcd"' in save
    assert "mtime" not in save
    assert str(tmp_path) not in save


@pytest.mark.slow
def test_a_window_is_the_part_of_the_whole_and_both_engines_write_the_same(short, tmp_path):
    def written(name, *options):
        out = tmp_path / f"{name}.vcd"
        program.run("fw", "vcd", short, "--slot", "0", "--out", out, *options, check=True)
        return out.read_bytes()

    window = ("--from", "150ms", "--to", "156ms")
    compiled = written("compiled", *window)
    assert compiled == written("python", *window, "--engine", "python")
    part, whole = read(compiled), read(written("whole", "--to", "160ms"))
    assert (part.first_tick, part.last_tick) == (3_600_000, 3_744_000)
    for wire, changes in part.wires.items():
        inside = [change for change in whole.wires[wire] if 3_600_000 < change[0] < 3_744_000]
        assert changes == [(3_600_000, whole.level_at(wire, 3_600_000)), *inside], wire
    assert len(part.wires["left_pwm"]) > 10


def test_a_recording_is_a_subject_as_well(mirotwin, short, finished, tmp_path):
    for name, subject in (("a", (short, "--seed", 5)), ("b", (finished / "run.mcap",))):
        assert mirotwin("fw", "vcd", *subject, "--to", "50ms", "--out", tmp_path / f"{name}.vcd")[0] == 0
    assert (tmp_path / "a.vcd").read_bytes() == (tmp_path / "b.vcd").read_bytes()


def test_a_faulty_firmware_leaves_its_waveform_up_to_the_fault(mirotwin, tmp_path):
    image = hex_file(tmp_path / "bad.ihx", b"\xb2\x90\xb2\x90\xa5")  # CPL P1.0 twice, then no opcode
    assert "undefined opcode" in mirotwin.ends(3, "fw", "vcd", image, "--out", tmp_path / "bad.vcd")
    assert read((tmp_path / "bad.vcd").read_bytes()).wires["p1_0"] == [(0, 1), (12, 0), (24, 1)]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("short", "--from", "5ms", "--to", "5ms", "--out", "x.vcd"), "the window is empty"),
        (("short", "--from", "9s", "--out", "x.vcd"), "the run ends at tick 4804800; look earlier"),
        (("short",), "Missing option '-o' / '--out'"),
        (("short", "--out", "x.gtkw"), "name of the GTKWave save file"),
        (("no.ihx", "--out", "x.vcd"), "there is no such file"),
        (("stops.ihx", "--from", "20s", "--out", "x.vcd"), "--from 480000000t: the run ended .*; look earlier"),
        (("stops.ihx", "--from", "24000t", "--out", "x.vcd"), "look earlier"),
    ],
)  # fmt: skip
def test_what_cannot_be_written_is_refused_and_nothing_is_left(
    mirotwin, short, tmp_path, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    image = hex_file(tmp_path / "stops.ihx", b"\x00\x80\xfe")
    words = [short if word == "short" else word for word in words]
    assert re.search(said, mirotwin.refuses("fw", "vcd", *words))
    assert list(tmp_path.iterdir()) == [image]


def test_a_save_file_that_is_there_stays_unless_it_is_to_be_replaced(mirotwin, short, tmp_path):
    there = "x.gtkw"
    (tmp_path / there).write_text("mine")
    command = ("fw", "vcd", short, "--to", "1ms", "--out", tmp_path / "x.vcd")
    assert f"{there}: is there already; " in mirotwin.refuses(*command)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(there, "mine")]
    assert mirotwin(*command, "--force")[0] == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.gtkw", "x.vcd"]
    assert "mine" not in (tmp_path / there).read_text()


@pytest.mark.slow
def test_the_encoder_wires_count_what_the_chip_counts(tmp_path):
    world = World(scenario_file.load("fig8").scenario, 0, load_hex(image_path()))
    board = world.networks[0].robots[0].board
    out = io.StringIO()
    waveform = Waveform(out, board).attach(board.cpu)
    for _ in range(24):
        world.step()
    waveform.close()
    vcd = read(out.getvalue().encode())
    for side, chip in (("left", board.left), ("right", board.right)):
        latched_tick = chip.sample_tick - LM629_SAMPLE_TICKS
        edges = sorted(
            (tick, wire)
            for wire in "ab"
            for tick, _ in vcd.wires[f"{side}_{wire}"][1:]
            if tick <= latched_tick
        )
        assert len({tick for tick, _ in edges}) == len(edges)
        order = [(0, 0), (1, 0), (1, 1), (0, 1)]
        places = [order.index((vcd.level_at(f"{side}_a", t), vcd.level_at(f"{side}_b", t))) for t, _ in edges]
        steps = [(after - before + 1) % 4 - 1 for before, after in pairwise([0, *places])]
        assert set(steps) <= {-1, 1}
        assert abs(chip.real_position) > 1000
        assert abs(sum(steps) - chip.real_position) <= 1  # the chip's filter may hold back the last one


def test_a_watched_world_has_the_digest_of_an_unwatched_one(mirotwin, short):
    def digest(watched, pieces):
        world = World(scenario_file.load(str(short)).scenario, 5, load_hex(image_path()))
        waveforms = []
        for robot in world.networks[0].robots if watched else []:
            waveforms.append(Waveform(io.StringIO(), robot.board).attach(robot.board.cpu))
        for tick in range(pieces, world.periods * CONTROL_PERIOD_TICKS + pieces, pieces):
            world.run_to(min(tick, world.periods * CONTROL_PERIOD_TICKS))
        for waveform in waveforms:
            waveform.close()
        return world.digest

    free = digest(False, CONTROL_PERIOD_TICKS)
    assert digest(True, CONTROL_PERIOD_TICKS) == digest(True, 123_457) == free
