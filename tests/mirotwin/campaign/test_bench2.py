"""Mirotwin-Bench 2: how entries are compared, and that leaderboard and page agree with each other and with runs."""

import itertools
import random
from collections import Counter
from math import comb

import pytest

from benchmarks import bench2, bench2_page
from benchmarks.bench2_score import compared
from miro_exact.bad_input import BadInput
from mirotwin.campaign import worker
from mirotwin.campaign.single import run_single
from tests import children

PAGE = bench2.ROOT / "docs/benchmark.md"
ROWS = bench2.stored()


def row(settled, truth_cm=(), **keys):
    """A row in which an entry's camera error is its truth error."""
    errors = list(truth_cm) or [1.0] * len(settled)
    whole = {"campaign": "bench2", "case": "line, plain", "entry": "x", "first_seed": 0, "digests": []} | keys
    return bench2.Row(settled=settled, truth_cm=errors, camera_cm=errors, **whole)


def test_who_settles_more_often_is_better_whatever_the_errors_say():
    often, seldom = row("1" * 20, [2.0] * 20), row("1" * 8 + "0" * 12, [1.0] * 20)
    result = compared(seldom, often, 0.01)
    assert (result.gained, result.lost, result.both, result.settles) == (12, 0, 8, 1)
    assert result.truth.sign == 1  # that is, worse
    assert result.verdict("truth") == 1
    assert compared(often, seldom, 0.01).verdict("truth") == -1


def test_of_equal_shares_the_errors_of_pairs_that_both_settle_decide():
    first = row("1" * 20 + "00", [1.0] * 20 + [0.0, 900.0])
    second = row("1" * 20 + "01", [1.5 + 0.01 * number for number in range(20)] + [900.0, 0.0])
    result = compared(first, second, 0.01)
    assert (result.settles, result.both) == (0, 20)
    assert result.truth.median == pytest.approx(0.595)
    assert result.verdict("truth") == result.verdict("camera") == -1
    assert compared(second, first, 0.01).verdict("truth") == 1


def test_chance_calls_hardly_anything_better():
    draws = random.Random(7)
    noise = [row("1" * 25, [draws.gauss(1.0, 0.2) for _ in range(25)]) for _ in range(60)]
    verdicts = Counter(compared(a, b, 0.05).verdict("truth") for a, b in itertools.combinations(noise, 2))
    assert verdicts[0] > 0.9 * comb(60, 2)
    corrected = [
        compared(a, b, 0.05 / comb(60, 2)).verdict("truth") for a, b in itertools.combinations(noise, 2)
    ]
    assert not any(corrected)


def test_the_leaderboard_has_each_run_of_each_entry():
    entries = {(campaign, name): entry for campaign, name, entry in bench2.everything()}
    counts = Counter((one.campaign, one.entry) for one in ROWS)
    assert counts.keys() == entries.keys()
    for campaign in {campaign for campaign, _ in entries}:
        of_campaign = [one for one in ROWS if one.campaign == campaign]
        first = of_campaign[0].entry
        design = bench2.plan_of(campaign, entries[campaign, first]).design
        cases = [one.case for one in of_campaign if one.entry == first]
        assert len(set(cases)) * design.seed_count == design.runs
        for name in {one.entry for one in of_campaign}:
            assert [one.case for one in of_campaign if one.entry == name] == cases
        for one in of_campaign:
            assert (one.first_seed, len(one.settled)) == (design.first_seed, design.seed_count)
            assert len(one.truth_cm) == len(one.camera_cm) == len(one.digests) == design.seed_count
            assert all(len(digest) == bench2.DIGITS for digest in one.digests)


def test_page_picture_and_standings_are_what_the_leaderboard_says(tmp_path):
    copy, tables = tmp_path / "benchmark.md", tmp_path / "standings.json"
    copy.write_text(PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    bench2_page.write(copy, ROWS, tables)
    assert copy.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8")
    assert (tmp_path / bench2_page.PICTURE).read_bytes() == (PAGE.parent / bench2_page.PICTURE).read_bytes()
    assert tables.read_bytes() == bench2_page.STANDINGS.read_bytes()


def test_what_the_page_says_of_bench_1_are_counts_of_the_leaderboard():
    settled = {row[0]: row[1] for row in bench2_page.tables_of(ROWS).rows("bench 1")}
    text = " ".join(PAGE.read_text(encoding="utf-8").split())
    assert f"the arc: {settled['paper']} runs settle" in text
    alone = [settled[f"Fig. {figure} alone"].partition(" ")[0] for figure in (6, 8)]
    assert f"{' or '.join(alone)} settle" in text


@pytest.mark.parametrize("entry", ["body_frame, none", "samson, ekf"])
def test_a_short_run_is_again_what_the_leaderboard_says(entry):
    rows = [one for one in ROWS if one.entry == entry and one.campaign == bench2.BENCH]
    (of_row, number, work), *_ = bench2.drawn(rows, "quick")
    assert of_row.case == "line, plain"
    shown = bench2.shown(run_single(work))
    assert shown == (
        of_row.settled[number],
        of_row.truth_cm[number],
        of_row.camera_cm[number],
        of_row.digests[number],
    )


def test_laws_of_two_files_take_turns_in_one_worker():
    rows = [
        one
        for one in ROWS
        if one.entry in ("samson, none", "pure_pursuit, none") and one.case == "line, plain"
    ]
    for row_of, number, job in [
        *bench2.drawn(rows, "a"),
        *bench2.drawn(rows, "b"),
    ]:  # other seeds: nothing is cached
        assert bench2.shown(worker.work(job))[-1] == row_of.digests[number]


@pytest.mark.slow
def test_a_run_of_each_entry_that_the_commit_draws_is_again_what_the_leaderboard_says():
    head = children.run(
        ["git", "rev-parse", "HEAD"], cwd=bench2.ROOT, capture_output=True, text=True, check=False
    )
    word = head.stdout.strip()
    assert list(bench2.differences(bench2.sample(ROWS, word), word)) == []


def test_a_run_that_differs_is_named_with_both_figures(monkeypatch):
    (good,) = (one for one in ROWS if one.case == "line, plain" and one.entry == "kanayama, none")
    monkeypatch.setattr(bench2, "outcomes_of", lambda works, _: [run_single(work) for work in works])
    assert list(bench2.differences([good], "a")) == []
    changed = bench2.Row(
        **{name: getattr(good, name) for name in good.__struct_fields__} | {"digests": ["0" * 8] * 20}
    )
    (line,) = bench2.differences([changed], "a")
    assert line.startswith("bench2, kanayama, none, line, plain, seed 50")
    assert "instead of" in line


def test_an_entry_is_compared_with_one_of_the_file_and_another_campaign_is_refused():
    ours, theirs = bench2.entered("kanayama, ekf"), bench2.entered("kanayama, none")
    text = bench2_page.comparison(theirs, ours)
    assert len(text.splitlines()) == 2 + 12
    with pytest.raises(BadInput, match="other seeds"):
        bench2_page.comparison(theirs, ours[1:])
    with pytest.raises(BadInput, match="no such entry"):
        bench2.entered("nobody")


def test_fresh_seeds_depend_on_the_file_and_on_the_word():
    seeds = [bench2.fresh(source, word) for source in (b"a", b"b") for word in ("x", "y")]
    assert {len(one) for one in seeds} == {20}
    assert len({one[0] for one in seeds}) == 4
    assert min(one[0] for one in seeds) >= 10_000
