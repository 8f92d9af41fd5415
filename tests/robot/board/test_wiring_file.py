"""A board file is built as it says, or refused in one line that names it: whatever numbers and nets it has."""

from importlib import resources

import pytest

from miro_robot.board import Board
from miro_robot.plant import Plant
from miro_robot.wiring import WiringError, load_wiring

MIRO = resources.files("miro_robot.boards").joinpath("miro.toml").read_text("utf-8")
LATCH = '\n[[latch]]\nname = "OUT"\naddress = {address}\nmask = {mask}\ninitial = {initial}\n'
SOUND = {"address": "0x8000", "mask": "0xC000", "initial": "0"}
FREE = ("P1.4", "P1.5", "P1.6", "P1.7", "P2.6", "P2.7", "P3.4", "P3.5", "P3.6", "P3.7")


def made(folder, text):
    path = folder / "board.toml"
    path.write_text(text)
    return Board(load_wiring(path), Plant(), 0, 3)


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
    with pytest.raises(
        WiringError, match=rf"board\.toml: latch\[0\].{key}: is out of range; must be {limit}"
    ):
        made(tmp_path, MIRO + LATCH.format(**{**SOUND, key: value}))


def test_any_number_of_pins_follows_an_interrupt_output(tmp_path):
    more = [f'"{pin}" = "left.hi"\n' for pin in FREE]
    driven = made(tmp_path, MIRO + "".join(more)).wiring.cpu_inputs()
    assert len([source for _, _, source, _ in driven if source.endswith(".hi")]) == 2 + len(FREE)


def test_more_buffers_than_fit_are_refused_and_not_left_out(tmp_path):
    made(tmp_path, MIRO + "\n[[buffer]]\naddress = 1\n" * 8)
    with pytest.raises(WiringError, match="9 buffers, at most 8 fit"):
        made(tmp_path, MIRO + "\n[[buffer]]\naddress = 1\n" * 9)


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 5000, "a = " + "9" * 5000, "a" + ".b" * 5000 + " = 1", "#" * 600_000]
)
def test_text_that_is_no_board_is_refused_at_once(tmp_path, text):
    with pytest.raises(WiringError, match=r"board\.toml"):
        made(tmp_path, text)
