"""`mirotwin report A B`: both runs on one page, where they first differ, what they were not made alike from."""

import base64
import json
import math
import struct

import pytest

from mirotwin.recording.compare import CompareRule, differences
from mirotwin.recording.reader import read
from tests.mirotwin.board_files import SCENARIO, board_folder
from tests.mirotwin.report.page.conftest import FIG6
from tests.mirotwin.report.page.test_run_page import Markup

KEY = "network.0.robot.0.controller.q1_per_s"


@pytest.fixture(scope="module")
def weaker(mirotwin, folder):
    """The folder of a shorter run of fig6 with another gain."""
    line = ("run", "fig6", "--seed", 3, "--set", "duration_s=1.2", "--set", f"{KEY}=0.8", "--no-figure", "-q")
    mirotwin.succeeds(*line, "--out", folder / "weaker")
    return folder / "weaker"


@pytest.fixture(scope="module")
def pair_page(mirotwin, folder, fig6, weaker):
    mirotwin.succeeds("report", fig6, weaker, "-o", folder / "pair.html", "-q")
    return folder / "pair.html"


@pytest.fixture(scope="module")
def pair(pair_page):
    return Markup(pair_page)


def numbers(text, count):
    return struct.unpack(f"<{count}d", base64.b64decode(text))


def test_both_robots_go_where_they_went_and_the_shorter_run_ends_before_the_other(pair, fig6, weaker):
    data = pair.data
    count = len(data["ticks"])
    runs = [read(one / "run.mcap").periods for one in (fig6, weaker)]
    assert count == len(runs[0]) > len(runs[1])
    assert len(data["robots"]) == 2
    for robot, periods in zip(data["robots"], runs, strict=True):
        xs = numbers(robot["truth"][0], count)
        assert list(xs[: len(periods)]) == [period.robots[0].truth.x_m for period in periods]
        assert all(map(math.isnan, xs[len(periods) :]))


def test_the_first_difference_is_that_of_the_recordings_and_is_marked(pair, fig6, weaker):
    runs = [read(one / "run.mcap").periods for one in (fig6, weaker)]
    first = differences(*runs, CompareRule(host=True))[0]
    assert f"in control period {first.period}" in pair.text
    assert first.line(("A", "B")) in pair.text
    assert pair.data["failures"] == [first.tick]


def test_the_head_names_what_they_were_not_made_alike_from(pair, mirotwin, fig6, weaker):
    found = json.loads(mirotwin("diff", fig6, weaker, "--json")[1])["sources"]
    assert KEY in {one["key"] for one in found}
    for one in found:
        assert f"{one['key']} {one['a']} {one['b']}" in pair.text
    assert f"They were not made from the same: {found[0]['key']} and {len(found) - 1} more." in pair.text
    assert "A has 45 control periods, B has 36." in pair.text


def test_a_run_beside_itself_is_alike(mirotwin, fig6, tmp_path):
    mirotwin.succeeds("report", fig6, fig6, "-o", tmp_path / "same.html", "-q")
    same = Markup(tmp_path / "same.html")
    assert "alike in all that was recorded" in same.text
    assert "Both were made from the same scenario, seed and firmware" in same.text
    assert same.data["failures"] == []


def test_inner_values_that_one_law_alone_has_are_no_difference(mirotwin, fig6, folder):
    line = ("run", *FIG6[:5], "--set", "network.robot.controller.law=kanayama", "--no-figure", "-q")
    assert mirotwin(*line, "--out", folder / "law")[0] == 0
    mirotwin.succeeds("report", fig6, folder / "law", "-o", folder / "laws.html", "-q")
    text = Markup(folder / "laws.html").text
    assert "yang_kim → kanayama" in text
    assert "/net0/robot0/control v_m_s" in text
    assert "inner.u1" not in text


def test_robots_of_one_run_only_are_named_and_left_out(mirotwin, fig6, two, tmp_path):
    mirotwin.succeeds("report", two, fig6, "-o", tmp_path / "some.html", "-q")
    some = Markup(tmp_path / "some.html")
    assert "Only A has net0/robot2." in some.text
    assert [robot["name"] for robot in some.data["robots"]] == ["net0/robot0"] * 2


def test_a_stream_file_is_run_for_its_half_of_the_page(mirotwin, fig6, tmp_path):
    mirotwin.succeeds("export", fig6 / "run.mcap", "--out", tmp_path / "hand.stream", "-q")
    mirotwin.succeeds("report", fig6, tmp_path / "hand.stream", "-o", tmp_path / "x.html", "-q")
    assert "fig6 and hand.stream" in Markup(tmp_path / "x.html").text


def test_a_window_cuts_both(mirotwin, fig6, weaker, tmp_path):
    line = ("report", fig6, weaker, "--from", "500ms", "--to", "1s", "-o", tmp_path / "x.html", "-q")
    mirotwin.succeeds(*line)
    data = Markup(tmp_path / "x.html").data
    assert (data["first"], len(data["ticks"])) == (14, 16)


def test_the_page_is_the_same_each_time_and_names_no_folder(mirotwin, fig6, weaker, pair_page, tmp_path):
    mirotwin.succeeds("report", fig6 / "run.mcap", weaker, "-o", tmp_path / "again.html", "-q")
    assert (tmp_path / "again.html").read_bytes() == pair_page.read_bytes()
    assert str(fig6.parent) not in pair_page.read_text()


def test_what_has_no_page_with_another_is_refused_in_one_line(mirotwin, fig6, weaker, folder, tmp_path):
    (tmp_path / "board").mkdir()
    board = board_folder(tmp_path / "board", SCENARIO)
    mirotwin.succeeds("run", board, "--out", board.parent / "run", "-q")
    (tmp_path / "one.toml").write_text(
        'name = "one"\nduration_s = 0.1\n[[network]]\n[[network.robot]]\nslot = 1\nreference.kind = "line"\n'
    )
    assert mirotwin("run", tmp_path / "one.toml", "--out", tmp_path / "one", "--no-figure", "-q")[0] == 0
    (tmp_path / "rows.parquet").write_bytes(b"PAR1")
    out = ("-o", tmp_path / "x.html", "-q")
    for words, said in (
        ((fig6, board.parent / "run"), "is of a board: two runs of robots have one page"),
        ((fig6, tmp_path / "one"), "has no robot in common with"),
        ((fig6, tmp_path / "rows.parquet"), "holds the results of a campaign; `mirotwin campaign page"),
        ((fig6, tmp_path / "gone"), "No such file or directory"),
        ((fig6, weaker, "--firmware", "x.ihx"), "--firmware is for the page of one run."),
        ((fig6, weaker, "--from", "1.4s"), "--from 1.4s: the run ends at tick"),
    ):
        assert said in mirotwin.refuses("report", *words, *out)
    assert not (tmp_path / "x.html").exists()
