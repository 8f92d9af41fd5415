"""A board file gives the board that it describes, or one line with file, place, what is wrong and the remedy."""

import json
import sys
import tomllib
from contextlib import suppress
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import installed
from miro_exact.bad_input import BadInput
from miro_protocol.toml_text import TomlError, tables, without_none
from miro_robot.board_spec import BoardSpec, LatchSpec, PartSpec, StrapSpec
from miro_robot.parts.button import Button
from miro_robot.parts.led import Led
from miro_robot.parts.resolve import resolve
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_file import board_of_table, builtin_boards, load_board, table_of
from miro_sim.scenario.parts import PARTS
from miro_sim.scenario.plugins import plugins_used
from mirotwin.shell.plugin_files import PluginFiles
from tests.exact import distribution
from tests.example_count import examples

HEAD = "crystal_hz = 11_059_200\n"
LAMP = '[parts.lamp]\npart = "led"\n'
LIT = LAMP + 'pins = { pin = "P1.0" }\n'
CTRL = "[latches.CTRL]\naddress = 0x8000\nmask = 0xC000\n"
FULL = """
chip = "stc89c52"
crystal_hz = 11_059_200
xram = "external"
xram_bytes = 0x4000
pull_ups = ["P0", "SDA"]
pull_downs = ["P2.0"]
allow_contention = ["P0"]
[nets]
SDA = "P2.1"
START = ["P3.2", "P1.7"]
[straps]
mode = { pin = "P3.4", level = 0 }
[latches.CTRL]
address = 0x8000
mask = 0xC000
initial = 0x0F
[buffers.KEYS]
address = 0x4000
mask = 0xC000
pins = ["SDA", "CTRL.0", "P1.0", "P1.1", "P1.2", "P1.3", "1", "0"]
[serial]
baud = 9600
[parts.lamp]
part = "led"
pins = { pin = "!CTRL.3" }
active = "high"
[parts.key]
part = "button"
pins = { pin = "START" }
bounce_ms = 5
[parts.other]
part = "button"
pins = { pin = "P0.1" }
[parts.shows]
part = "led"
pins = { pin = "other.pin" }
"""
CAR = """
chip = "at89s52"
crystal_hz = 12_000_000
pull_ups = ["P0"]
[parts.bridge]
part = "l298"
pins = { ena = "P2.0", in1 = "P2.4", in2 = "!bridge.in1" }
forward = { a = "in2" }
[parts.motor]
part = "dc_motor"
pins = { a = "bridge.out1", b = "bridge.out2" }
supply_v = 6
[parts.disc]
part = "encoder"
pins = { shaft = "motor.shaft", a = "P3.2" }
[parts.eyes]
part = "hc_sr04"
pins = { trig = "P1.1", echo = "P1.0" }
[parts.neck]
part = "servo"
pins = { pwm = "P1.2" }
[parts.horn]
part = "buzzer"
pins = { pin = "P1.3" }
[parts.memory]
part = "at24c"
pins = { scl = "P1.4", sda = "P1.5", a0 = "1" }
[parts.lcd]
part = "lcd1602"
[parts.lcd.pins]
rs = "P0.0"
e = "P0.1"
d4 = "P0.4"
d5 = "P0.5"
d6 = "P0.6"
d7 = "P0.7"
"""
SONAR = """
from miro_robot.parts.keys import PartKeys, Pin
from miro_robot.parts.part import Part

class Sonar(PartKeys, frozen=True, kw_only=True, tag="sonar"):
    "A part of one's own."
    PINS = (Pin("echo"),)
    cm: float = 1.0

    def __post_init__(self):
        1 // int(self.cm)

    def make(self, place):
        return Part(self, place)
"""


def board(text):
    return board_of_table(tables(text), "car.board.toml")


def line(text):
    """What is said of a file that cannot be used."""
    with pytest.raises(BadInput) as refused:
        board(text)
    message = f"{refused.value}"
    assert message.startswith("car.board.toml: ")
    assert "\n" not in message
    return message.removeprefix("car.board.toml: ")


