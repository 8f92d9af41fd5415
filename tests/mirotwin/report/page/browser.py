"""Chromium without a screen, for tests of pages, and the pictures that they are compared with.

python -m tests.mirotwin.report.page.browser          makes the pictures in `pictures/` again
"""

import shutil
import tempfile
from contextlib import contextmanager
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

from PIL import Image, ImageFilter

CHROMIUM, CHROMEDRIVER = shutil.which("chromium"), shutil.which("chromedriver")
MISSING = (
    "" if CHROMIUM and CHROMEDRIVER and find_spec("selenium") else "needs chromium, chromedriver and selenium"
)
PICTURES = Path(__file__).parent / "pictures"
SMALL = (96, 66)
OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"),
    *("--force-device-scale-factor=1", "--window-size=1400,900"),
)
PATIENCE_S = 60.0
SHOWN = 20
"""Control period of the pictures."""


@contextmanager
def chromium():
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM or ""
    for option in OPTIONS:
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(CHROMEDRIVER))
    try:
        yield driver
    finally:
        driver.quit()


def open_page(driver, page, theme="light", width=1400, height=900):
    """Opens a page as a reader has it whose system is light or dark, and waits until it is all there."""
    from selenium.webdriver.support.ui import WebDriverWait

    features = [{"name": "prefers-color-scheme", "value": theme}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    driver.get(page.as_uri())
    WebDriverWait(driver, PATIENCE_S, 0.05).until(
        lambda one: one.execute_script("return document.body.dataset.ready")
    )


FOCUSED = """
let one = document.activeElement;
while (one.shadowRoot?.activeElement) one = one.shadowRoot.activeElement;
if (one === document.body) return null;
one.scrollIntoView({ block: "center", behavior: "instant" });
const parts = (text) => text.match(/[\\d.]+/g).map(Number);
const shade = (text) => {
  const scale = text.startsWith("color(") ? 1 : 255;
  const [r, g, b] = parts(text.replace("color(srgb", "")).slice(0, 3).map((value) => value / scale)
    .map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const style = getComputedStyle(one), ring = one.getBoundingClientRect();
const grown = parseFloat(style.outlineWidth) + parseFloat(style.outlineOffset);
const up = (node) => node.parentElement ?? node.getRootNode().host;
let back = null, cut = false;
for (let node = parseFloat(style.outlineOffset) < 0 ? one : up(one); node; node = up(node)) {
  const its = getComputedStyle(node), box = node.getBoundingClientRect();
  const alpha = parts(its.backgroundColor)[3] ?? 1;
  if (back === null && alpha > 0.5) back = its.backgroundColor;
  if (node !== one && node !== document.body && node !== document.documentElement && its.overflowX !== "visible")
    cut ||= ring.left - grown < box.left - 0.5 || ring.top - grown < box.top - 0.5
      || ring.bottom + grown > box.bottom + 0.5;
}
const [high, low] = [shade(style.outlineColor), shade(back)].sort((a, b) => b - a);
return { name: one.outerHTML.slice(0, 90), at: [ring.left, ring.top + scrollY].map(Math.round),
         style: style.outlineStyle, width: parseFloat(style.outlineWidth),
         contrast: (high + 0.05) / (low + 0.05), cut };
"""
"""What the ring around the element with the focus looks like."""


def rings(driver):
    """The ring of each element that the tabulator key reaches, from the top of the page to its end."""
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    driver.execute_script(
        "document.activeElement.blur(); scrollTo(0, 0); getSelection().collapse(document.body, 0)"
    )
    found = []
    for _ in range(200):
        ActionChains(driver).send_keys(Keys.TAB).perform()
        ring = driver.execute_script(FOCUSED)
        if ring is None or ring in found:
            break
        found.append(ring)
    return found


def picture(driver, selector):
    """What an element looks like."""
    element = driver.find_element("css selector", selector)
    return Image.open(BytesIO(element.screenshot_as_png)).convert("RGB")


def small(of):
    """So small that hinting and smoothing do not count."""
    return of.filter(ImageFilter.GaussianBlur(2)).resize(SMALL, Image.Resampling.BOX)


def apart(one, other):
    """The mean difference of two pictures of one size, of 255."""
    pairs = list(zip(one.tobytes(), other.tobytes(), strict=True))
    return sum(abs(here - there) for here, there in pairs) / len(pairs)


def _renew():
    from tests.mirotwin.program import mirotwin
    from tests.mirotwin.report.page.conftest import FIG6

    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name, chromium() as driver:
        folder = Path(name)
        mirotwin("run", *FIG6, "--out", folder / "fig6", "--no-figure", "-q")
        mirotwin("report", folder / "fig6", "-o", folder / "fig6.html", "-q")
        for theme in ("light", "dark"):
            open_page(driver, folder / "fig6.html", theme)
            driver.execute_script("run.show(arguments[0])", SHOWN)
            small(picture(driver, "#field")).save(PICTURES / f"pitch-{theme}.png")


if __name__ == "__main__":
    _renew()
