"""Scenario files of boards: what they hold, and what is wrong with one, in one line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_robot.board_spec import BoardSpec
from miro_sim.scenario.board_file import load_board
from miro_sim.scenario.board_scenario import BoardText, any_of_text, load_any
from miro_sim.scenario.file import load
from tests.mirotwin.board_files import SCENARIO, board_folder


def test_a_scenario_names_its_board_its_image_and_what_is_put(tmp_path):
    text = load_any(str(board_folder(tmp_path)))
    scenario = text.scenario
    assert (scenario.name, scenario.board.name, scenario.clock) == ("lamp", "lamp", 11_059_200)
    assert (scenario.duration_ticks, scenario.put) == (5_529_600, {"key.pressed": True})
    assert text.firmware == str(tmp_path / "lamp.hex")


def test_a_scenario_sets_straps_and_settings_change_single_keys_of_the_board(tmp_path):
    path = str(board_folder(tmp_path, SCENARIO + "straps = { mode = 0 }\n"))
    settings = ("board.parts.key.bounce_ms=0", "put.key.pressed=false", "duration_s=1")
    scenario = load_any(path, settings).scenario
    assert load_any(path).scenario.board.straps["mode"].level == 0
    assert scenario.board.parts["key"].keys.bounce_ms == 0.0
    assert (scenario.put, scenario.duration_ticks) == ({"key.pressed": False}, 11_059_200)


def test_its_text_is_the_same_scenario_and_depends_on_no_file(tmp_path):
    text = load_any(str(board_folder(tmp_path)), ("board.parts.key.bounce_ms=1",))
    assert any_of_text(text.text, "").scenario == text.scenario


def test_a_scenario_may_be_another_one_with_keys_changed(tmp_path):
    board_folder(tmp_path)
    other = tmp_path / "off.scenario.toml"
    other.write_text('scenario = "lamp.scenario.toml"\nname = "off"\nset = { put.key.pressed = false }\n')
    text = load_any(str(other))
    assert (text.scenario.name, text.scenario.put) == ("off", {"key.pressed": False})
    assert text.firmware == str(tmp_path / "lamp.hex")


def test_a_board_is_a_scenario_without_a_duration(tmp_path):
    board = str(board_folder(tmp_path).with_name("lamp.board.toml"))
    assert load_any(board, ("duration_s=2",)).scenario.duration_ticks == 22_118_400
    with pytest.raises(BadInput, match=r"duration_s: how long to run is missing; give --for TIME"):
        load_any(board)


def test_scenarios_of_robots_are_read_as_before():
    assert load_any("fig6").scenario == load("fig6").scenario
    assert not isinstance(load_any("fig6", ("duration_s=1",)), BoardText)


def test_a_board_that_is_set_in_a_scenario_of_robots_is_refused():
    with pytest.raises(
        BadInput, match=r"board: is for a scenario of a board, and this one is for robots; remove it"
    ):
        load_any("fig6", ("board.crystal_hz=1",))


def test_a_command_for_robots_refuses_it(tmp_path):
    with pytest.raises(BadInput, match=r"board: the scenario is for a board, and this command takes robots"):
        load(str(board_folder(tmp_path)))


WRONG = [
    ('board = "nose.board.toml"\nduration_s = 1', r"nose.board.toml: no such file"),
    ('board = "nose"\nduration_s = 1', r"nose: board: no such board"),
    ("board = 3\nduration_s = 1", r"board: expected a path, a name or a table, got 3"),
    ('board = "../lamp.board.toml"\nduration_s = 1', r"board: .*lies outside of the folder"),
    ('board = "lamp.board.toml"', r"duration_s: this key is missing; add it"),
    (
        SCENARIO.replace("0.5", "-1"),
        r"duration_s: -1 is out of range|duration_s: is out of range; must be > 0",
    ),
    (
        SCENARIO.replace("true", "3"),
        r"put.key.pressed: key.pressed = 3: expected true or false, got a whole number",
    ),
    (SCENARIO.replace("key.pressed", "key.presed"), r"put.key.presed: .*did you mean pressed"),
    (SCENARIO + "straps = { mod = 1 }", r"straps.mod: the board has no such strap; did you mean mode"),
    (SCENARIO + "straps = { mode = 2 }", r"straps.mode: is out of range; must be <= 1"),
    (SCENARIO + "[[network]]\nrobots = 3", r"network: is for robots, and this scenario is for a board"),
    (SCENARIO + "durations = 3", r"durations: unknown key; did you mean duration_s"),
    (SCENARIO + "bit_ticks = 3", r"a bit of 3 ticks is outside 32"),
    ("[board]\ncrystal_hz = 3\n[x]\n", r"x: unknown key"),
    ("duration_s = 1\n[board]\ncrystal_hz = 3", r"board.crystal_hz: 3 is out of range"),
    (
        'duration_s = 1\n[board]\ncrystal_hz = 12000000\n[board.parts.a]\npart = "lef"',
        r"board.parts.a.part: .*led",
    ),
]


@pytest.mark.parametrize(("text", "what"), WRONG, ids=range(len(WRONG)))
def test_what_is_wrong_is_one_line_with_file_and_place(text, what, tmp_path):
    path = str(board_folder(tmp_path, text))
    with pytest.raises(BadInput, match=what) as caught:
        load_any(path)
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)


PIECES = [
    "board = ",
    "duration_s = 1\n",
    "put = ",
    "{ key.pressed = true }",
    '"lamp.board.toml"',
    "straps = {",
    "}",
]
PIECES += [
    "[board]\n",
    "crystal_hz = 12000000\n",
    "[board.parts.a]\n",
    'part = "led"\n',
    'pins.pin = "P1.0"\n',
    "[",
    "=",
]
PIECES += [
    "[[step]]\n",
    "[expect]\n",
    'scenario = "fig6"\n',
    "set = ",
    '"\n',
    "{}\n",
    "9",
    "nan",
    "a.b",
    "\n",
]


@given(
    st.lists(st.sampled_from(PIECES), max_size=12).map("".join),
    st.lists(st.sampled_from(["board.x=1", "put=1", "a"])),
)
def test_any_text_is_a_scenario_or_bad_input(text, settings):
    try:
        any_of_text(text, "", settings)
    except BadInput as error:
        lines = str(error).split("\n")
    else:
        return
    assert len(lines) == 1


def test_pins_of_a_board_without_parts_are_seen_as_those_of_any_other(tmp_path):
    """The bare processor of `--bare` has no nets; a board file has, whatever is on it."""
    (tmp_path / "bare.board.toml").write_text("crystal_hz = 12_000_000\n")
    spec = load_board(str(tmp_path / "bare.board.toml"))
    assert spec.is_wired
    assert not BoardSpec().is_wired
