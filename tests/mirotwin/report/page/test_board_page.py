"""`mirotwin report` of a board: pins, values, displays, serial text, steps; what is thinned is said."""

import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.report.page import board_watch
from mirotwin.report.page.board_watch import Wave
from tests.mirotwin import program
from tests.mirotwin.board_files import BOARD, SCENARIO, board_folder
from tests.mirotwin.report.page.test_run_page import Markup

ROVER = Path(__file__).parents[4] / "examples/boards/rover/pause.scenario.toml"
STEPS = """
[[step]]
wait_for = "text"
text = "R"
[[step]]
send = "text"
text = "hi"
[[step]]
put = { key.pressed = false }
[[step]]
wait_for = "value"
of = "lamp.on"
equals = false
within_ms = 50
"""
FAILS = STEPS.replace("lamp.on", "lamp.flashes").replace("equals = false", "above = 99")
PULSES = """
loop:
CPL P2.0
SJMP loop
"""


@pytest.fixture(scope="module")
def lamp(tmp_path_factory, mirotwin):
    """The folder of a run of a board that was driven by steps."""
    scenario = board_folder(tmp_path_factory.mktemp("lamp"), SCENARIO + STEPS)
    mirotwin.succeeds("run", scenario, "--out", scenario.parent / "run", "-q")
    return scenario.parent / "run"


@pytest.fixture(scope="module")
def page(lamp, mirotwin):
    mirotwin.succeeds("report", lamp, "-o", lamp.parent / "page.html", "-q")
    return lamp.parent / "page.html"


@pytest.fixture(scope="module")
def rover(tmp_path_factory, mirotwin):
    folder = tmp_path_factory.mktemp("rover")
    mirotwin.succeeds("run", ROVER, "--out", folder / "run", "-q")
    mirotwin.succeeds("report", folder / "run", "-o", folder / "page.html", "-q")
    return folder / "page.html"


def test_the_page_says_what_ran_and_that_it_equals_the_recording(page, lamp):
    said, summary = Markup(page).text, json.loads((lamp / "summary.json").read_text())
    for words in ("lamp", "stc89c52, 11.0592 MHz", summary["digest"][:12], "4 of 4 steps were done"):
        assert words in said
    assert "This page's own run of it equals the recording in all that the board did" in said


def test_a_page_of_a_board_fetches_nothing_and_names_no_folder_of_the_machine(page, lamp):
    assert [place for place in Markup(page).fetched if not place.startswith(("#", "data:"))] == []
    assert str(lamp.parent) not in page.read_text()


def test_another_process_makes_the_same_bytes(page, lamp, tmp_path):
    program.run("report", lamp, "-o", tmp_path / "again.html", "-q", check=True)
    assert (tmp_path / "again.html").read_bytes() == page.read_bytes()


def test_steps_puts_and_characters_stand_at_their_ticks(page):
    marks = Markup(page).data["marks"]
    steps = [(lane, text) for _, lane, _, text in marks if lane in ("steps", "put")]
    assert ("steps", "step 2: send text 'hi'") in steps
    assert ("put", "key.pressed = false") in steps
    sent = [(lane, text) for tick, lane, _, text in marks if lane in ("sent to it", "it sends")]
    assert ("sent to it", "hi") in sent
    assert "".join(text for lane, text in sent if lane == "it sends") == "Rhi"


def test_a_value_is_shown_as_it_was_at_each_moment(page):
    data = Markup(page).data
    ticks, values = data["values"]["lamp.on"]
    put_tick = next(tick for tick, lane, _, _ in data["marks"] if lane == "put")
    lit = dict(zip(ticks, values, strict=True))
    assert [bool(one) for one in lit.values()][-1] is False
    assert put_tick < max(lit) <= put_tick + 10 * data["ticks_per_s"] // 1000, "the key bounces for 3 ms"


def test_the_serial_text_stands_with_its_hex(rover):
    said = Markup(rover).text
    assert "from it SA 53 41" in said
    assert "to it p 70" in said


LINES = """
MOV RCAP2H,#0FFh
MOV RCAP2L,#0DCh
MOV T2CON,#34h
MOV SCON,#40h
loop:
MOV A,#61h
ACALL put
MOV A,#0Dh
ACALL put
MOV A,#0Ah
ACALL put
SJMP loop
put:
MOV SBUF,A
JNB TI,$
CLR TI
RET
"""


def test_each_line_of_serial_text_stands_at_its_own_time(tmp_path, mirotwin):
    scenario = board_folder(tmp_path, SCENARIO, program=LINES)
    mirotwin.succeeds("run", scenario, "--out", tmp_path / "run", "-q", "--for", "0.1s")
    mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "page.html", "-q")
    ticks = [int(tick) for tick in re.findall(r'<tr data-tick="(\d+)"', (tmp_path / "page.html").read_text())]
    assert len(ticks) > 25
    apart = [late - early for early, late in pairwise(ticks)]
    character = 10 * 1152
    assert all(3 * character <= one < 4 * character for one in apart), apart


