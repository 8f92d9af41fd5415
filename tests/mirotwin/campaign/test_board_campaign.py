"""Campaigns of boards: a row is what its run is, whoever makes it; what cannot be varied is refused."""

import json
import re
import shlex
from pathlib import Path

import pytest

from miro_exact.bad_input import BadInput
from mirotwin import campaign
from mirotwin.campaign.workers import Processes
from tests.mirotwin.board_files import board_folder
from tests.mirotwin.campaign.conftest import SHORT, InThisProcess, plan_of, rows
from tests.mirotwin.report.page.test_run_page import Markup

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")

SCENARIO = """
board = "lamp.board.toml"
firmware = "lamp.hex"
duration_s = 0.3
[[step]]
wait_for = "text"
text = "R"
[[step]]
press = "key"
[[step]]
pause_ms = 1
[[step]]
wait_for = "value"
of = "lamp.on"
equals = true
within_ms = 20
"""
CAMPAIGN = """
scenario = "lamp.scenario.toml"
seeds = "0-2"
values = ["lamp.flashes", "key.closed"]
[grid]
board.parts.key.bounce_ms = [0.0, 8.0]
firmware = ["", "inverted.hex"]
[random]
count = 2
[random.range]
straps.mode = { choose = [0, 1] }
"""


def written(folder, text=CAMPAIGN):
    board_folder(folder, SCENARIO)
    (folder / "bounce.toml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    return written(tmp_path_factory.mktemp("board"))


@pytest.fixture(scope="module")
def results(here):
    path = here / "bounce.parquet"
    campaign.run(campaign.load(here / "bounce.toml"), path, InThisProcess())
    return path


@pytest.fixture(scope="module")
def page(mirotwin, results):
    mirotwin.succeeds("campaign", "page", results, "-o", results.with_suffix(".html"), "-q")
    return Markup(results.with_suffix(".html"))


def test_a_row_has_the_verdict_the_time_of_each_wait_and_the_values_that_are_named(results):
    row = rows(results)[12]

    assert (row["board.parts.key.bounce_ms"], row["firmware"], row["seed"]) == (8.0, "", 0)
    assert (row["verdict"], row["failure"], row["faults"], row["from_board"]) == ("passed", "", 0, 1)
    assert row["step_1_ms"] == pytest.approx(12.894, abs=0.001)
    assert "step_2_ms" not in row, "a press waits for nothing"
    assert 0.0 < row["step_4_ms"] <= 8.0
    assert row["lamp.flashes"] > 2.0
    assert row["key.closed"] is False
    assert "settled" not in row


def test_a_button_bounces_otherwise_with_each_seed(results):
    flashes = {}
    for row in rows(results):
        if row["firmware"] == "":
            flashes.setdefault(row["board.parts.key.bounce_ms"], set()).add(row["lamp.flashes"])

    assert flashes[0.0] == {1.0}
    assert len(flashes[8.0]) > 1


def test_a_run_that_fails_says_which_step(results):
    row = rows(results)[6]

    assert (row["firmware"], row["verdict"], row["step_4_ms"]) == ("inverted.hex", "failed", None)
    assert row["failure"].startswith("step: step 4: wait_for value: ")


@pytest.mark.parametrize("number", [2, 14, 23])
def test_the_line_of_a_row_repeats_its_run(mirotwin, here, results, page, number, tmp_path, monkeypatch):
    monkeypatch.chdir(here)
    row = rows(results)[number]
    arm, seed, drawn = page.data["rows"][page.data["runs"].index(number)]
    words = shlex.split(f"{page.data['arms'][arm]} {drawn} --seed {seed}")
    mirotwin(*words[1:], "--out", tmp_path / "out", "-q")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())

    assert words[:3] == ["mirotwin", "run", "lamp.scenario.toml"]
    assert summary["digest"] == row["digest"]
    assert summary["parts"]["lamp.flashes"] == row["lamp.flashes"]
    assert summary["firmware"]["instructions"] == row["instructions"]


def test_processes_write_the_same_bytes_and_so_does_a_campaign_that_goes_on(here, results, monkeypatch):
    plan = campaign.load(here / "bounce.toml")
    campaign.run(plan, here / "again.parquet", Processes(2))

    def interrupt(tally, outcome):
        if tally.new == 5:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        campaign.run(plan, here / "cut.parquet", InThisProcess(), on_outcome=interrupt)
    monkeypatch.chdir(here)  # where the file has another path
    tally = campaign.run(campaign.load("bounce.toml"), "cut.parquet", InThisProcess())

    assert tally.new == 19
    assert (here / "again.parquet").read_bytes() == results.read_bytes()
    assert (here / "cut.parquet").read_bytes() == results.read_bytes()


def test_show_has_the_waits_and_the_values_of_each_combination(mirotwin, results):
    out = mirotwin.succeeds("campaign", "show", results, "--by", "board.parts.key.bounce_ms")

    assert [line.split()[-8] for line in out.splitlines()[2:5]] == ["step_1_ms", "step_4_ms", "lamp.flashes"]
    assert "rms_position_cm" not in out