def test_a_file_is_read_as_it_says():
    spec = board(FULL)
    assert spec == BoardSpec(
        chip="stc89c52",
        crystal_hz=11_059_200,
        xram_bytes=0x4000,
        of_file=True,
        pull_ups=("P0", "SDA"),
        pull_downs=("P2.0",),
        allow_contention=("P0",),
        nets={"SDA": ("P2.1",), "START": ("P3.2", "P1.7")},
        straps={"mode": StrapSpec(pin="P3.4", level=0)},
        latches={"CTRL": LatchSpec(address=0x8000, mask=0xC000, initial=15)},
        buffers=spec.buffers,
        baud=9600,
        parts={
            "key": PartSpec(keys=Button(bounce_ms=5.0), pins={"pin": "START"}),
            "lamp": PartSpec(keys=Led(active="high"), pins={"pin": "!CTRL.3"}),
            "other": PartSpec(keys=Button(), pins={"pin": "P0.1"}),
            "shows": PartSpec(keys=Led(), pins={"pin": "other.pin"}),
        },
    )


def test_a_board_of_a_file_has_no_ram_for_movx_but_that_of_its_chip_unless_it_says_so():
    assert board(HEAD).xram == "none"
    assert board('chip = "stc89c52"\n' + HEAD).xram == "internal"
    assert board('chip = "stc89c52"\nxram = "none"\n' + HEAD).xram == "none"
    assert BoardSpec().xram == "external"


@pytest.mark.parametrize("text", [HEAD, FULL, CAR])
def test_a_recorded_table_gives_the_board_again(text):
    spec = board(text)
    assert board(tomli_w.dumps(without_none(table_of(spec)))) == spec


