"""Scenario files of several boards on one line."""

import shutil
from pathlib import Path

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol.toml_text import tables
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import (
    any_of_text,
    board_of_tables,
    check_single,
    load_any,
    tables_of_board,
)
from miro_sim.world.world import World
from mirotwin.shell.firmware_image import image_for

MONITOR = Path(__file__).parents[2] / "examples/boards/monitor"
TWO = """
duration_s = 0.1
[board.meter]
file = "meter.board.toml"
firmware = "meter.ihx"
[board.panel]
file = "panel.board.toml"
firmware = "panel.ihx"
"""


@pytest.fixture
def folder(tmp_path):
    for path in MONITOR.glob("*.*"):
        shutil.copy(path, tmp_path)
    return tmp_path


def text_of(folder, text):
    return any_of_text(text, str(folder / "two.scenario.toml"))


def digest(text):
    world = World(text.scenario, 0, image_for(text))
    world.run_to(world.scenario.end_tick)
    return world.digest


def test_the_order_of_the_tables_changes_nothing(folder):
    meter, panel = TWO.split("[board.panel]")
    head, meter = meter.split("[board.meter]")
    turned = f"{head}[board.panel]{panel}[board.meter]{meter}"
    assert text_of(folder, turned).scenario == text_of(folder, TWO).scenario
    assert digest(text_of(folder, turned)) == digest(text_of(folder, TWO))


def test_what_is_read_depends_on_no_file(folder):
    scenario = text_of(folder, TWO).scenario
    again = board_of_tables(tables_of_board(scenario), "")
    assert again.scenario.others == scenario.others
    assert again.scenario.board == scenario.board


def test_a_setting_reaches_a_board_and_a_part(folder):
    path = folder / "two.scenario.toml"
    path.write_text(TWO)
    changed = load_any(str(path), ["put.panel.bus.broken=true", "board.meter.board.crystal_hz=11059200"])
    assert changed.scenario.put == {"panel.bus.broken": True}


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("board.meter.file=other.board.toml", "cannot be set; change it in the scenario's file"),
        ("board.panel.firmware=other.ihx", "cannot be set; change it in the scenario's file"),
        ("board.metre.firmware=other.ihx", "cannot be set; change it in the scenario's file"),
        ("board.parts.bus.re=0", "board.parts.bus: unknown key; keys here: file"),
    ],
)
def test_a_setting_that_reaches_no_board_is_refused(folder, setting, said):
    path = folder / "two.scenario.toml"
    path.write_text(TWO)
    with pytest.raises(BadInput) as found:
        load_any(str(path), [setting])
    assert said in str(found.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ('file = "panel.board.toml"', 'file = "other.board.toml"'),
            "board.panel.crystal_hz: 12000000 Hz, and meter has 11059200 Hz; boards on one line need one crystal",
        ),
        (('firmware = "panel.ihx"', ""), "board.panel.firmware: no firmware is named; write firmware ="),
        (("[board.meter]", '[board."1 a"]'), "cannot be the name of a board"),
        (("duration_s = 0.1", "duration_s = 0.1\nstraps = { a = 0 }"), "write board.meter.straps"),
        (
            ("duration_s = 0.1", "duration_s = 0.1\nput = { panle.bus.broken = true }"),
            "there is no board 'panle'",
        ),
        (("duration_s = 0.1", "duration_s = 0.1\nput = { panel.buss.broken = true }"), "no part 'buss'"),
        (
            ("duration_s = 0.1", 'duration_s = 0.1\nfirmware = "meter.ihx"'),
            "board.meter.firmware: is that of the whole scenario, which names one, too; leave one of them out",
        ),
        (('firmware = "meter.ihx"', 'firmware = "meter.ihx"\ncolour = 1'), "unknown key"),
        (
            ('file = "meter.board.toml"', 'fil = "meter.board.toml"'),
            "board.meter.fil: unknown key; did you mean file?",
        ),
        (('file = "meter.board.toml"', ""), "board.meter.file: this key is missing; add file ="),
        (
            ("duration_s = 0.1", "duration_s = 0.1\nput = { panel.bus.broken = 3 }"),
            "put.panel.bus.broken: bus.broken = 3",
        ),
    ],
)
def test_what_is_wrong_is_one_line_with_its_place(folder, change, said):
    other = (folder / "panel.board.toml").read_text().replace("11_059_200", "12_000_000")
    (folder / "other.board.toml").write_text(other)
    with pytest.raises(BadInput) as found:
        text_of(folder, TWO.replace(*change))
    assert said in str(found.value)
    assert str(found.value).count("\n") == 0


def test_a_value_and_a_pin_of_no_board_are_refused(folder):
    text = text_of(folder, TWO)
    device = World(text.scenario, 0, image_for(text)).device()
    device.check_put("meter.adc.ain0_v", 1.0)
    device.check_pin("panel.P3.5")
    with pytest.raises(ValueError, match=r"adc.ain0_v: there is no board 'adc'; write meter.adc.ain0_v"):
        device.check_put("adc.ain0_v", 1.0)
    with pytest.raises(ValueError, match=r"pannel.P3.5: there is no board 'pannel'; did you mean panel?"):
        device.check_pin("pannel.P3.5")
    with pytest.raises(ValueError, match=r"P3.5: there is no board 'P3'; write meter.P3.5"):
        text.scenario.at("P3.5")


def test_a_panel_without_its_wire_says_so(folder):
    longer = TWO.replace("duration_s = 0.1", "duration_s = 0.5\nput = { panel.bus.broken = true }")
    text = text_of(folder, longer)
    world = World(text.scenario, 0, image_for(text))
    world.run_to(world.scenario.end_tick)
    assert world.device().value("panel.lcd.row1") == "no answer       "


def test_a_scenario_of_the_example_is_whole():
    read = tables((MONITOR / "overload.scenario.toml").read_text())
    assert set(read["board"]) == {"meter", "panel"}


@pytest.mark.parametrize("command", ["report", "fuzz", "CSV"])
def test_a_command_for_one_board_says_so(folder, command):
    scenario = text_of(folder, TWO).scenario
    with pytest.raises(BadInput, match=f"2 boards on one line, and {command} takes one"):
        check_single(scenario, "two.scenario.toml", command)
    check_single(BoardScenario(), "one.scenario.toml", command)


def test_a_stream_of_it_is_read_again(folder):
    text = text_of(
        folder, TWO.replace("duration_s = 0.1", "duration_s = 0.1\nput = { panel.bus.broken = true }")
    )
    flat = tables_of_board(text.scenario)
    assert flat["put"] == {"panel.bus.broken": True}
    assert board_of_tables(flat, "").scenario.put == text.scenario.put