OWN_PART = """
from miro_robot.parts.keys import IN, PartKeys, Pin
from miro_robot.parts.part import Part

class Gauge(PartKeys, frozen=True, kw_only=True, tag="gauge"):
    PINS = (Pin("pin", IN),)
    READS = {"level": "a number, or a word for what is none"}

    def make(self, place):
        return GaugePart(self, place)

class GaugePart(Part):
    def read(self, name, tick):
        return "empty" if self.levels & 1 else 0.5
"""


def test_a_value_that_is_a_word_at_times_is_drawn_as_bars(tmp_path, mirotwin, monkeypatch):
    monkeypatch.setattr(board_watch, "MOST_VALUES", 8)
    (tmp_path / "gauge.py").write_text(OWN_PART)
    gauge = '[parts.gauge]\npart = "gauge"\npins = { pin = "P2.0" }\n'
    scenario = board_folder(tmp_path, SCENARIO, BOARD + gauge, PULSES)
    part = f"--part={tmp_path / 'gauge.py'}:Gauge"
    mirotwin.succeeds("run", scenario, part, "--out", tmp_path / "run", "-q", "--for", "0.1s")
    mirotwin.succeeds("report", tmp_path / "run", part, "-o", tmp_path / "page.html", "-q")
    assert {"empty", 0.5} == {*Markup(tmp_path / "page.html").data["values"]["gauge.level"][1]}


def test_a_display_is_any_part_with_a_text_to_read(rover):
    text = rover.read_text()
    assert re.search(r'<pre class="glass">--- cm +\nstop +</pre>', text)
    values = Markup(rover).data["values"]["lcd.text"][1]
    assert any(rows.startswith("150 cm") for rows in values), values


def test_a_cars_way_stands_among_its_walls(tmp_path, mirotwin):
    mirotwin.succeeds("run", ROVER.parents[1] / "car/drives.scenario.toml", "--out", tmp_path / "run", "-q")
    mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "page.html", "-q")
    text, data = (tmp_path / "page.html").read_text(), Markup(tmp_path / "page.html").data
    assert text.count('<line class="wall"') == 4
    assert data["ways"] == {"car": ["car.x_cm", "car.y_cm", "car.heading_deg"]}
    x_cm, y_cm = (data["values"][path][1] for path in data["ways"]["car"][:2])
    assert (x_cm[0], y_cm[0]) == (40.0, 100.0)
    assert x_cm[-1] > 250


PICTURE = """
crystal_hz = 11_059_200
[parts.left]
part = "dc_motor"
pins = { a = "P1.0", b = "P1.1" }
[parts.right]
part = "dc_motor"
pins = { a = "P1.2", b = "P1.3" }
[parts.car]
part = "car"
pins = { left = "left.shaft", right = "right.shaft" }
picture = ["##..", "...#"]
cell_cm = 5
"""


def test_the_dark_cells_of_a_floor_are_drawn(tmp_path, mirotwin):
    scenario = board_folder(
        tmp_path, 'board = "lamp.board.toml"\nfirmware = "lamp.hex"\nduration_s = 0.2\n', PICTURE
    )
    mirotwin.succeeds("run", scenario, "--out", tmp_path / "run", "-q")
    mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "page.html", "-q")
    cells = re.findall(r'<rect x="([^"]+)" y="([^"]+)" width="5.0"', (tmp_path / "page.html").read_text())
    assert cells == [("15.0", "0.0"), ("0.0", "5.0"), ("5.0", "5.0")]


def test_the_lanes_are_the_nets_that_moved_in_the_order_of_the_board(rover):
    document = rover.read_text()
    names = [
        name for name in ("LEFT_A bridge.out1", "P1.2 lcd.e", "P2.4 eyes.echo") if f'"{name}"' in document
    ]
    assert len(names) == 3
    assert '"P3.7"' not in document


def test_a_window_shows_that_time_alone(lamp, tmp_path, mirotwin):
    mirotwin.succeeds("report", lamp, "-o", tmp_path / "page.html", "--from", "2ms", "--to", "0.2s", "-q")
    data = Markup(tmp_path / "page.html").data
    assert (data["first"], data["end"]) == (22_118, 2_211_840)
    assert all(ticks[0] == data["first"] for ticks, _ in data["values"].values())
    assert [
        tick
        for tick, lane, _, _ in data["marks"]
        if lane != "steps" and not data["first"] <= tick < data["end"]
    ] == []


def test_a_window_after_a_failure_marks_none(tmp_path, mirotwin):
    scenario = board_folder(tmp_path, SCENARIO + '[expect]\nvalue_at_most = { "lamp.flashes" = 0 }\n')
    assert mirotwin("run", scenario, "--out", tmp_path / "run", "-q")[0] == 1
    found = []
    for window in ((), ("--from", "0.4s")):
        mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "page.html", "-q", "--force", *window)
        found.append(len(Markup(tmp_path / "page.html").data["failures"]))
    assert found == [1, 0]


