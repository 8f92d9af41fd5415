"""`mirotwin report` of runs and cases: what a page says, that it is the same each time, and what is refused."""

import base64
import hashlib
import json
import re
import shutil
import struct
from array import array
from html.parser import HTMLParser

import numpy as np
import pytest
from intelhex import IntelHex

from miro_robot.firmware import image_path
from mirotwin.report.foxglove.pitch import CIRCLE_M
from mirotwin.report.page import bokeh_page, document
from mirotwin.report.page.axes import at_least
from mirotwin.report.page.plots import LEAST_M_S, LEAST_RAD_S, figures_of
from mirotwin.report.page.tracks import PageTrack, PageTracks
from tests.mirotwin import program

ADDRESS = re.compile(r"(?:https?|wss?|ftp|file):", re.IGNORECASE)


class Markup(HTMLParser):
    """What a browser would fetch, and the text of each script."""

    def __init__(self, page):
        super().__init__()
        self.fetched, self.scripts, self.styles, self.words = [], [], [], []
        self._within = ""
        self.feed(page.read_text())

    def handle_starttag(self, tag, attrs):
        self._within = tag
        found = dict(attrs)
        self.fetched += [found[name] for name in ("src", "href", "srcset", "data", "action") if name in found]

    def handle_endtag(self, tag):
        self._within = ""

    def handle_data(self, data):
        {"script": self.scripts, "style": self.styles}.get(self._within, self.words).append(data)

    @property
    def data(self):
        """What the script of the page draws."""
        return json.loads(next(one for one in self.scripts if one.startswith('{"')))

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def markup(fig6_page):
    return Markup(fig6_page)


@pytest.mark.slow
def test_a_page_fetches_nothing(markup):
    assert [place for place in markup.fetched if not place.startswith(("#", "data:"))] == []
    assert not re.search(r"@import|url\((?!data:)", "".join(markup.styles))
    ours = [script for script in markup.scripts if "Bokeh.js" not in script[:2000] and len(script) < 500_000]
    assert len(ours) >= 5
    assert not [script[:80] for script in ours if ADDRESS.search(script)]


def test_a_page_forbids_the_browser_every_request(fig6_page):
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', fig6_page.read_text())[1]
    assert policy.startswith("default-src 'none';")
    assert "http" not in policy
    assert "unsafe-eval" not in policy


def test_the_pitch_has_the_circle_that_foxglove_has(fig6_page):
    assert (
        re.search(r'<circle cx="55.0" cy="35.0" r="([0-9.]+)"', fig6_page.read_text())[1]
        == f"{100 * CIRCLE_M:g}"
    )


def test_the_header_says_what_ran_and_its_verdict(markup, fig6):
    summary = json.loads((fig6 / "summary.json").read_text())
    for said in (
        *("fig6", "seed 3", "failed", summary["firmware"]["sha256"][:12], summary["digest"][:12]),
        f"1 of {len(summary['expectations'])} checks failed",
        f"{summary['tracking']['rms_position_cm']:.2f} cm",
    ):
        assert said in markup.text


def test_the_checks_are_those_of_the_run(markup, fig6):
    summary = json.loads((fig6 / "summary.json").read_text())
    for one in summary["expectations"]:
        assert one["name"] in markup.text
    first = next(one["first"] for one in summary["expectations"] if one["verdict"] == "failed")
    assert f"wanted {first['wanted']}, found {first['found']}" in markup.text


def test_the_run_of_the_page_equals_the_recording(markup):
    assert "This page's own run of it equals the recording" in markup.text


def test_the_profile_and_coverage_are_those_of_the_fw_commands(markup, fig6, mirotwin):
    profile = json.loads(mirotwin.succeeds("fw", "profile", fig6 / "run.mcap", "--json"))
    awake = profile["cycles"] - profile["asleep_cycles"]
    assert f"{profile['cycles']:,} machine cycles" in markup.text
    for function in profile["functions"]:
        assert f"{function['name']} {100 * function['cycles'] / awake:.1f} %" in markup.text
    coverage = mirotwin.succeeds("fw", "coverage", fig6 / "run.mcap")
    instructions = re.search(r"instructions of this run: (.*)", coverage)[1]
    assert f"instructions {instructions}" in markup.text


def test_a_page_names_no_folder_of_the_machine(fig6_page, fig6):
    text = fig6_page.read_text()
    assert str(fig6.parent) not in text
    assert str(document.ASSETS) not in text


