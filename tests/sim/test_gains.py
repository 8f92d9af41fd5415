"""Searches for gains, small enough for every test run; their page, and the gain set that is a case of its own."""

import math
import random
import re
import xml.etree.ElementTree as ET
from concurrent.futures import Executor, Future
from functools import lru_cache
from pathlib import Path
from zlib import crc32

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import gains, gains_page, gains_search, gains_tables
from benchmarks.gains import Journal, jobs_of, key_of
from benchmarks.gains_search import (
    CAMERAS,
    FAMILIES,
    FIGURES,
    PAPER,
    PATHS,
    RETUNED,
    Budget,
    Drive,
    Found,
    HeldOut,
    Job,
    Outcome,
    Search,
    Task,
    Tried,
)
from benchmarks.gains_tables import LAWS, MEASURES, ONE_SET, tables_of
from miro_sim.scenario.file import load
from mirotwin.campaign.reproduce.stored_tables import read

PAGE = Path(__file__).parents[2] / "docs/background/gains.md"
STORED = read(gains_tables.DATA)
SMALL = Budget(explored=6, first=4, second=5)
RUNS = st.lists(st.builds(Outcome, st.booleans(), st.floats(0.0, 3.0)), min_size=3, max_size=3)
families = pytest.mark.parametrize("family", FAMILIES.values(), ids=lambda family: family.name)


class Record:
    """Makes runs without a robot: what a set does is a function of its text. Keeps the tasks."""

    def __init__(self, prunes=True):
        self.tasks, self.held_out, self.prunes = [], [], prunes

    def drive(self, task):
        self.tasks.append(task)
        drives = {}
        for figure in reversed(task.figures):
            draws = random.Random(crc32(f"{task.settings} {figure} {task.seeds}".encode()))
            share = draws.random()
            outcomes = (Outcome(draws.random() < share, draws.uniform(0.2, 2.0)) for _ in task.seeds)
            drives[figure] = gains_search.drive_of(task, outcomes)
            if self.prunes and gains_search.cost_cm(drives, task.figures) > task.limit_cm:
                break
        return drives

    def hold_out(self, task):
        self.held_out.append(task)
        return {figure: self._held_out(task, figure) for figure in task.figures}

    def _held_out(self, task, figure):
        draws = random.Random(crc32(f"{task.settings} {figure}".encode()))
        settled = range(draws.randint(0, len(task.seeds)))
        return HeldOut(len(task.seeds), *(tuple(draws.uniform(0.1, 2.0) for _ in settled) for _ in range(3)))


def found_of(job, record=None):
    record = record or Record()
    return Search(job, record.drive, record.hold_out).found()


@lru_cache
def results():
    return {job: found_of(job) for job in jobs_of(4, SMALL, range(10))}


def fake_one_set():
    record = Record()
    return gains_tables.one_set(lambda _, tasks: map(record.hold_out, tasks))


@families
@given(
    number=st.integers(0, 10**6),
    path=st.sampled_from(sorted(PATHS)),
    repeat=st.integers(0, 9),
    generation=st.integers(0, 5),
)
def test_every_set_is_a_scenario_within_the_bounds_and_is_drawn_again_alike(
    family, number, path, repeat, generation
):
    first = gains_search.drawn(family, repeat, number)
    second = gains_search.child(family, first, path, repeat, generation, number)
    assert gains_search.drawn(family, repeat, number) == first
    assert gains_search.child(family, first, path, repeat, generation, number) == second
    for found in (first, second):
        assert all(low <= found[name] <= high for name, (low, high) in family.bounds.items())
        load("fig6", (family.settings(found),))


@families
@given(st.data())
def test_the_corners_of_the_bounds_are_scenarios(family, data):
    corner = {
        name: gains_search.rounded(data.draw(st.sampled_from(ends))) for name, ends in family.bounds.items()
    }
    load(data.draw(st.sampled_from(("fig6", "fig8"))), (family.settings(corner),))