def test_edges_too_close_to_be_drawn_are_said_and_filled(tmp_path, mirotwin):
    scenario = board_folder(tmp_path, SCENARIO, program=PULSES)
    mirotwin.succeeds("run", scenario, "--out", tmp_path / "run", "-q")
    mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "page.html", "-q")
    said = Markup(tmp_path / "page.html").text
    assert "Filled: edges too close to be drawn one by one, on P2.0." in said
    assert "Of lamp.flashes not every change is drawn" not in said
    mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "part.html", "--to", "5ms", "-q")
    assert "Filled:" not in Markup(tmp_path / "part.html").text


def test_a_failed_test_of_a_board_leaves_its_page(tmp_path, mirotwin):
    scenario = board_folder(tmp_path, SCENARIO + FAILS)
    code, said, _ = mirotwin("test", scenario, "--artifacts", tmp_path / "left", "--pages")
    assert code == 1
    (folder,) = (tmp_path / "left").iterdir()
    assert f"page: mirotwin report {folder}" in said
    page = Markup(folder / "report.html")
    assert "failed test of a board" in page.text
    assert "lamp.flashes above 99 within" in page.text or "lamp.flashes = 4" in page.text


def test_a_failed_test_of_two_boards_names_no_page(tmp_path, mirotwin):
    monitor = ROVER.parents[1] / "monitor"
    for file in monitor.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    scenario = tmp_path / "overload.scenario.toml"
    scenario.write_text(scenario.read_text().replace("P 644W off", "never"))
    code, said, _ = mirotwin("test", scenario, "--artifacts", tmp_path / "left", "--pages")
    assert (code, "mirotwin replay" in said, "page" in said) == (1, True, False)
    case = next((tmp_path / "left").rglob("case.stream"))
    assert "page" not in case.with_name("report.txt").read_text()
    firmware = tmp_path / "meter.ihx"
    error = mirotwin.refuses(
        "export", case, "--firmware", firmware, "--as", "csv", "--out", tmp_path / "a.csv"
    )
    assert "2 boards on one line, and CSV takes one" in error


def test_a_case_of_a_bare_processor_has_a_page_without_pins(tmp_path, mirotwin):
    board_folder(tmp_path)
    case = tmp_path / "bare.stream"
    case.write_text(
        "# mirotwin stream 2\n#: end_tick = 4000000\n#:\n#: [bare]\n#: crystal_hz = 11059200\n#: bit_ticks = 1152\n"
        "400000 > 68 69\n"
    )
    mirotwin.succeeds("report", case, "--firmware", tmp_path / "lamp.hex", "-o", tmp_path / "page.html", "-q")
    said = Markup(tmp_path / "page.html").text
    assert "to it hi 68 69" in said
    assert "Pins" not in said


def test_a_recording_on_other_firmware_shows_where_it_parts(lamp, tmp_path, mirotwin):
    other = lamp.parent / "inverted.hex"
    mirotwin.succeeds("report", lamp, "--firmware", other, "-o", tmp_path / "page.html", "-q")
    said = Markup(tmp_path / "page.html").text
    assert "Played with another firmware, inverted.hex" in said
    assert "values lamp.on" in said


def test_a_broken_recording_has_a_page_as_far_as_it_goes(lamp, tmp_path, mirotwin):
    whole = (lamp / "run.mcap").read_bytes()
    (tmp_path / "run.part.mcap").write_bytes(whole[: len(whole) - 3000])
    mirotwin.ends(0, "report", tmp_path, "-o", tmp_path / "page.html", "-q")
    assert "broken off" in Markup(tmp_path / "page.html").text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--from", "9s"), "--from 99532800t: the recording goes from tick 0 to"),
        (("--from", "1s", "--to", "1s"), "the window is empty; --to must be later"),
        (("--part", "mine"), "'mine' is not FILE.py:CLASS"),
    ],
)
def test_bad_input_is_one_line(arguments, said, lamp, tmp_path, mirotwin):
    assert said in mirotwin.refuses("report", lamp, *arguments, "-o", tmp_path / "page.html", "-q")


@given(st.lists(st.integers(0, 10**7), min_size=1, max_size=200, unique=True), st.integers(1, 20))
def test_every_edge_is_drawn_or_within_a_stretch_that_is_filled(ticks, most):
    wave = Wave("P1.0", [], 0, np.array(sorted(ticks), dtype=np.int64))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(board_watch, "MOST_EDGES", most + 1)
        alone, close = wave.drawn(10**7)
    assert len(alone) + 2 * len(close) <= most + 1
    for tick in ticks:
        assert tick in alone or any(first <= tick <= last for first, last in close)
    assert not any(first <= tick <= last for tick in alone for first, last in close)


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=300))
def test_a_thinned_value_keeps_its_ends_and_extremes(values):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(board_watch, "MOST_VALUES", 40)
        kept = [values[at] for at in board_watch._thinned(values, 0, len(values))]
    assert len(kept) <= 40 + 4
    assert (kept[0], kept[-1], min(kept), max(kept)) == (values[0], values[-1], min(values), max(values))