def test_two_levels_are_compared_by_waits_and_shares(mirotwin, results):
    out = json.loads(mirotwin.succeeds("campaign", "show", results, "--between", "firmware", "--json"))

    assert [one["metric"] for one in out["differences"]] == [
        "step_1_ms",
        "step_4_ms",
        "failed",
        "error",
        "fault",
    ]
    assert out["differences"][2]["difference"] > 0.0


def test_an_image_that_fails_is_worse_than_a_baseline(mirotwin, here, tmp_path):
    text = 'scenario = "lamp.scenario.toml"\nseeds = "0-19"\nset = { board.parts.key.bounce_ms = 0 }\n'
    for name, more in (("before", ""), ("now", 'firmware = "inverted.hex"\n')):
        (here / f"{name}.toml").write_text(more + text)
        campaign.run(campaign.load(here / f"{name}.toml"), tmp_path / f"{name}.parquet", InThisProcess())
    said = mirotwin.ends(
        1, "campaign", "show", tmp_path / "now.parquet", "--against", tmp_path / "before.parquet"
    )

    assert "worse than" in said
    assert "failed by +1 (95 % interval 1 to 1) in the mean of 20 pairs of 20 seeds" in said


def test_the_page_shows_the_spread_and_what_failed(page, results):
    assert "step_1_ms" in page.text
    assert "lamp.flashes" in page.text
    assert "firmware: inverted.hex against" in page.text
    assert f"{[row['verdict'] for row in rows(results)].count('failed')} failed" in page.text
    assert "step 4: wait_for value" in page.text


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            ("board.parts.key.bounce_ms = [0.0, 8.0]", "board = ['a', 'b']"),
            "grid.board: cannot be varied; name a key",
        ),
        (
            ("key.bounce_ms = [0.0", "key.bounce = [0.0"),
            r"grid.board.parts.key.bounce\[0\]: .*did you mean bounce_ms",
        ),
        (("8.0]", "800.0]"), r"grid.board.parts.key.bounce_ms\[1\]: .*must be <= 100"),
        (
            ("board.parts.key.bounce_ms", "put.key.pressd"),
            r"grid.put.key.pressd\[0\]: .*did you mean pressed",
        ),
        (("straps.mode", "straps.mod"), "random.range.straps.mod: .*has no such strap; did you mean mode"),
        (("lamp.flashes", "lamp.flash"), "values: lamp.flash: part 'lamp' .*did you mean flashes"),
        (("lamp.flashes", "lamp"), "values: 'lamp' is not PART.KEY; name a part and its value"),
        (
            ("[random]", "[factor.image]\na = ['firmware=x.hex']\n[random]"),
            "factor.image.a: .*; write firmware = .. at",
        ),
        (
            ('"lamp.scenario.toml"', '"lamp.board.toml"'),
            "scenario: .*is a board, .*; write a NAME.scenario.toml with",
        ),
        (
            ("firmware = [", "scenario = ['fig6']\nfirmware = ["),
            r"grid.scenario\[0\]: .*; make a campaign of each",
        ),
        (("inverted.hex", "lamp.board.toml"), r"grid.firmware\[1\]: .*lamp.board.toml:1: "),
        (
            ("firmware = [", "network.radio.bit_error_rate = [0.1]\nfirmware = ["),
            "grid.network.radio.bit_error_rate",
        ),
        (("[random]", "[factor.'lamp.flashes']\na = []\n[random]"), "lamp.flashes: is the name of a column"),
        (("[random]", "[factor.step_4_ms]\na = []\n[random]"), "step_4_ms: is the name of a column"),
    ],
    ids=lambda words: words[1] if isinstance(words, tuple) else "",
)
def test_what_cannot_be_varied_or_read_is_one_line(mirotwin, tmp_path, monkeypatch, change, line):
    monkeypatch.chdir(written(tmp_path, CAMPAIGN.replace(*change)))
    said = mirotwin.refuses("campaign", "bounce.toml")

    assert re.match(f"bounce.toml: {line}", said), said
    assert sorted(path.suffix for path in Path().iterdir()) == [".hex", ".hex", ".toml", ".toml", ".toml"]


@pytest.mark.parametrize("name", ["lamp.board.toml", "lamp.scenario.toml"])
def test_a_board_or_a_scenario_is_no_campaign(mirotwin, here, monkeypatch, name):
    monkeypatch.chdir(here)
    line = f'{name}: is no campaign, but a scenario or a board; write scenario = "'
    assert mirotwin.refuses("campaign", name).startswith(line)


def test_scenarios_with_other_steps_share_one_order_of_columns(here):
    more = SCENARIO.replace("[[step]]", "[[step]]\npause_ms = 1\n[[step]]", 1)
    (here / "more.scenario.toml").write_text(more)
    two = 'scenario = ["lamp.scenario.toml", "more.scenario.toml"]\nfirmware = ['
    (here / "two.toml").write_text(CAMPAIGN.replace("firmware = [", two))
    names = list(campaign.load(here / "two.toml").figures)

    assert names[-6:] == ["step_1_ms", "step_2_ms", "step_4_ms", "step_5_ms", "lamp.flashes", "key.closed"]


def test_robots_have_no_values_of_parts():
    with pytest.raises(
        BadInput, match=r"^short.toml: values: are of a board's parts, and fig7 is for robots; leave"
    ):
        plan_of('values = ["lamp.on"]\n' + SHORT)