def test_a_board_is_called_as_its_file_or_as_it_says(tmp_path):
    path = tmp_path / "my car.board.toml"
    path.write_text(HEAD)
    assert load_board(f"{path}").name == "my-car"
    path.write_text('name = "lorry"\n' + HEAD)
    assert load_board(f"{path}").name == "lorry"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "crystal_hz: this key is missing; give what is printed on the crystal"),
        ("crystal_hz = 50_000_000", "crystal_hz: 50000000 is out of range; must be <= 40000000 in hertz"),
        ("crystal_hz = 32_767", "crystal_hz: 32767 is out of range; must be >= 32768 in hertz"),
        ("crystal_hz = 12e6", "crystal_hz: expected a whole number in hertz, got a number (12000000.0)"),
        ('chip = "at89c25"\n' + HEAD, "chip: there is no chip 'at89c25'; did you mean at89c52?"),
        ('mode = "6T"\n' + HEAD, "mode: 6T mode is not modelled; leave it out and give twice the crystal"),
        ('xram = "internal"\n' + HEAD, "xram: at89c52 has no RAM of its own for MOVX"),
        ("xram_bytes = 9\n" + HEAD, """xram_bytes: the board's xram is 'none'; give xram = "external", too"""),
        ("crystl_hz = 1", "crystl_hz: unknown key; did you mean crystal_hz?"),
        (HEAD + "[serial]\nbaud = 400_000", "serial.baud: 400000 is out of range; must be <= 345600 with this"),
        ('data = "P0"\n' + HEAD, "data: this is an old wiring file, not a board file"),
        (HEAD + '[parts.a]\npart = "led"\npins = { pin = "P5.0" }', "parts.a.pins.pin: there is no port pin P5.0"),
        (HEAD + "[parts.a]\npins = {}", "parts.a.part: this key is missing; say which part it is"),
        (HEAD + '[parts.a]\npart = "ledd"', "parts.a.part: 'ledd' is not one of the choices; did you mean led?"),
        (HEAD + LAMP, 'parts.lamp.pins: pin pin is not connected; add pin = ".."'),
        (HEAD + LAMP + 'pin = "P1.0"', "parts.lamp.pin: unknown key; it is a pin: write pins = { pin = .. }"),
        (HEAD + LIT + 'actve = "low"', "parts.lamp.actve: unknown key; did you mean active?"),
        (HEAD + LIT + 'active = "no"', "parts.lamp.active: 'no' is not one of the choices; use high or low"),
        (HEAD + LAMP + "pins = { pin = 10 }", "parts.lamp.pins.pin: expected a string, got a whole number"),
        (HEAD + LAMP + 'pins = { pin = "GND" }', 'parts.lamp.pins.pin: GND is no net; write "0"'),
        (HEAD + LAMP + 'pins = { pin = "P1.O" }', "parts.lamp.pins.pin: there is no port pin 'P1.O'; use P0.0 to P3.7"),
        (HEAD + LAMP + 'pins = { pin = "p1.0" }', "parts.lamp.pins.pin: there is no port pin 'p1.0'; use P0.0 to P3.7"),
        (
            HEAD + '[parts.key]\npart = "button"\npins = { pin = "P1.1" }\nbounce_ms = 101',
            "parts.key.bounce_ms: 101 is out of range; must be <= 100.0 in milliseconds",
        ),
        (
            HEAD + '[parts.key]\npart = "button"\npins = { pin = "P0.1" }',
            'parts.key.pins.pin: nothing can drive P0.1 high: P0 is open drain; add pull_ups = ["P0.1"]',
        ),
        (HEAD + CTRL + CTRL.replace("CTRL", "B"), "latches.B: answers to address 0x8000, as latches.CTRL does"),
        (HEAD + "[latches.A]\naddress = 1\nmask = 2", "latches.A: address 0x0001 has bits that mask 0x0002 leaves"),
        (
            'xram = "external"\n' + HEAD + CTRL,
            "latches.CTRL: answers to address 0x8000, as the external RAM does; give xram_bytes of at most 0x8000",
        ),
        (HEAD + "[straps]\nmode = { pin = 'P1.0', level = 2 }", "straps.mode.level: is out of range; must be <= 1"),
        (HEAD + "[nets]\nA = 'P7.0'", "nets.A: 'P7.0' is no port pin; give a port pin, as P1.0"),
        (
            HEAD + "[parts.t]\npart = 'ds18b20'\npins = { dq = 'P1.0' }\nserial = '12'",
            "parts.t: serial is '12', not 12 hex digits",
        ),
        (
            HEAD + "[parts.m]\npart = 'at24c'\npins = { scl = 'P1.0', sda = 'P1.1' }\ncontent = '0x12'",
            "parts.m.content: '0x12' is not bytes in hex digits; use two digits a byte, as 0a ff",
        ),
        (HEAD + "[straps]\n'slot.0' = { pin = 'P1.0' }", "straps.slot.0: 'slot.0' is not a name; use letters"),
        (HEAD + "[straps]\na = { pin = 'P1.0' }\nb = { pin = 'P1.0' }", "straps.b.pin: strap a is on P1.0, too"),
        (HEAD + "x = nan", "x: nan is not a number that can be used; give a finite number"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_with_place_and_remedy(text, message):
    assert line(text).startswith(message)


def test_what_is_no_file_and_no_board_is_one_line(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\x81")
    (tmp_path / "b.toml").write_text("chip = ")
    for source, message in [
        ("miroo", "miroo: no such board; "),
        (f"{tmp_path / 'none.toml'}", "no such file; `mirotwin boards` lists the built-in boards"),
        (f"{tmp_path}/", "is a folder"),
        (f"{tmp_path / 'a.toml'}", "a.toml: line 1: not UTF-8 text; save the file as UTF-8"),
        (f"{tmp_path / 'b.toml'}", "b.toml: line 1: not TOML"),
    ]:
        with pytest.raises(BadInput) as refused:
            load_board(source)
        assert message in f"{refused.value}"


def test_built_in_boards_are_good():
    for name in builtin_boards():
        assert load_board(name).name == name


# Parts of others


def test_an_installed_part_is_found_and_belongs_to_what_was_used(tmp_path, monkeypatch):
    distribution.install(tmp_path, "sonar-kit", "1.2", {"sonar": "sonar_kit:Sonar"}, "parts", sonar_kit=SONAR)
    monkeypatch.syspath_prepend(tmp_path)
    spec = board(HEAD + '[parts.eye]\npart = "sonar"\npins = { echo = "P1.0" }\n')
    (used,) = plugins_used(BoardScenario(board=spec))
    assert used.startswith("part sonar: sonar-kit 1.2, sources ")
    message = line(HEAD + '[parts.eye]\npart = "sonar"\ncm = 0\npins = { echo = "P1.0" }\n')
    assert message.startswith("parts.eye: part 'sonar' cannot check its keys: ZeroDivisionError")


def test_a_part_of_the_command_line_is_found_until_the_option_is_read_again(tmp_path):
    path = tmp_path / "sonar.py"
    path.write_text(SONAR)
    text = HEAD + '[parts.eye]\npart = "sonar"\npins = { echo = "P1.0" }\n'
    PluginFiles(parts=(f"{path}:Sonar",)).bring()
    try:
        (used,) = plugins_used(BoardScenario(board=board(text)), installed.described_once)
        assert used.startswith("part sonar: sonar.py:Sonar, sources ")
    finally:
        PluginFiles().bring()
    assert "'sonar' is not one of the choices" in line(text)


@pytest.mark.parametrize("name", ["ranger", "json"])
def test_annotations_of_a_file_in_python_may_wait_until_they_are_needed(tmp_path, name):
    path = tmp_path / f"{name}.py"
    head = "from __future__ import annotations\nfrom typing import Annotated\nfrom msgspec import Meta\n"
    path.write_text(head + SONAR.replace("cm: float", "cm: Annotated[float, Meta(le=9)]"))
    PluginFiles(parts=(f"{path}:Sonar",)).bring()
    try:
        message = line(HEAD + '[parts.eye]\npart = "sonar"\ncm = 10\npins = { echo = "P1.0" }\n')
        assert message.startswith("parts.eye.cm: 10 is out of range; must be <= 9.0")
    finally:
        PluginFiles().bring()
    assert sys.modules["json"] is json


@pytest.mark.parametrize(
    ("source", "option", "message"),
    [
        (SONAR, "Sonnar", "there is no class 'Sonnar' derived from PartKeys; did you mean Sonar?"),
        (SONAR.replace('"sonar"', '"led"'), "Sonar", "part 'led' is in mirotwin (miro_robot.parts.led:Led), too"),
        (SONAR.replace('Pin("echo"),', "1,"), "Sonar", "part 'sonar': PINS are (1,); write PINS"),
        (SONAR.replace('Pin("echo"),', 'Pin("a b"),'), "Sonar", "part 'sonar': a pin is called 'a b'"),
        (SONAR.replace('Pin("echo"),', 'Pin("a"),' * 2), "Sonar", "part 'sonar': a pin is called 'a'"),
        (SONAR.replace('(Pin("echo"),)', 'tuple(Pin(f"p{n}") for n in range(31))'), "Sonar", "has 31 pins; a part"),
        (SONAR.replace('"echo"', '"echo", 9'), "Sonar", "part 'sonar': pin echo is Pin(name='echo', kind=9"),
        (SONAR + "    PUTS = 3\n", "Sonar", "part 'sonar': PUTS is 3; write PUTS = {\"name\": ..}"),
        (SONAR + "    PUTS = {'cm': 3}\n", "Sonar", "part 'sonar': PUTS['cm'] is no type of a value: "),
        ("1 // 0", "Sonar", "cannot be run: ZeroDivisionError"),
    ],
)  # fmt: skip
def test_a_part_that_cannot_be_used_is_one_line_with_its_file(tmp_path, source, option, message):
    path = tmp_path / "sonar.py"
    path.write_text(source)
    with pytest.raises(BadInput, match=r"sonar\.py: --part") as refused:
        PluginFiles(parts=(f"{path}:{option}",)).bring()
    assert message in f"{refused.value}"
    assert "\n" not in f"{refused.value}"
    assert not PARTS.in_files


def test_a_file_never_makes_us_import_a_path(tmp_path):
    path = tmp_path / "sonar.py"
    path.write_text("1 // 0")
    for name in (f"{path}:Sonar", "sonar:Sonar", "miro_robot.parts.led:Led"):
        assert "is not one of the choices" in line(HEAD + f"[parts.eye]\npart = '{name}'\n")


# Whatever a file holds


EXAMPLES = Path(__file__).parents[2] / "examples" / "boards"
TEXTS = (FULL, CAR, (EXAMPLES / "car" / "hall.board.toml").read_text("utf-8"))
GOOD = tuple(tomllib.loads(text) for text in TEXTS)
WORDS = st.sampled_from(
    ["P1.0", "P0.1", "!P1.1", "CTRL.3", "!CTRL.3", "0", "1", "!0", "other.pin", "lamp.pin", "key.pin", "SDA", "X"]
    + ["", "!", ".", "P4.0", "P1", "key", "CTRL", "led", "button", "at89c51", "internal", "none", "ground", "a.b.c"]
)  # fmt: skip
NAMES = st.sampled_from(
    ["parts", "part", "pins", "pin", "nets", "latches", "buffers", "straps", "chip", "xram", "mode", "serial", "A"]
    + ["baud", "address", "mask", "level", "crystal_hz", "xram_bytes", "name", "pull_ups", "lamp", "CTRL", "", "P1"]
)  # fmt: skip
VALUES = st.recursive(
    WORDS | st.integers(-(1 << 70), 1 << 70) | st.floats() | st.booleans() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=9) | st.dictionaries(NAMES | st.text(max_size=3), inner, max_size=4)
    ),
    max_leaves=8,
)