@pytest.mark.slow
def test_another_process_makes_the_same_bytes_and_a_second_page_of_one_process_too(
    mirotwin, fig6, fig6_page, tmp_path
):
    program.run("report", fig6, "-o", tmp_path / "a.html", "-q", check=True)
    mirotwin.succeeds("report", fig6, "-o", tmp_path / "b.html", "-q")
    pages = [(tmp_path / name).read_bytes() for name in ("a.html", "b.html")]
    assert pages == [fig6_page.read_bytes()] * 2


def test_a_part_of_a_recording_has_a_page_that_says_so(fig6, tmp_path, mirotwin):
    whole = (fig6 / "run.mcap").read_bytes()
    part = tmp_path / "run.part.mcap"
    part.write_bytes(whole[: len(whole) * 2 // 3])
    page = tmp_path / "part.html"
    mirotwin.ends(0, "report", tmp_path, "-o", page, "-q")
    assert "broken off" in Markup(page).text


def test_a_window_leaves_out_the_rest(fig6, tmp_path, mirotwin):
    page = tmp_path / "window.html"
    mirotwin.succeeds("report", fig6, "-o", page, "--from", "0.5s", "--to", "1s", "-q")
    data = Markup(page).data
    ticks = data["ticks"]
    assert (data["first"], ticks[0], len(ticks)) == (14, 14 * 800800, 16)
    assert all(ticks[0] <= mark[0] < ticks[-1] + 800800 for mark in data["marks"])


@pytest.fixture(scope="module")
def other(folder):
    """An image whose robot does nothing."""
    image = IntelHex(str(image_path()))
    image[0], image[1] = 0x80, 0xFE  # SJMP to itself
    image.write_hex_file(str(folder / "other.ihx"))
    return folder / "other.ihx"


@pytest.fixture(scope="module")
def other_page(folder, fig6, other, mirotwin):
    page = folder / "other.html"
    assert mirotwin("report", fig6, "-o", page, "--firmware", other, "-q")[0] == 0
    return page


@pytest.mark.slow
def test_another_firmware_shows_where_it_goes_apart(other_page):
    said = Markup(other_page).text
    assert "Another firmware (other.ihx) differs in control period" in said
    assert "Coverage of the listing" in said


def test_a_page_says_at_its_head_that_another_firmware_played(other_page, fig6, other, fig6_page):
    recorded = json.loads((fig6 / "summary.json").read_text())["firmware"]["sha256"]
    played = hashlib.sha256(other.read_bytes()).hexdigest()
    head = Markup(other_page).text.partition("Errors Truth against reference")[0]
    assert f"Played with another firmware, other.ihx ({played[:12]}), than the recording's" in head
    assert f"({recorded[:12]})" in head
    assert "another firmware" not in Markup(fig6_page).text


def test_the_path_and_the_digest_are_those_of_the_firmware_that_played(other_page, fig6):
    found = Markup(other_page)
    data = found.data
    xs = struct.unpack(f"<{len(data['ticks'])}d", base64.b64decode(data["robots"][0]["truth"][0]))
    assert set(xs) == {xs[0]}, "a robot that does nothing stands still"
    recorded = json.loads((fig6 / "summary.json").read_text())["digest"][:12]
    assert recorded not in found.text


@pytest.mark.slow
def test_a_case_of_another_firmware_says_so(fig6, other, tmp_path, mirotwin):
    case, page = tmp_path / "mine.stream", tmp_path / "case.html"
    own = json.loads((fig6 / "summary.json").read_text())["firmware"]["sha256"]
    case.write_text(f'# mirotwin stream 2\n#: firmware_sha256 = "{own}"\n1000 > 55\n')
    assert mirotwin("report", case, "-o", page, "--firmware", other, "-q")[0] == 0
    assert "Played with another firmware, other.ihx" in Markup(page).text
    assert mirotwin("report", case, "-o", page, "-q", "--force")[0] == 0
    assert "another firmware" not in Markup(page).text


def test_an_axis_never_shows_rounding_noise():
    noise = array("d", [0.2, 0.2 + 3e-17, 0.2 - 3e-17])
    ticks = [number * 800800 for number in range(3)]
    robot = PageTrack((0, 0), False, 0)
    nothing = array("d", [float("nan")] * 3)
    robot.v_m_s = robot.w_rad_s = noise
    robot.told_v_m_s = robot.told_w_rad_s = nothing
    for wheel in robot.wheels.values():
        wheel.commanded, wheel.profile, wheel.actual = nothing, noise, noise
    made = figures_of(PageTracks(0, ticks, [robot]), [], [])
    for name, least in (("v", LEAST_M_S), ("w", LEAST_RAD_S), ("left", LEAST_M_S), ("right", LEAST_M_S)):
        columns = [(one.glyph.y, one.data_source.data) for one in made[f"plot-{name}"].renderers]
        everything = np.concatenate([np.asarray(data[y]) for y, data in columns if y in data])
        assert np.nanmax(everything) - np.nanmin(everything) == pytest.approx(least)


def test_an_axis_of_what_varies_is_left_alone():
    assert at_least(0.01, [0.0, 0.02, float("nan")]) is None
    assert at_least(0.01, [float("nan")], []) is None
    assert at_least(0.01, [1.0], [1.002]) == pytest.approx((0.996, 1.006))


def test_texts_of_others_are_text(tmp_path, mirotwin):
    scenario = tmp_path / "evil.toml"
    scenario.write_text(
        'name = "evil"\ntitle = "<script>alert(1)</script>"\nduration_s = 0.1\n'
        '[[network]]\n[[network.robot]]\nslot = 0\nreference.kind = "line"\n'
    )
    assert mirotwin("run", scenario, "--out", tmp_path / "run", "--no-figure", "-q")[0] == 0
    page = tmp_path / "evil.html"
    assert mirotwin("report", tmp_path / "run", "-o", page, "-q")[0] == 0
    assert "<script>alert" not in page.read_text()
    assert "<script>alert(1)</script>" in Markup(page).text


@pytest.mark.slow
def test_a_page_in_the_default_place_is_replaced_and_anything_else_there_is_not(
    fig6, tmp_path, mirotwin, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    mirotwin.succeeds("report", fig6, "-q")
    mirotwin.succeeds("report", fig6, "-q")
    (tmp_path / "report.html").write_text("mine")
    said = mirotwin.refuses("report", fig6, "-q")
    assert "report.html: is there already" in said


@pytest.mark.slow
def test_a_page_that_is_too_large_is_refused_and_the_remedy_works(two, tmp_path, mirotwin, monkeypatch):
    page = tmp_path / "large.html"
    mirotwin.succeeds("report", two, "-o", page, "--no-frames", "-q")
    monkeypatch.setattr(document, "MOST_BYTES", page.stat().st_size + 1000)
    again = tmp_path / "again.html"
    said = mirotwin.refuses("report", two, "-o", again, "-q")
    assert "leave the camera's frames out with --no-frames, or look at a part with --from and --to" in said
    assert not again.exists()
    mirotwin.succeeds("report", two, "-o", again, "--no-frames", "-q")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nothing"], "nothing: No such file or directory"),
        (["empty"], "empty: holds neither run.mcap nor case.stream; give a run's folder"),
        (["text.txt"], "text.txt: is text in no form that is known"),
        (["a.board.toml"], "a.board.toml: is no run, but what one is made from; run it with `mirotwin run`"),
        (["gone.parquet"], "gone.parquet: No such file or directory"),
        (["fig6", "--from", "9s"], "--from 216000000t: the recording goes from tick 0 to"),
        (["fig6", "--from", "1s", "--to", "1s"], "the window is empty; --to must be later"),
        (["fig6", "--sources", "gone"], "there is no such folder"),
        (["fig6", "--firmware", "text.txt"], "text.txt"),
    ],
    ids=" ".join,
)
def test_bad_input_is_one_line_and_nothing_is_written(arguments, said, fig6, tmp_path, monkeypatch, mirotwin):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.txt").write_text("hello\n")
    (tmp_path / "a.board.toml").write_text("crystal_hz = 12_000_000\n")
    shutil.copytree(fig6, tmp_path / "fig6")
    assert said in mirotwin.refuses("report", *arguments, "-o", "page.html", "-q")
    assert not (tmp_path / "page.html").exists()


def test_without_bokeh_it_says_what_to_install(fig6, tmp_path, mirotwin, monkeypatch):
    monkeypatch.setattr(bokeh_page, "find_spec", lambda name: None)
    said = mirotwin.refuses("report", fig6, "-o", tmp_path / "page.html", "-q")
    assert said == "bokeh: is not installed; pip install 'mirotwin[report]'"


def test_a_case_of_a_bare_processor_has_no_page(tmp_path, mirotwin):
    case = tmp_path / "bare.stream"
    case.write_text("# mirotwin stream 2\n#: seed = 0\n#:\n#: [bare]\n#: crystal_hz = 11059200\n1000 > 55\n")
    mirotwin.refuses("report", case, "-o", tmp_path / "page.html", "-q")
