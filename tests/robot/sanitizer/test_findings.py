"""The sanitizer finds each planted mistake, and nothing in the correct idioms beside it."""

import pytest

from miro_robot.image import load_hex
from miro_robot.inspect.findings import Reader
from miro_robot.inspect.sanitizer import Sanitizer
from miro_robot.inspect.sanitizer_layout import layout_of
from miro_robot.inspect.watcher import attach
from miro_robot.mcs51.cpu import Cpu
from tests.robot.inspect.programs import build
from tests.robot.mcs51.asm import assemble, hex_text
from tests.robot.sanitizer import keil
from tests.robot.sanitizer.lines import receive
from tests.robot.sanitizer.planted import AGAIN, OVERLAID, OVERLAYS, RACES, SILENT, TIMES, planted
from tests.states import snapshot


def watched(path, cycles, received=b""):
    """Findings of an image that ran for so long, and the CPU; `received` comes at 9600 baud, from 1 ms on."""
    image = load_hex(path)
    cpu, layout = Cpu(), layout_of(image)
    cpu.load(image.code, image.used)
    sanitizer = Sanitizer(layout)
    attach(cpu, sanitizer)
    receive(cpu, received)
    cpu.run(cycles)
    return Reader(image, layout).findings(sanitizer), cpu


@pytest.fixture(scope="module")
def races(tmp_path_factory):
    return build(tmp_path_factory.mktemp("races"), RACES)


def test_torn_and_lost_variables_are_found_and_correct_idioms_are_not(races):
    found, _ = watched(races, 40_000)
    assert {one.key for one in found} == planted(RACES)


def test_what_may_happen_is_found_before_it_happens(races):
    """A few turns of the main loop suffice, in which no interrupt came between."""
    found, _ = watched(races, 2_500)
    assert {one.key for one in found} == planted(RACES)
    assert not all(one.did for one in found)
    stamp = next(one for one in found if one.variable == "stamp")
    assert not stamp.did
    assert "reads stamp in pieces in main" in stamp.says
    assert stamp.other.endswith("in tick (timer 0 interrupt) comes between")


def test_what_happened_has_its_tick(races):
    found, _ = watched(races, 400_000)
    happened = next(one for one in found if one.did)
    again, cpu = watched(races, happened.tick // 12)
    assert cpu.cycles == happened.tick // 12
    assert not next(one for one in again if one.key == happened.key).did


def test_bytes_that_functions_share_are_found_where_an_interrupt_uses_them(tmp_path):
    found, _ = watched(build(tmp_path, OVERLAYS), 60_000)
    assert {one.kind for one in found} == {"overlay"}
    assert {one.function for one in found} == OVERLAID
    assert {f"{one.says}" for one in found} >= {"stores b for mix", "stores parameter 2 for _moduint"}


@pytest.mark.parametrize("program", SILENT.values(), ids=SILENT)
def test_nothing_is_found(program, tmp_path):
    found, cpu = watched(build(tmp_path, program), 200_000)
    assert found == []
    assert cpu.peripherals.timers.control & 0x10  # it came to its loop


def test_what_is_read_until_it_is_equal_is_not_torn(tmp_path):
    found, _ = watched(build(tmp_path, AGAIN), 100_000)
    assert {one.key for one in found} == planted(AGAIN)


def test_firmware_that_never_reads_sbuf_is_told_apart(tmp_path):
    """In both, characters come to a busy receiver; one reads them too late."""
    says = {}
    for late in ("", "if (RI && ++turns == 900) { turns = 0; x = SBUF; RI = 0; }"):
        (folder := tmp_path / f"{len(late)}").mkdir()
        text = "#include <8052.h>\nunsigned int turns, x;\nvoid main(void) { SCON = 0x50; TMOD = 0x20; PCON = 0x80;"
        text += f" TH1 = 0xF3; TR1 = 1; for (;;) {{ {late} }} }}"
        found, _ = watched(build(folder, text), 20_000, b"abcdefgh")
        (says[late],) = (one.says for one in found)
    assert [*says.values()] == [
        "never reads SBUF, where characters come, in main",
        "loses a character: the one before was still waiting, in main",
    ]


def test_a_map_of_keil_names_variables_and_a_line_that_takes_both_bytes_makes_a_word(tmp_path):
    """Bytes that are reached through R0 are an array's; an update with interrupts off is right."""
    (tmp_path / "clock.m51").write_text(keil.MAP)
    (tmp_path / "clock.hex").write_text(hex_text(assemble(keil.CODE)))
    found, _ = watched(tmp_path / "clock.hex", 20_000)
    assert {one.key for one in found} == {"race clock.c:12 ms", "race clock.c:15 count"}
    layout = layout_of(load_hex(tmp_path / "clock.hex"))
    assert layout.names == {0x08: "ms", 0x0A: "copy", 0x0C: "count"}
    for damage in ("D:000DH         PUBLIC", "X:FFFFH         PUBLIC"):
        map_text = keil.MAP.replace("D:000DH         PUBLIC", damage).replace(
            "0008H     0008H     UNIT", "0008H     FFFFH     UNIT"
        )
        (tmp_path / "clock.m51").write_text(
            map_text.replace(
                "IDATA   0021H     0001H     UNIT         ?STACK",
                "XDATA   FFFFH     00FFH     UNIT         ?XD?CLOCK",
            )
        )
        assert all(place < 256 for place in layout_of(load_hex(tmp_path / "clock.hex")).places), damage
    assert "variables are as long as its map leaves room" in layout.unseen


def test_a_timer_that_starts_early_is_not_passed_over(tmp_path):
    started = SILENT["variables that are set before their timer runs"].replace(
        "IE = 0x82;", "IE = 0x82; TR0 = 1;"
    )
    found, _ = watched(build(tmp_path, started), 200_000)
    assert {one.variable for one in found if one.kind == "race"} == {"period"}


def test_halves_of_timers_read_apart_are_found_and_correct_idioms_are_not(tmp_path):
    found, _ = watched(build(tmp_path, TIMES), 20_000)
    assert {one.key for one in found} == planted(TIMES)


def test_a_watched_run_ends_in_the_state_of_one_that_is_not(races):
    _, cpu = watched(races, 40_000)
    image = load_hex(races)
    alone = Cpu()
    alone.load(image.code, image.used)
    alone.run(40_000)
    assert snapshot(cpu) == snapshot(alone)