def changed(draw, value):
    """The value with something in it replaced, left out, or added."""
    if isinstance(value, dict) and value and draw(st.integers(0, 9)):
        key = draw(st.sampled_from(sorted(value)))
        return {**value, key: changed(draw, value[key])}
    if isinstance(value, dict) and draw(st.booleans()):
        if value and draw(st.booleans()):
            left_out = draw(st.sampled_from(sorted(value)))
            return {key: inner for key, inner in value.items() if key != left_out}
        return {**value, draw(NAMES): draw(VALUES)}
    return draw(VALUES)


@st.composite
def changed_files(draw):
    table = draw(st.sampled_from(GOOD))
    for _ in range(draw(st.integers(1, 3))):
        table = changed(draw, table)
    return table if isinstance(table, dict) else {"x": table}


def board_or_line(table):
    """The board and its nets, or None after a message of one line."""
    message = "car.board.toml: a board"
    spec = None
    try:
        spec = board_of_table(table, "car.board.toml")
    except BadInput as error:
        message = f"{error}"
    assert message.startswith("car.board.toml: ")
    assert len(message.splitlines()) == 1
    return spec and (spec, resolve(spec))


@given(changed_files())
@examples(250)
def test_a_changed_file_is_a_board_or_one_line(table):
    board_or_line(table)


