"""`mirotwin report` of a recording made at a port: robot and twin on one page."""

import re

import pytest

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
    for name in ("position_left", "position_right", "flags", "accepted", "rejected"):
        assert f'id="plot-0-{name}"' in text


def test_where_they_part_stands_in_the_table(page):
    text = page(f"{ROBOT}&set=network.radio.lost_frames=0.2")
    assert ">differs<" in text
    assert re.search(r"<td>/net0/robot0/(answer|accepted|left moved)</td>", text)
