"""Pages in a browser: the slider moves what it should, keys work, light and dark, nothing is fetched, no complaint."""

import json
import math
import re
import time

import pytest
from PIL import Image, ImageStat

from miro_exact.clock import TICKS_PER_SECOND
from mirotwin.recording.reader import read
from tests.mirotwin.report.page import browser
from tests.mirotwin.report.page.browser import (
    PICTURES,
    SHOWN,
    apart,
    chromium,
    open_page,
    picture,
    rings,
    small,
)

pytest.importorskip("selenium", reason=browser.MISSING)
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browser.MISSING), reason=browser.MISSING)]


@pytest.fixture(scope="module")
def driver():
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def opened(driver, fig6_page):
    """The page of fig6, opened once; what its console said and what was asked of the network."""
    open_page(driver, fig6_page)
    return driver, driver.get_log("browser"), driver.get_log("performance")


@pytest.fixture
def page(opened, fig6_page):
    """The same page at its first control period."""
    driver = opened[0]
    if driver.current_url != fig6_page.as_uri():
        open_page(driver, fig6_page)
    driver.execute_script("run.show(0); document.activeElement.blur()")
    return driver


@pytest.fixture(scope="module")
def periods(fig6):
    return read(fig6 / "run.mcap").periods


def drawn(page, name):
    """x and y in cm and the heading in degrees, where an element of the picture is; None for one that is hidden."""
    element = page.find_element(By.ID, name)
    if page.execute_script("return arguments[0].style.display", element) == "none":
        return None
    numbers = re.fullmatch(r"translate\((\S+) (\S+)\) rotate\((\S+)\)", element.get_attribute("transform"))
    return tuple(float(number) for number in numbers.groups())


def of(posture):
    return 100 * posture.x_m, 100 * posture.y_m, posture.theta_rad * (180 / math.pi)


def index(page):
    return page.execute_script("return run.index")


def slide(page, to):
    page.execute_script(
        "const time = document.getElementById('time'); time.value = arguments[0];"
        "time.dispatchEvent(new Event('input', {bubbles: true}))",
        to,
    )


# The slider


def test_the_slider_moves_the_robots_to_the_recorded_postures(page, periods):
    for at in (0, 1, 17, len(periods) - 1):
        slide(page, at)
        robot = periods[at].robots[0]
        assert drawn(page, "truth-0") == of(robot.truth)
        assert drawn(page, "reference-0") == of(robot.reference)
        assert drawn(page, "measured-0") == (of(robot.measurement) if robot.measurement else None)


def test_the_slider_moves_the_line_of_time_in_every_figure(page, periods):
    slide(page, 30)
    found = page.execute_script("return plots.cursors.map((one) => one.location)")
    assert found == [periods[30].tick / TICKS_PER_SECOND] * 7
    assert page.find_element(By.ID, "clock").text.startswith(f"{periods[30].tick / TICKS_PER_SECOND:.3f} s")


def test_the_slider_says_what_it_shows(page, periods):
    slide(page, 12)
    slider = page.find_element(By.ID, "time")
    assert slider.get_attribute("aria-label") == "Time"
    said = f"{periods[12].tick / TICKS_PER_SECOND:.3f} s, control period 12"
    assert slider.get_attribute("aria-valuetext") == said
    error = [cell.text for cell in page.find_elements(By.CSS_SELECTOR, "#now-error td")]
    robot = periods[12].robots[0]
    assert error[0] == f"{100 * (robot.truth.x_m - robot.reference.x_m):.2f}"


def test_the_frames_of_the_control_period_are_listed(page):
    slide(page, 12)
    said = page.find_element(By.ID, "link-now").text
    assert "net0 PC sends: team" in said
    assert "net0/robot0 hears: team" in said


# Keys and buttons