def shipped(scenario, *settings):
    return load(scenario, settings).scenario.networks[0].robot[0].controller


@pytest.mark.parametrize(
    ("family", "gains_of"),
    [
        (PAPER, lambda: shipped("fig6")),
        (PAPER, lambda: shipped("fig7")),
        (PAPER, lambda: shipped("fig8")),
        (RETUNED, lambda: shipped("fig6", "network.robot.controller={law='epsilon_tracking'}")),
        (RETUNED, lambda: shipped("fig6", *ONE_SET)),
    ],
    ids=("fig6", "fig7", "fig8", "epsilon", "one set"),
)
def test_gains_that_are_shipped_or_named_lie_within_the_bounds(family, gains_of):
    known = gains_of()
    assert all(low < getattr(known, name) < high for name, (low, high) in family.bounds.items())


@families
def test_each_law_tries_as_many_sets_from_the_same_starts_with_the_same_seeds(family):
    record = Record()
    found_of(Job(family.name, "white noise", 3, SMALL, range(10)), record)
    search, check = gains_search.search_seeds(3), gains_search.check_seeds(3)
    expected = [(FIGURES, search, False)] * 6
    for path in PATHS.values():
        for sets in (12, 15):
            expected += [*[(path, search, False)] * sets, *[(path, check, True)] * 4]
    assert [(task.figures, task.seeds, task.patient) for task in record.tasks] == expected
    assert {task.settings[:-1] for task in record.tasks} == {CAMERAS["white noise"]}
    assert 2 <= len(record.held_out) <= 4  # a set that stays the best is not driven again
    assert {task.seeds for task in record.held_out} == {range(10)}
    assert SMALL.sets == (6 + 12, 6 + 12 + 15)


def test_searches_of_other_numbers_draw_other_sets_with_other_seeds():
    firsts = [Record(), Record()]
    for repeat, record in enumerate(firsts):
        found_of(Job(PAPER.name, "white noise", repeat, SMALL), record)
    first, second = firsts
    assert not {task.settings for task in first.tasks} & {task.settings for task in second.tasks}
    seeds = [{seed for task in record.tasks for seed in task.seeds} for record in firsts]
    assert not seeds[0] & seeds[1]


def test_the_seeds_that_are_held_out_have_chosen_nothing():
    chose = [
        set(seeds(repeat))
        for repeat in range(gains.REPEATS)
        for seeds in (gains_search.search_seeds, gains_search.check_seeds)
    ]
    groups = [*chose, set(gains_search.HELD_OUT), set(gains_tables.ONE_SET_SEEDS)]
    assert len(set.union(*groups)) == sum(map(len, groups)) - len(gains_search.HELD_OUT)


@pytest.mark.parametrize("repeat", range(5))
def test_starts_that_are_left_out_change_no_result(repeat):
    job = Job(PAPER.name, "white noise", repeat, SMALL)
    pruned, whole = (found_of(job, Record(prunes)) for prunes in (True, False))
    assert pruned.best == whole.best
    assert pruned.runs < whole.runs


@given(RUNS)
def test_a_set_leaves_a_start_after_a_run_that_does_not_settle_if_it_is_not_patient(runs):
    hasty, patient = (
        gains_search.drive_of(Task((), (6,), range(3), patient), runs) for patient in (False, True)
    )
    assert patient.runs == 3
    assert hasty.settles == patient.settles == all(run.settled for run in runs)
    assert len(hasty.ends_cm) == (0 if hasty.settles else 1)
    if hasty.settles:
        assert hasty == patient


@given(st.integers(0, 9), st.floats(0.0, 3.0), st.floats(0.0, 500.0))
def test_a_run_more_that_settles_is_cheaper_however_near_the_other_one_ends(settled, error_cm, end_cm):
    worse = Drive((error_cm,) * settled, (end_cm,) * (10 - settled), 10)
    better = Drive((error_cm,) * (settled + 1), (end_cm,) * (9 - settled), 10)
    assert better.cost_cm < worse.cost_cm


