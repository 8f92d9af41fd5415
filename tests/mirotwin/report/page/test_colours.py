"""The colours of the pages can be read, in both themes."""

import re

import pytest

from mirotwin.report.page.axes import ROBOT_COLOURS
from mirotwin.report.page.document import ASSETS
from mirotwin.report.page.plots import KIND_COLOURS

CSS = (ASSETS / "page.css").read_text()
THEMES = {
    "light": re.search(r":root \{(.*?)\}", CSS, re.DOTALL)[1],
    "dark": re.search(r':root\[data-theme="dark"\] \{(.*?)\}', CSS, re.DOTALL)[1],
}
COLOURS = {theme: dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", text)) for theme, text in THEMES.items()}


def luminance(colour):
    """Relative luminance, WCAG 2.1."""
    channels = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    lighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def test_contrast_is_as_the_standard_has_it():
    assert contrast("#ffffff", "#000000") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


def test_both_themes_have_the_same_colours():
    assert set(COLOURS["light"]) == set(COLOURS["dark"])
    assert len(COLOURS["light"]) > 30


GROUNDS = {
    "page": ("ink", "muted", "link"),
    "card": ("ink", "muted", "link", "good", "bad"),
    "good-soft": ("good",),
    "bad-soft": ("bad", "ink", "link"),
    "warn-soft": ("warn",),
    "ran": ("ink", "muted"),
    "missed": ("ink", "muted"),
}
"""What is written on each."""


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize(
    ("text", "ground"), [(text, ground) for ground in GROUNDS for text in GROUNDS[ground]]
)
def test_text_has_a_contrast_of_4_5(theme, text, ground):
    assert contrast(COLOURS[theme][text], COLOURS[theme][ground]) >= 4.5


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize(
    "line", ["truth", "measured", "reference", "profile", "cursor", "lost", "bad", *ROBOT_COLOURS]
)
def test_lines_have_a_contrast_of_3_on_cards_and_on_the_pitch(theme, line):
    for ground in ("card", "grass", "band"):
        assert contrast(COLOURS[theme][line], COLOURS[theme][ground]) >= 3.0


def test_every_colour_that_a_figure_names_is_there():
    assert set(KIND_COLOURS.values()) <= set(COLOURS["light"])
    for name in ("rule", "muted", "grid", "band", "told", "cursor"):
        assert name in COLOURS["light"]
