"""`mirotwin boards`: boards and parts as a user looks them up."""

import json

import pytest

from miro_sim.scenario.board_file import board_of_table, board_text, builtin_boards, load_board
from miro_sim.scenario.parts import PARTS
from mirotwin.run.boards_command import page_of
from tests.exact import distribution
from tests.sim.test_board_file import SONAR


def test_boards_are_listed_with_a_line_each(mirotwin):
    rows = {line.split()[0]: line for line in mirotwin.succeeds("boards").splitlines() if line.strip()}
    assert {*builtin_boards()} <= set(rows)
    assert rows["miro"].endswith("at89c52  24 MHz   differential_drive, lm629")


def test_a_part_is_shown_with_its_drawing_pins_keys_values_and_sheet(mirotwin):
    out = mirotwin.succeeds("boards", "show", "button")
    assert "pin --o/ o-- ground" in out
    assert "bounce_ms  a number in milliseconds, 0 to 100  0.0" in out
    assert '"ground" or "vcc"' in out
    assert "pressed         true or false" in out
    assert "closed           whether its contact is closed" in out
    assert "sheet: J. G. Ganssle" in out


def test_a_boards_file_is_printed_as_it_stands(mirotwin, tmp_path):
    assert mirotwin("boards", "show", "miro") == (0, board_text("miro"), "")
    table = json.loads(mirotwin.succeeds("boards", "show", "miro", "--json"))
    assert board_of_table(table, "") == load_board("miro")


@pytest.mark.parametrize("name", PARTS.own)
def test_every_part_has_a_page(mirotwin, name):
    page = json.loads(mirotwin.succeeds("boards", "show", name, "--json"))
    assert page["name"] == name
    assert page["about"].endswith(".")
    assert page["pins"]
    assert page["sheet"]
    assert [pin.name for pin in PARTS.find(name).PINS] == [pin["name"] for pin in page["pins"]]


def test_the_page_of_a_part_of_others_says_where_it_comes_from(tmp_path, monkeypatch):
    distribution.install(tmp_path, "sonar-kit", "1.2", {"sonar": "sonar_kit:Sonar"}, "parts", sonar_kit=SONAR)
    monkeypatch.syspath_prepend(tmp_path)
    assert page_of("sonar").origin == "sonar-kit 1.2"


def test_a_part_of_a_file_is_shown(mirotwin, tmp_path):
    path = tmp_path / "sonar.py"
    path.write_text('"""A ranger.\n\nits drawing\n"""\n' + SONAR)
    out = mirotwin.succeeds("boards", "show", "sonar", "--part", f"{path}:Sonar")
    assert out.startswith("A ranger.\n\nits drawing\n")
    assert "cm   a number  1.0" in out
    assert "from: sonar.py:Sonar" in out


def test_limits_are_shown_as_whole_numbers(mirotwin):
    assert "a whole number, 1200 to 1382400 " in mirotwin.succeeds("boards", "show", "bluetooth")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["show", "ledd"], "ledd: no such board and no such part; did you mean led?"),
        (["show", "none.board.toml"], "none.board.toml: no such file"),
        (["led"], "No such command 'led'; did you mean `boards show led`?"),
        (["show", "led", "--part", "sonar"], "--part: 'sonar' is not FILE.py:CLASS; write it as my_part.py:Parameters"),
    ],
)  # fmt: skip
def test_what_is_neither_board_nor_part_is_one_line(mirotwin, arguments, message):
    assert message in mirotwin.ends(2, "boards", *arguments)