@given(st.floats(0.0, 100.0), st.floats(0.1, 100.0))
def test_where_nothing_settles_the_set_that_ends_nearer_is_the_cheaper_one(end_cm, more_cm):
    near, far = (Drive((), (end,) * 2, 5) for end in (end_cm, end_cm + more_cm))
    assert gains_search.MISSED_CM <= near.cost_cm < far.cost_cm < gains_search.LOST_CM


def test_the_best_set_is_the_one_of_least_cost_and_of_equals_the_first():
    def tried(name, cost_cm):
        return Tried({"name": name}, {6: Drive((cost_cm,), (), 1)})

    order = gains_search.ranked([tried(1, 2.0), tried(2, 1.0), tried(3, 1.0)], (6,))
    assert [one.gains["name"] for one in order] == [2, 3, 1]


def test_a_run_that_drives_away_is_over_and_one_that_stays_has_an_error():
    """Both from the start of Fig. 6: gains of the scenario, and none that steer at all."""
    good = "network.robot.controller.gamma1_per_s=2.05"
    lost = 'network.robot.controller={law="yang_kim", max_v_m_s=0.95, gamma1_per_s=0.0, p1_m_s2=0.0, q1_per_s=0.0}'
    tasks = [Task((setting,), (6,), range(2000, 2001)) for setting in (good, lost)]
    drives = [gains_search.driven(task)[6] for task in tasks]
    assert drives[0].settled == 1
    assert 0.0 < drives[0].errors_cm[0] < 3.0
    assert (drives[1].runs, drives[1].settled) == (1, 0)
    assert drives[1].ends_cm[0] > 3.0
    held_out = gains_search.held_out(tasks[0])[6]
    assert held_out.truth_cm == pytest.approx(drives[0].errors_cm, rel=1e-12)


class HereAndNow(Executor):
    """Makes each job at once; the jobs that it was given."""

    def __init__(self):
        self.jobs = []

    def submit(self, _, job):
        self.jobs.append(job)
        future = Future()
        future.set_result(found_of(job))
        return future


@pytest.fixture
def jobs():
    return jobs_of(2, SMALL, range(10), "paper")


def test_a_search_that_the_journal_has_is_not_made_again(jobs, tmp_path, capsys):
    path, executor = tmp_path / "gains.jsonl", HereAndNow()
    whole = gains.searched(jobs, HereAndNow(), Journal(None))
    gains.searched(jobs[:2], executor, Journal(path))
    with path.open("ab") as stream:
        stream.write(b'{"key":"cut o')
    assert gains.searched(jobs, executor, Journal(path)) == whole
    assert gains.searched(jobs, executor, Journal(path)) == whole
    assert sorted(executor.jobs) == sorted(jobs)
    assert len(path.read_bytes().splitlines()) == len(jobs)
    assert f"{len(jobs) - 2} of {len(jobs) - 2}: " in capsys.readouterr().err


def test_whatever_decides_a_search_changes_its_key(tmp_path, monkeypatch):
    job = Job(PAPER.name, "white noise", 0)
    others = (
        job._replace(family=RETUNED.name),
        job._replace(camera="pixels, exact"),
        job._replace(repeat=1),
        job._replace(budget=SMALL),
        job._replace(held_out=range(50)),
    )
    keys = {key_of(job), *map(key_of, others)}
    (tmp_path / "digests.json").write_text("{}")
    monkeypatch.setattr(gains, "DIGESTS", tmp_path / "digests.json")
    assert len(keys | {key_of(job)}) == len(others) + 2


