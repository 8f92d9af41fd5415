"""The page of a campaign: its numbers are those of `campaign show`, and each row can be made again."""

import json
import shlex

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mirotwin import campaign
from mirotwin.campaign.plots import LEAST, spread, wrapped
from mirotwin.campaign.statistics import figures
from tests.mirotwin.campaign.conftest import InThisProcess, plan_of
from tests.mirotwin.program import mirotwin
from tests.mirotwin.report.page import browser
from tests.mirotwin.report.page.test_run_page import Markup

TEXT = """
scenario = "fig6"
seeds = "2-11"
set = { duration_s = 0.1, "expect.tracks_within_cm" = 20.0 }
[grid]
network.radio.bit_error_rate = [0.0, 1e-3]
[factor.start]
near = []
"far <away>" = ["network.robot.start_error_x_cm=40.0"]
[random]
count = 2
seed = 4
[random.range]
host.compute_s = { from = 0.001, to = 0.02 }
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    path = tmp_path_factory.mktemp("campaign") / "mine.parquet"
    campaign.run(plan_of(TEXT), path, InThisProcess())
    return path


@pytest.fixture(scope="module")
def page(results):
    path = results.with_name("mine.html")
    mirotwin.succeeds("campaign", "page", results, "-o", path, "-q")
    return path


@pytest.fixture(scope="module")
def markup(page):
    return Markup(page)


def shown(results, *options):
    return json.loads(mirotwin("campaign", "show", results, "--json", *options)[1])


@pytest.mark.slow
def test_medians_and_their_intervals_are_those_of_campaign_show(results, markup):
    groups = shown(results)["groups"]
    assert len(groups) == 4
    for group in groups:
        for name, found in group["metrics"].items():
            if found is None:
                continue
            low, high = found["median_interval"]["low"], found["median_interval"]["high"]
            assert f"{name} {found['median']:.4g} {low:.4g} to {high:.4g}" in markup.text


def test_paired_differences_are_those_of_campaign_show(results, markup):
    compared = shown(results, "--between", "start")
    assert f"start: {compared['second']} against {compared['first']}, 40 pairs" in markup.text
    for one in compared["differences"]:
        low, high = one["interval"]["low"], one["interval"]["high"]
        assert f"{one['difference']:+.4g} {low:.4g} to {high:.4g} {one['median']:+.4g}" in markup.text


def test_the_page_names_the_command_that_made_it(markup):
    assert "Made of mine.parquet by mirotwin campaign page" in markup.text


def test_what_failed_is_listed(results, markup):
    table, _ = campaign.read(results)
    failed = [row for row in table.to_pylist() if row["verdict"] == "failed"]
    assert 0 < len(failed) < table.num_rows
    assert f"{len(failed)} failed" in markup.text
    for row in failed[:5]:
        assert row["failure"] in markup.text


def test_the_command_of_a_row_gives_its_digest_again(results, markup, tmp_path):
    data = markup.data
    table, _ = campaign.read(results)
    for number in (3, 77):
        row = table.to_pylist()[number]
        arm, seed, drawn = data["rows"][data["runs"].index(number)]
        words = shlex.split(f"{data['arms'][arm]} {drawn} --seed {seed}")
        assert words[:2] == ["mirotwin", "run"]
        out = tmp_path / f"run{number}"
        mirotwin(*words[1:], "--out", out, "--no-figure", "-q")
        assert json.loads((out / "summary.json").read_text())["digest"] == row["digest"]


def test_the_same_results_give_the_same_bytes(results, page, tmp_path):
    again = tmp_path / "again.html"
    mirotwin.succeeds("campaign", "page", results, "-o", again, "-q")
    assert again.read_bytes() == page.read_bytes()


def test_what_is_no_campaign_is_refused(tmp_path):
    path = tmp_path / "other.parquet"
    pq.write_table(pa.table({"x": [1]}), path)
    said = mirotwin.refuses("campaign", "page", path, "-o", tmp_path / "page.html", "-q")
    assert "is no campaign's results" in said
    path.write_bytes(b"PAR1 and no more")
    mirotwin.refuses("campaign", "page", path, "-o", tmp_path / "page.html", "-q")
    assert not (tmp_path / "page.html").exists()


@pytest.mark.slow
@pytest.mark.skipif(bool(browser.MISSING), reason=browser.MISSING)
def test_in_a_browser_a_click_on_a_failed_run_shows_its_command_without_complaint(page):
    with browser.chromium() as driver:
        browser.open_page(driver, page)
        before = driver.find_element("id", "line").text
        assert before.startswith("mirotwin run fig6 ")
        button = driver.find_element("css selector", "#failed [data-run]")
        driver.execute_script("arguments[0].click()", button)
        after = driver.find_element("id", "line").text
        assert driver.find_element("id", "run").get_property("value") == button.text
        assert after != before or button.text == "0"
        assert "--set network.robot.start_error_x_cm=40.0" in after
        assert [one for one in driver.get_log("browser") if one["level"] not in ("INFO", "DEBUG")] == []
        for width in (360, 600, 1400):
            browser.open_page(driver, page, width=width)
            assert driver.execute_script("return document.documentElement.scrollWidth") == width
            wide = driver.execute_script(
                "return [...document.querySelectorAll('table')].filter((one) => !one.closest('.scroll')).length"
            )
            assert wide == 0
            frames = driver.execute_script(
                "return Object.values(plots.figures).map((one) =>"
                " [...Bokeh.index].find((view) => view.model === one).frame.bbox.width)"
            )
            assert min(frames) > 100, "names of arms leave no room for what is drawn"


@pytest.mark.slow
@pytest.mark.skipif(bool(browser.MISSING), reason=browser.MISSING)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_keyboards_focus_is_seen_on_every_control(page, theme):
    with browser.chromium() as driver:
        browser.open_page(driver, page, theme, width=360)
        found = browser.rings(driver)
    assert 'id="run"' in " ".join(ring["name"] for ring in found)
    assert [one for one in found if one["contrast"] < 3 or one["width"] < 2 or one["style"] != "solid"] == []
    assert [one["name"] for one in found if one["cut"]] == []


def test_a_campaign_says_what_is_missing_without_javascript(page):
    assert "need\nJavaScript, which is switched off" in page.read_text()


def test_axes_do_not_show_rounding_noise():
    from mirotwin.campaign.rows import Arm

    numbers = np.array([1.0, 1.0 + 2e-16, 1.0 - 1e-16, 1.0])
    for metric, least in LEAST.items():
        ends = spread(
            metric, [(Arm({}, 4, {}, 0, {metric: figures(numbers, np.arange(4))}), numbers)]
        ).x_range
        assert ends.end - ends.start == pytest.approx(least)
        assert ends.start < 1.0 < ends.end


def test_long_names_of_arms_are_wrapped():
    lines = wrapped("bit_error_rate 0.001, far away, and turned a quarter to the left").split("\n")
    assert lines == ["bit_error_rate 0.001,", "far away, and turned a", "quarter to the left"]
    assert wrapped("near") == "near"