def test_arrows_move_by_a_frame_and_home_and_end_to_the_ends(page, periods):
    seen = []
    for key in (
        *[Keys.ARROW_RIGHT] * 3,
        Keys.ARROW_LEFT,
        Keys.END,
        Keys.ARROW_RIGHT,
        Keys.HOME,
        Keys.ARROW_LEFT,
    ):
        page.find_element(By.TAG_NAME, "body").send_keys(key)
        seen.append(index(page))
    last = len(periods) - 1
    assert seen == [1, 2, 3, 2, last, last, 0, 0]


def test_the_same_keys_move_it_once_while_the_slider_has_the_focus(page):
    slider = page.find_element(By.ID, "time")
    slider.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP, Keys.ARROW_RIGHT, Keys.ARROW_DOWN)
    assert index(page) == 2


def test_space_plays_and_stops(page):
    page.execute_script("document.getElementById('speed').value = '0.1'")  # 15 s for the whole run
    page.find_element(By.TAG_NAME, "body").send_keys(Keys.SPACE)
    button = page.find_element(By.ID, "play")
    assert (button.get_attribute("aria-pressed"), button.get_attribute("aria-label")) == ("true", "Pause")
    until = time.monotonic() + 30
    while index(page) < 3:
        assert time.monotonic() < until
        time.sleep(0.05)
    page.find_element(By.TAG_NAME, "body").send_keys(Keys.SPACE)
    assert button.get_attribute("aria-pressed") == "false"
    stopped = index(page)
    time.sleep(0.2)
    assert index(page) == stopped


@pytest.fixture(scope="module")
def failure(fig6):
    """The control period of the failed check."""
    summary = json.loads((fig6 / "summary.json").read_text())
    failed = [one["first"]["tick"] for one in summary["expectations"] if one["verdict"] == "failed"]
    return failed[0] // 800800


def test_a_click_on_a_failure_goes_to_its_place_in_time(page, failure):
    page.find_element(By.CSS_SELECTOR, ".failures .jump").click()
    assert index(page) == failure


def test_a_page_of_a_failed_run_opens_at_the_failure(driver, fig6_page, failure):
    open_page(driver, fig6_page)
    assert index(driver) == failure


def test_a_click_in_a_figure_goes_to_its_time(page, periods):
    place = page.find_element(By.ID, "plot-v")
    page.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", place)
    ActionChains(page).move_to_element(place).click().perform()
    assert 0.4 * len(periods) < index(page) < 0.65 * len(periods)


def test_everything_that_can_be_operated_has_a_name(page):
    nameless = page.execute_script(
        "return [...document.querySelectorAll('main button, main a, .transport button, .transport input, .transport"
        " select, .index button, .index a')].filter((one) => !one.computedName && !(one.getAttribute('aria-label') ||"
        " one.textContent.trim() || one.labels?.[0]?.textContent.trim())).map((one) => one.outerHTML)"
    )
    assert nameless == []


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1400])
def test_the_keyboards_focus_is_seen_on_every_control(driver, fig6_page, theme, width):
    open_page(driver, fig6_page, theme, width)
    found = rings(driver)
    names = " ".join(ring["name"] for ring in found)
    for control in ('href="#checks"', 'id="theme"', 'class="jump"', "<summary>", 'id="play"', 'id="time"'):
        assert control in names
    assert "bk-" not in names, "a figure has nothing to do for the keyboard"
    hardly = [ring for ring in found if ring["contrast"] < 3 or ring["width"] < 2 or ring["style"] != "solid"]
    assert hardly == []
    assert [ring["name"] for ring in found if ring["cut"]] == []


def test_without_javascript_the_numbers_are_there_and_what_needs_it_is_not(driver, fig6_page):
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        driver.get(fig6_page.as_uri())
        said = driver.find_element(By.TAG_NAME, "body").text
        shown = [driver.find_element(By.CSS_SELECTOR, one).is_displayed() for one in (".transport", "#theme")]
    finally:
        driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert "need JavaScript, which is switched off" in " ".join(said.split())
    assert "settles_within_s" in said
    assert shown == [False, False]