def test_the_page_is_the_same_from_a_journal_and_has_no_place_of_this_machine(tmp_path):
    again = {
        job: msgspec.json.decode(msgspec.json.encode(found), type=Found) for job, found in results().items()
    }
    one = fake_one_set()
    found = tables_of(results(), one)
    assert tables_of(again, one) == found
    text = gains_page.page(found)
    assert "/home" not in text
    found.write(tmp_path / "gains.json")
    assert read(tmp_path / "gains.json") == found
    for number, made in enumerate((results(), again)):
        gains_page.draw(made, tmp_path / f"{number}.svg")
    assert (tmp_path / "0.svg").read_bytes() == (tmp_path / "1.svg").read_bytes()


def rows_of(text, title):
    """The cells of the blocks of a section."""
    section = text.partition(f"## {title}\n")[2].partition("\n## ")[0]
    blocks = re.findall(r"```text\n(.*?)```", section, re.DOTALL)
    return [re.split("  +", line) for block in blocks for line in block.splitlines()]


def all_rows_are_there(found, repeats):
    """Checks that each table has its rows, and the page those that it shows."""
    cells = len(LAWS) * len(CAMERAS)
    assert len(found.rows("pairs")) == 6 * len(CAMERAS)
    assert len(found.rows("spread")) == 4 * cells
    assert len(found.rows("drawn")) == cells
    sets = [(row[0], row[1]) for row in found.rows("bounds")]
    assert sets == [(law, f"{12 * repeats}") for law in LAWS]
    assert len(found.rows("sets")) == 2 * cells
    assert len(found.rows("one set")) == len(found.rows("one set, verdicts")) == 9
    assert all(len(row) == len(rows[0]) for rows in found.tables.values() for row in rows)
    text = gains_page.page(found)
    assert f"medians of {repeats} searches" in text
    assert len(rows_of(text, "Which law is better")) == 1 + len(CAMERAS) + 1 + 2 * len(CAMERAS)
    assert len(rows_of(text, "One set for Figs. 6, 7 and 9")) == 1 + len(CAMERAS)


def test_all_rows_are_there():
    all_rows_are_there(tables_of(results(), fake_one_set()), 4)


def test_ten_searches_of_equal_laws_seldom_decide():
    """Exact distribution of Mann-Whitney's count of pairs, ten against ten without equals."""

    @lru_cache(None)
    def orders(count, first, second):
        if count < 0:
            return 0
        if not first or not second:
            return int(count == 0)
        return orders(count - second, first - 1, second) + orders(count, first, second - 1)

    share = [
        2 * sum(orders(count, 10, 10) for count in range(most + 1)) / math.comb(20, 10) for most in (23, 24)
    ]
    assert share[0] == pytest.approx(0.043, abs=0.001)
    assert share[1] > 0.05
    assert pytest.approx(1 - 0.23) == gains_tables.DECISIVE


def test_more_runs_that_settle_and_smaller_errors_are_better_and_no_error_is_the_largest():
    settles, truth, *_ = MEASURES
    none, few, many = (
        HeldOut(9, (cm,) * n, (cm,) * n, (cm,) * n) for n, cm in ((0, 0.0), (3, 1.0), (8, 2.0))
    )
    assert [settles.beats(*pair) for pair in ((many, few), (few, many), (few, few))] == [1.0, 0.0, 0.5]
    assert [truth.beats(*pair) for pair in ((many, few), (few, many), (none, none))] == [0.0, 1.0, 0.5]
    assert truth.beats(many, none) == 1.0


def test_a_set_on_a_bound_is_counted():
    inside = gains_search.drawn(RETUNED, 0, 0)
    low, high = (RETUNED.bounds[name][end] for name, end in (("length_m", 0), ("alpha_per_s", 1)))
    outermost = {**inside, "alpha_per_s": high, "length_m": gains_search.rounded(low)}
    assert gains_tables.on_bounds(RETUNED.name, outermost) == ["alpha_per_s most", "length_m least"]
    assert gains_tables.on_bounds(RETUNED.name, inside) == []


