"""Pages of boards in a browser: the slider moves displays and values, all fits on a phone, nothing is complained of."""

from pathlib import Path

import pytest

from tests.mirotwin.board_files import board_folder
from tests.mirotwin.report.page import browser
from tests.mirotwin.report.page.browser import chromium, open_page

pytest.importorskip("selenium", reason=browser.MISSING)

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browser.MISSING), reason=browser.MISSING)]
ROVER = Path(__file__).parents[4] / "examples/boards/rover/pause.scenario.toml"


@pytest.fixture(scope="module")
def page(mirotwin, tmp_path_factory):
    folder = tmp_path_factory.mktemp("rover")
    mirotwin.succeeds("run", ROVER, "--out", folder / "run", "-q")
    mirotwin.succeeds("report", folder / "run", "-o", folder / "page.html", "-q")
    return folder / "page.html"


@pytest.fixture(scope="module")
def driver():
    with chromium() as found:
        yield found


def text(driver, selector):
    return driver.execute_script("return document.querySelector(arguments[0]).textContent", selector)


def test_the_slider_moves_the_display_and_the_values(driver, page):
    open_page(driver, page)
    assert text(driver, ".glass[data-path='lcd.text']").strip() == ""
    driver.execute_script("run.show(220)")
    assert text(driver, ".glass[data-path='lcd.text']").split() == ["150", "cm", "ahead"]
    assert text(driver, "#now [data-path='ahead.on']") in ("1", "true")
    assert text(driver, "#clock") == text(driver, "#now .moment") == "0.220 s"
    driver.execute_script("run.show(run.last)")
    assert text(driver, "#now [data-path='eyes.echo']") == "none"


def test_a_jump_goes_to_the_tick_of_a_character(driver, page):
    open_page(driver, page)
    driver.execute_script("document.querySelector('.serial .jump').click()")
    assert text(driver, ".serial tr.current .said") == "SA"


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 360])
def test_all_fits_into_the_window(driver, page, theme, width):
    open_page(driver, page, theme, width)
    assert driver.execute_script("return document.documentElement.scrollWidth") == width
    said = [one["message"] for one in driver.get_log("browser")]
    assert not [one for one in said if "document idle" not in one and "setting log level" not in one]


DIGIT = """
crystal_hz = 11_059_200
[parts.counter]
part = "seven_segment"
pins = { a = "P2.0", b = "P2.1", c = "P2.2", d = "P2.3", e = "P2.4", f = "P2.5", g = "P2.6", dp = "P2.7" }
"""
THREE = "MOV P2,#0CFh\nSJMP $"


def test_digits_of_seven_segments_are_drawn_as_they_are_lit(driver, mirotwin, tmp_path):
    lines = 'board = "lamp.board.toml"\nfirmware = "lamp.hex"\nduration_s = 0.2\n'
    scenario = board_folder(tmp_path, lines, DIGIT, THREE)
    mirotwin.succeeds("run", scenario, "--out", tmp_path / "run", "-q")
    mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "page.html", "-q")
    open_page(driver, tmp_path / "page.html")
    lit = "return [...document.querySelectorAll('.digits:not([data-end]) path')].map((one) => one.matches('.lit'))"
    driver.execute_script("run.show(run.last)")
    assert driver.execute_script(lit) == [True, True, True, True, False, False, True, True], "3."


def test_a_car_stands_where_it_was_and_all_its_way_is_in_sight(driver, mirotwin, tmp_path):
    mirotwin.succeeds("run", ROVER.parents[1] / "car/drives.scenario.toml", "--out", tmp_path / "run", "-q")
    mirotwin.succeeds("report", tmp_path / "run", "-o", tmp_path / "page.html", "-q")
    open_page(driver, tmp_path / "page.html")
    body = "return document.querySelector('.plane .car').getAttribute('transform')"
    assert driver.execute_script(body) == "translate(40 100) rotate(0)"
    assert (
        driver.execute_script("return document.querySelector('.plane').getAttribute('viewBox')")
        == "-2 -202 304 204"
    )
    driver.execute_script("run.show(run.last)")
    trail, ahead = (
        driver.execute_script(f"return document.querySelector('.{way}').getAttribute('points')")
        for way in ("trail", "ahead")
    )
    assert trail == ahead
    assert len(trail.split()) > 1000
