"""The picture of a run: panels with round numbers, small, the same bytes every time."""

import xml.etree.ElementTree as ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from miro_sim.periods import Control
from mirotwin.recording.track import Tracks
from mirotwin.report.figure import draw
from mirotwin.report.svg import MOST_POINTS, Drawing, Panel, PanelBox, ticks
from tests.mirotwin.synthetic import periods

SVG = "{http://www.w3.org/2000/svg}"


def drawn(path, run, **how):
    draw(Tracks(run), path, **{"scenario": "fig6", "seed": 1, **how})
    return ElementTree.fromstring(path.read_bytes())


def test_the_same_run_gives_the_same_picture_whatever_its_title(tmp_path):
    run = list(periods(40, [(0, 0), (0, 1)]))
    first = drawn(tmp_path / "a.svg", run, title="costs $5 & <more> _")
    drawn(tmp_path / "b.svg", run, title="costs $5 & <more> _")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert "fig6, seed 1: costs $5 & <more> _" in [text.text for text in first.iter(f"{SVG}text")]


@pytest.mark.parametrize(("count", "panels"), [(0, 4), (4, 8), (8, 12), (40, 12)])
def test_inner_values_have_panels_below_up_to_eight_of_them(tmp_path, count, panels):
    inner = {f"value_{index}": 0.5 * index for index in range(count)}
    control = Control(0.2, 0.0, 1, 1, inner)
    run = [
        replace(one, robots=tuple(replace(it, control=control) for it in one.robots)) for one in periods(5)
    ]
    tree = drawn(tmp_path / "a.svg", run)
    assert sum(one.get("class") == "frame" for one in tree.iter(f"{SVG}rect")) == panels


def test_nothing_cannot_be_drawn(tmp_path):
    with pytest.raises(ValueError, match="nothing to draw"):
        draw(Tracks(), tmp_path / "a.svg", scenario="fig6", seed=1)


@given(st.floats(-1e3, 1e3), st.floats(1e-6, 1e6), st.integers(0, 12))
def test_numbers_of_an_axis_are_round_inside_it_and_about_as_many_as_asked_for(widths, width, most):
    low = widths * width
    marks = ticks(low, low + width, most)
    assert 1 <= len(marks) <= max(3, most) + 1
    assert all(low - 1e-6 * width <= value <= low + width * (1 + 1e-6) for value, _ in marks)
    assert len({text for _, text in marks}) == len(marks)


def test_a_value_that_is_no_number_is_left_out_and_one_value_has_an_axis(tmp_path):
    panel = Panel("one")
    panel.line([0.0, 1.0, 2.0], [1.0, float("nan"), 1.0], colour=1)
    drawing = Drawing(200, 200, ())
    drawing.add(panel, PanelBox(40, 20, 140, 140))
    drawing.write(tmp_path / "a.svg")
    assert "nan" not in (tmp_path / "a.svg").read_text("utf-8")
    assert panel.spans() == (0.0, 2.0, 0.5, 1.5)


def test_a_run_of_hours_has_a_picture_of_bounded_size(tmp_path):
    panel = Panel("long")
    panel.line(range(10 * MOST_POINTS), [index % 97 for index in range(10 * MOST_POINTS)], colour=1)
    drawing = Drawing(1000, 400, ())
    drawing.add(panel, PanelBox(60, 20, 900, 340))
    drawing.write(tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size < 20 * MOST_POINTS