@pytest.mark.parametrize(
    "arguments",
    [
        *(
            each.split()
            for each in ("--only weather", "--jobs 0", "--repeats 0", "--held-out x", "--budget 1 0 1")
        ),
        ["--only", "paper", "--write", "x.md"],
    ],
)
def test_what_cannot_be_searched_is_refused(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        gains.main(arguments)
    assert caught.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_all_rows_of_the_searches_are_stored_and_the_page_is_made_of_them():
    all_rows_are_there(STORED, gains.REPEATS)
    assert gains_page.page(STORED) == PAGE.read_text(encoding="utf-8")


def test_the_counts_of_the_verdicts_are_those_of_the_pairs():
    text, pairs = PAGE.read_text(encoding="utf-8"), STORED.rows("pairs")
    counts = rows_of(text, "Which law is better")[1 : 1 + len(CAMERAS)]
    won = {measure.name: [0, 0] for measure in MEASURES}
    for camera, *cells in counts:
        for column, (measure, cell) in enumerate(zip(MEASURES, cells, strict=True)):
            texts = [row[3 + column] for row in pairs if row[0] == camera]
            wins = [len([one for one in texts if one.endswith(f": {law}")]) for law in LAWS]
            assert cell == f"{wins[0]}/{wins[1]}"
            won[measure.name] = [sum(both) for both in zip(won[measure.name], wins, strict=True)]
            for one in texts:
                share, _, winner = one.partition(": ")
                assert winner == ("" if 23 < int(share) < 77 else LAWS[int(share) >= 77])
    first = " ".join(text.partition("<!--")[0].split())
    for name, (paper, other) in won.items():
        assert f" {paper} / {other} by the {name}" in first


def test_the_picture_has_a_dot_for_each_search_that_settles_somewhere():
    root = ET.fromstring(PAGE.with_suffix(".svg").read_text(encoding="utf-8"))
    strips = [one for one in root.iter("{http://www.w3.org/2000/svg}path") if one.get("class") == "dots"]
    assert len(strips) == len(MEASURES) * len(CAMERAS) * len(LAWS) * len(PATHS) * 2
    dots = [strip.get("d").count("M") for strip in strips]
    assert max(dots) == gains.REPEATS
    spreads = " ".join(text for row in STORED.rows("spread") for text in row[6:9])
    without = [int(number) for number in re.findall(r"(\d+) without", spreads)]
    assert sum(dots) == len(strips) * gains.REPEATS - sum(without)


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_a_stored_set_does_what_its_row_says(law):
    """White noise, the curve: the cheapest runs."""
    (row,) = (row for row in STORED.rows("sets") if row[:3] == ["white noise", law, "curve"])
    values = ", ".join(f"{name}={value}" for name, value in re.findall(r"(\w+) ([\d.e-]+)", row[3]))
    family = FAMILIES[law]
    settings = f'network.robot.controller={{law="{family.law}", {family.fixed}, {values}}}'
    runs = gains_search.held_out(
        Task((*CAMERAS["white noise"], settings), PATHS["curve"], gains_search.HELD_OUT)
    )
    assert row[4] == "; ".join(f"Fig. {figure}: {gains_tables.errors(one)}" for figure, one in runs.items())


@pytest.mark.parametrize(
    ("cameras", "figures", "seeds"),
    [
        (["white noise"], (6,), range(8)),
        pytest.param(list(CAMERAS), gains_tables.ONE_SET_FIGURES, range(20), marks=pytest.mark.slow),
    ],
    ids=("some runs", "20 seeds"),
)
def test_the_verdicts_on_the_one_set_are_those_of_fewer_seeds(cameras, figures, seeds):
    found = gains_tables.one_verdicts(gains_tables.one_set(map, cameras, figures, seeds))
    assert len(found) == 3 * len(cameras)
    assert {key: better for key, (_, better) in found.items()} == {
        (row[0], row[1]): row[-1] for row in STORED.rows("one set, verdicts") if row[0] in cameras
    }
