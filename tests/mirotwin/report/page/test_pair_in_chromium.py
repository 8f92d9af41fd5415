"""The page of two runs in a browser: the slider moves both robots and every figure; it fits, and nothing complains."""

import pytest
from PIL import Image

from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.recording.reader import read
from tests.mirotwin.report.page import browser
from tests.mirotwin.report.page.browser import apart, chromium, open_page, rings, small

pytest.importorskip("selenium", reason=browser.MISSING)
from selenium.webdriver.common.by import By

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browser.MISSING), reason=browser.MISSING)]


@pytest.fixture(scope="module")
def driver():
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def runs(mirotwin, folder, fig6):
    """Two runs and their page."""
    line = ("run", "fig6", "--seed", 4, "--set", "duration_s=1", "--no-figure", "-q")
    mirotwin.succeeds(*line, "--out", folder / "other")
    mirotwin.succeeds("report", fig6, folder / "other", "-o", folder / "runs.html", "-q")
    return read(fig6 / "run.mcap").periods, read(folder / "other" / "run.mcap").periods, folder / "runs.html"


def place_of(driver, name):
    return driver.find_element(By.ID, name).get_attribute("transform").partition(" rotate")[0]


def test_the_slider_moves_both_robots_and_all_figures(driver, runs):
    first, other, page = runs
    open_page(driver, page)
    driver.execute_script("run.show(9)")
    for number, periods in enumerate((first, other)):
        truth = periods[9].robots[0].truth
        assert place_of(driver, f"truth-{number}") == f"translate({100 * truth.x_m} {100 * truth.y_m})"
    cells = [one.text for one in driver.find_elements(By.CSS_SELECTOR, "#now-apart td")]
    truths = [periods[9].robots[0].truth for periods in (first, other)]
    assert cells[0] == f"{100 * (truths[1].x_m - truths[0].x_m):.2f}"
    cursors = driver.execute_script("return plots.cursors.map((one) => one.location)")
    assert cursors == [first[9].tick / TICKS_PER_SECOND] * 9


def test_a_robot_whose_run_is_over_is_not_drawn(driver, runs):
    first, _, page = runs
    open_page(driver, page)
    driver.execute_script("run.show(arguments[0])", len(first) - 1)
    shown = [driver.find_element(By.ID, f"truth-{number}").is_displayed() for number in (0, 1)]
    assert shown == [True, False]
    cells = [one.text for one in driver.find_elements(By.CSS_SELECTOR, "#now-other td")]
    assert cells == ["\u2013"] * 3


def test_the_pictures_in_the_documents_are_those_of_the_present_pages(tmp_path):
    from docs.film.pages import DOCS, draw

    draw(tmp_path)
    for name in ("two-runs.png", "capture.png"):
        now, then = (small(Image.open(folder / name).convert("RGB")) for folder in (tmp_path, DOCS))
        assert apart(now, then) < 1.5, "python -m docs.film.pages makes them again"


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1400])
def test_it_fits_and_nothing_complains(driver, runs, theme, width):
    open_page(driver, runs[2], theme, width)
    assert driver.execute_script("return document.documentElement.scrollWidth") == width
    assert [one for one in driver.get_log("browser") if one["level"] not in ("INFO", "DEBUG")] == []
    found = rings(driver)
    assert [ring for ring in found if ring["contrast"] < 3 or ring["cut"]] == []