# Colours


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_page_is_light_or_dark_as_the_system_is_and_looks_as_it_did(driver, fig6_page, theme):
    open_page(driver, fig6_page, theme)
    driver.execute_script("run.show(arguments[0])", SHOWN)
    for selector in ("header", "#field", "#plot-position"):
        shades = ImageStat.Stat(picture(driver, selector).convert("L"))
        assert shades.mean[0] > 180 if theme == "light" else shades.mean[0] < 90
        assert shades.stddev[0] > 4, f"{selector} is blank"
    axis, muted = driver.execute_script(
        "const found = plots.figures['plot-v'].below[0].major_label_text_color;"
        "return [found.value ?? found, getComputedStyle(document.documentElement).getPropertyValue('--muted').trim()]"
    )
    assert axis == muted
    now, then = small(picture(driver, "#field")), Image.open(PICTURES / f"pitch-{theme}.png").convert("RGB")
    assert apart(now, then) < 1.5
    driver.execute_script("run.show(0)")
    assert apart(small(picture(driver, "#field")), then) > 2 * apart(now, then)


def test_the_button_switches_the_theme_and_it_is_remembered(driver, fig6_page):
    open_page(driver, fig6_page, "light")

    def theme():
        return driver.execute_script("return document.documentElement.dataset.theme")

    driver.find_element(By.ID, "theme").click()
    assert theme() == "dark"
    open_page(driver, fig6_page, "light")
    assert theme() == "dark"
    driver.find_element(By.ID, "theme").click()
    driver.execute_script("localStorage.clear()")
    assert theme() == "light"


# Nothing is fetched, nothing complains, and it fits


def test_the_console_has_no_warning_and_no_error(opened):
    assert [one for one in opened[1] if one["level"] not in ("INFO", "DEBUG")] == []


def test_nothing_is_asked_of_the_network(opened, fig6_page):
    asked = []
    for entry in opened[2]:
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            asked.append(message["params"]["request"]["url"])
    assert fig6_page.as_uri() in asked
    assert [url for url in asked if not url.startswith(("data:", fig6_page.as_uri()))] == []


@pytest.mark.parametrize("width", [360, 600, 1400])
def test_the_page_is_no_wider_than_its_window(driver, fig6_page, width):
    open_page(driver, fig6_page, width=width)
    assert driver.execute_script("return document.documentElement.scrollWidth") == width
    place = driver.find_element(By.ID, "plot-position")
    assert 0.4 * width < place.size["width"] <= width


# Several robots, and the camera


def test_the_figures_are_those_of_the_robot_that_is_chosen_and_the_camera_follows_time(
    driver, two, folder, mirotwin
):
    path = folder / "two.html"
    mirotwin.succeeds("report", two, "-o", path, "-q")
    open_page(driver, path)
    Select(driver.find_element(By.ID, "robot")).select_by_visible_text("net0/robot2")
    visible = driver.execute_script(
        "return plots.models.filter((one) => one.tags.some((tag) => `${tag}`.startsWith('robot:')))"
        ".map((one) => [one.tags.find((tag) => `${tag}`.startsWith('robot:')), one.visible])"
    )
    assert visible
    assert all(shown == (tag == "robot:1") for tag, shown in visible)
    recorded = read(two / "run.mcap").periods
    driver.execute_script("run.show(9)")
    assert drawn(driver, "truth-1") == of(recorded[9].robots[1].truth)
    assert driver.find_element(By.ID, "now-name").text == "net0/robot2"
    sources = []
    for at in (1, 9):
        driver.execute_script("run.show(arguments[0])", at)
        sources.append(driver.find_element(By.ID, "camera").get_attribute("src"))
        assert "exposed at" in driver.find_element(By.ID, "camera-time").text
    assert sources[0] != sources[1]
    assert [one for one in driver.get_log("browser") if one["level"] not in ("INFO", "DEBUG")] == []
