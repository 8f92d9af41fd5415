"""`mirotwin report` of a recording made at a port: robot and twin on one page."""

import re

import pytest

from mirotwin.recording.difference import Difference
from mirotwin.report.page.port_page import _marks
from tests.mirotwin.desk.rig import ROBOT

pytest.importorskip("bokeh")


@pytest.fixture
def page(mirotwin, drive):
    def made(robot):
        mirotwin("replay", drive, "--port", robot, "--allow-motion", "-q", "--out", "desk")
        code, _, err = mirotwin("report", "desk", "-o", "desk.html", "-q")
        assert code == 0, err
        return (drive.parent / "desk.html").read_text()

    return made


def test_an_equal_robot_and_its_twin_are_on_one_page(page):
    text = page(ROBOT)
    assert "The robot answers as its twin does." in text
    assert "Robot 0 and its twin" in text
    for name in ("left-moved", "right-moved", "flags", "accepted", "rejected"):
        assert f'id="plot-0-{name}"' in text


def test_where_they_part_stands_in_the_table(page):
    text = page(f"{ROBOT}&set=network.radio.lost_frames=0.2")
    assert ">differs<" in text
    assert re.search(r"<td>/net0/robot0/(answer|accepted|left moved)</td>", text)


def test_a_difference_is_marked_in_the_plot_of_its_channel_and_in_no_other():
    left = Difference(24_000_000, 29, 0, 0, "left moved", 408, -414)
    lost = Difference(48_000_000, 59, 0, 0, "answer", None, "to question 5")
    found = [left, left, lost]
    assert _marks(found, 0, "left moved") == [1.0, 2.0]
    assert _marks(found, 0, "flags") == [2.0]
    assert _marks(found, 1, "left moved") == []