@given(st.dictionaries(NAMES, VALUES, max_size=8))
@examples(100)
def test_random_tables_are_a_board_or_one_line(table):
    board_or_line({"crystal_hz": 12_000_000, **table})


@given(st.data())
@examples(200)
def test_a_text_with_random_edits_is_a_board_or_one_line(data):
    text = data.draw(st.sampled_from(TEXTS))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 5))
        text = text[:at] + data.draw(st.text(max_size=3) | WORDS) + text[at + length :]
    with suppress(TomlError):
        board_or_line(tables(text))


@st.composite
def shuffled(draw, table):
    return {
        key: draw(shuffled(table[key])) if isinstance(table[key], dict) else table[key]
        for key in draw(st.permutations(sorted(table)))
    }


@pytest.mark.parametrize("text", [FULL, CAR])
@given(st.data())
@examples(30)
def test_the_order_of_a_file_changes_nothing(text, data):
    spec, netlist = board_or_line(data.draw(shuffled(tomllib.loads(text))))
    assert spec == board(text)
    assert netlist == resolve(board(text))
    assert tomli_w.dumps(table_of(spec)["parts"]) == tomli_w.dumps(table_of(board(text))["parts"])


def test_many_parts_in_a_chain_are_refused_at_once():
    parts = {f"p{n}": {"part": "led", "pins": {"pin": f"p{n + 1}.pin"}} for n in range(63)}
    parts["p63"] = {"part": "led", "pins": {"pin": "p0.pin"}}
    with pytest.raises(BadInput, match=r"name each other|leads over"):
        board_of_table({"crystal_hz": 12_000_000, "parts": parts}, "x")
