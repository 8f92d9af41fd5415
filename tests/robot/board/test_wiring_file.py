"""The fast board is built as a board file says, or the file is refused in one line that names it."""

from importlib import resources

import pytest

from miro_robot.board import Board
from miro_robot.parts.netlist import PartPin
from miro_robot.parts.resolve import resolve
from miro_robot.plant import Plant
from miro_robot.wiring import CHIP_INPUTS, SIDES, WiringError, load_wiring
from miro_sim.scenario.board_file import load_board

MIRO = resources.files("miro_robot.boards").joinpath("miro.board.toml").read_text("utf-8")
LATCH = "\n[latches.OUT]\naddress = {address}\nmask = {mask}\ninitial = {initial}\n"
SOUND = {"address": "0x8000", "mask": "0xC000", "initial": "0"}
FREE = ("P1.4", "P1.5", "P1.6", "P1.7", "P2.6", "P2.7", "P3.4", "P3.5", "P3.6", "P3.7")


def made(folder, text):
    path = folder / "own.board.toml"
    path.write_text(text)
    return Board(load_wiring(path), Plant(), 0, 3)


def test_the_fast_board_is_wired_as_the_nets_of_the_file():
    spec, wiring = load_board("miro"), load_wiring()
    netlist = resolve(spec)
    parts = dict(zip(spec.parts, netlist.parts, strict=True))
    for side in SIDES:
        names = [pin.name for pin in spec.parts[side].keys.PINS]
        for pin in CHIP_INPUTS:
            bank, bit, inverted = wiring.chip_input(side, pin)
            assert parts[side][names.index(pin)] == PartPin(netlist.ports[8 * bank + bit], bool(inverted))
        assert [parts[side][bit].net for bit in range(8)] == list(netlist.ports[:8])
    driven = {8 * port + bit: source for port, bit, source, _ in wiring.cpu_inputs()}
    assert driven == {26: "left.hi", 27: "right.hi", 8: "slot.0", 9: "slot.1", 10: "slot.2", 11: "three"}


@pytest.mark.parametrize(
    ("key", "value", "limit"),
    [
        ("address", "0x10000", "<= 65535"),
        ("address", "-1", ">= 0"),
        ("address", "9" * 30, "<= 65535"),
        ("mask", "0x10000", "<= 65535"),
        ("initial", "256", "<= 255"),
    ],
)
def test_a_number_that_no_bus_has_is_refused(tmp_path, key, value, limit):
    made(tmp_path, MIRO + LATCH.format(**SOUND))
    message = rf"own\.board\.toml: latches.OUT.{key}: is out of range; must be {limit}"
    with pytest.raises(WiringError, match=message):
        made(tmp_path, MIRO + LATCH.format(**{**SOUND, key: value}))


def test_any_number_of_pins_follows_an_interrupt_output(tmp_path):
    nets = f"\n[nets]\nINT = {['P3.2', *FREE]}\n"
    driven = made(tmp_path, MIRO.replace("!P3.2", "!INT") + nets).wiring.cpu_inputs()
    assert len([source for _, _, source, _ in driven if source.endswith(".hi")]) == 2 + len(FREE)


def test_more_buffers_than_fit_are_refused_and_not_left_out(tmp_path):
    buffers = [f"\n[buffers.B{n}]\naddress = {n}\npins = []\n" for n in range(9)]
    made(tmp_path, MIRO + "".join(buffers[:8]))
    with pytest.raises(WiringError, match="9 buffers, at most 8 fit"):
        made(tmp_path, MIRO + "".join(buffers))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('cs = "P2.3"\n', "", 'parts.left.pins: pin cs is not connected; add cs = ".."'),
        ('"P2.3"', '"P2.8"', "parts.left.pins.cs: 'P2.8' drives no LM629 of the fast board; name a port pin"),
        ('"P2.3"', '"OUT.1"', r"parts.left.pins.cs: there is no latch 'OUT'; add \[latches.OUT\]"),
        ('"!P3.2"', '"!OUT.1"', "parts.left.pins.hi: 'OUT.1' is no port pin"),
        ('"!P3.2"', '"!P3.3"', "parts.right.pins.hi: P3.3 is driven by !left.hi, too; use another pin"),
        ('"!P3.2"', '"!P0.2"', "P0.2 is a pin of the data bus, nothing else can drive it"),
        ('d3 = "P0.3"', 'd3 = "P0.4"', "parts.left.pins: the fast board has one data bus; wire d0 to d7 of both"),
        ("[parts.left]", "[parts.other]\npart = 'led'\n[parts.left]", None),
        ('part = "lm629"\n[parts.left.pins]', "part = 'led'\n[parts.left.pins]", "parts.left: the fast board has two"),
        ("24_000_000", "12_000_000", "crystal_hz: the fast board has 24000000 only"),
        ('chip = "at89c52"', 'data = "P0"', "data: this is an old wiring file, not a board file; write its parts"),
    ],
)  # fmt: skip
def test_what_the_fast_board_cannot_be_is_one_line(tmp_path, old, new, message):
    assert old in MIRO
    text = MIRO.replace(old, new, 1)
    if message is None:
        made(tmp_path, text)
        return
    with pytest.raises(WiringError, match=rf"own\.board\.toml: .*{message}"):
        made(tmp_path, text)


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 5000, "a = " + "9" * 5000, "a" + ".b" * 5000 + " = 1", "#" * 600_000]
)
def test_text_that_is_no_board_is_refused_at_once(tmp_path, text):
    with pytest.raises(WiringError, match=r"own\.board\.toml"):
        made(tmp_path, text)
