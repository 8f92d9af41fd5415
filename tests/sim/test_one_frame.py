"""The page about one frame's way: it is what its command writes, and its steps fit together."""

import itertools
from pathlib import Path

import pytest

from benchmarks import one_frame_page, one_frame_pictures
from benchmarks.one_frame import Way, edges_of
from miro_exact.clock import CONTROL_PERIOD_TICKS

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def way():
    return Way()


def test_the_page_in_the_tree_is_what_the_command_writes(way):
    assert one_frame_page.page(way) == (DOCS / "one-frame.md").read_text("utf-8")


@pytest.mark.slow
def test_the_command_draws_the_pictures_that_the_page_shows(way, tmp_path):
    one_frame_pictures.draw(way, tmp_path)
    drawn = sorted(file.name for file in tmp_path.iterdir())
    assert drawn == sorted(file.name for file in DOCS.glob("one-frame-*.png"))
    text = (DOCS / "one-frame.md").read_text("utf-8")
    assert all(f"({name})" in text for name in drawn)
    assert all((tmp_path / name).stat().st_size < 300_000 for name in drawn)


def test_the_law_gets_the_posture_that_was_measured_in_the_followed_frame(way):
    assert way.answer.robots[0].measurement == way.pair.sighting
    assert way.pair.sighting.tick == way.before.tick == way.answer.tick - CONTROL_PERIOD_TICKS


def test_the_motion_controllers_are_loaded_with_what_the_law_gave(way):
    control = way.answer.robots[0].control
    assert control is not None
    loaded = [int.from_bytes(event.data[2:], "big") >> 8 for event in way.commands[:2]]
    assert loaded == [control.left, control.right]
    assert [event.opcode for event in way.commands] == [0x1F, 0x1F, 0x01]


def test_the_wire_carries_the_characters_that_the_robot_received(way):
    edges = way.edges["rxd"]
    for index, event in enumerate(way.received):
        begin = way.sent.tick + 25_000 * index
        bits = [level_at(edges, begin + 2500 * bit + 1250) for bit in range(10)]
        assert bits == [0, *(event.value >> bit & 1 for bit in range(8)), 1]


def test_no_time_of_the_cpu_is_missing_between_the_last_character_and_the_start(way):
    assert way.on_the_way[0].start_tick - way.received[-1].tick < 24
    assert all(one.end_tick == other.start_tick for one, other in itertools.pairwise(way.on_the_way))


def test_a_waveform_is_read_back_tick_by_tick():
    text = "$var wire 1 ! rxd $end\n#0\n1!\n#41\n0!\n#1000000000\n1!\n"
    assert edges_of(text) == {"rxd": [(0, 1), (1, 0), (24_000_000, 1)]}


def level_at(edges, tick):
    return [level for at, level in edges if at <= tick][-1]
