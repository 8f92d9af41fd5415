"""The search for gains: the same budget and the same draws for each law, whatever makes its runs."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import gains
from benchmarks.gains import FAMILIES, FIGURES, PATHS, Budget, Drive, Outcome, Search, Task
from miro_sim.scenario.file import load

SMALL = Budget(explored=6, generations=2, children=4)
RUNS = st.lists(st.builds(Outcome, st.booleans(), st.floats(0.0, 3.0)), min_size=5, max_size=5)
families = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)


class Record:
    """A runner without a robot: what a set does is a function of its text. Keeps the tasks."""

    def __init__(self):
        self.tasks = []

    def __call__(self, what, tasks):
        self.tasks += tasks
        return [{figure: self.drive(task, figure) for figure in task.figures} for task in tasks]

    def drive(self, task, figure):
        outcomes = (Outcome((len(task.settings) + seed) % figure > 1, 1.0) for seed in task.seeds)
        return gains.drive_of(task, outcomes)


@families
@given(number=st.integers(0, 10**6), path=st.sampled_from(sorted(PATHS)), generation=st.integers(0, 5))
def test_every_set_is_a_scenario_within_the_bounds_and_is_drawn_again_alike(family, number, path, generation):
    first = gains.drawn(family, number)
    second = gains.child(family, first, path, generation, number)
    assert gains.drawn(family, number) == first
    assert gains.child(family, first, path, generation, number) == second
    for found in (first, second):
        assert all(low <= found[name] <= high for name, (low, high) in family.bounds.items())
        load("fig6", (family.settings(found),))


@given(number=st.integers(0, 10**6))
def test_the_sets_that_keep_the_theory_of_epsilon_tracking_do_keep_it(number):
    family = next(family for family in FAMILIES if "margin" in family.bounds)
    found = family.keys(gains.drawn(family, number))
    inputs = ((0.2 / found["length_m"]) ** 2 + 0.2**2) ** 0.5
    assert found["beta_per_s"] * found["epsilon_rad"] > 2.0 * inputs


@families
def test_each_law_tries_as_many_sets_from_the_same_starts_with_the_same_seeds(family):
    runner = Record()
    found = Search(family, SMALL, runner).found()
    assert found.sets == 6 + 2 * 2 * 4
    asked = [(task.figures, task.seeds, task.patient) for task in runner.tasks]
    line, curve = PATHS["line"], PATHS["curve"]
    assert asked == [
        *[(FIGURES, gains.SEARCH, False)] * 6,
        *[(line, gains.SEARCH, False)] * 8,
        *[(line, gains.CHECK, False)] * 4,
        (line, gains.HELD_OUT, True),
        *[(curve, gains.SEARCH, False)] * 8,
        *[(curve, gains.CHECK, False)] * 4,
        (curve, gains.HELD_OUT, True),
    ]


def test_the_seeds_that_are_held_out_have_chosen_nothing():
    groups = [set(gains.SEARCH), set(gains.CHECK), set(gains.HELD_OUT)]
    assert len(set.union(*groups)) == sum(len(group) for group in groups)


@given(RUNS)
def test_a_set_leaves_a_start_when_it_can_no_longer_settle_and_is_judged_as_if_it_had_gone_on(runs):
    hasty, patient = (gains.drive_of(Task("", (6,), range(5), patient), runs) for patient in (False, True))
    assert patient.runs == 5
    assert hasty.settles == patient.settles == (len([run for run in runs if run.settled]) >= 4)
    assert hasty.runs <= patient.runs
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
    assert gains.MISSED_CM <= near.cost_cm < far.cost_cm < gains.LOST_CM


def test_the_best_set_is_the_one_of_least_cost_and_of_equals_the_first():
    def tried(name, cost_cm):
        return gains.Tried({"name": name}, {6: Drive((cost_cm,), (), 1)})

    order = gains.ranked([tried(1, 2.0), tried(2, 1.0), tried(3, 1.0)], (6,))
    assert [one.gains["name"] for one in order] == [2, 3, 1]


def fake_runs(task):
    return Record()("", [task])[0]


@pytest.mark.parametrize("workers", [1, 3])
def test_the_page_does_not_depend_on_who_makes_the_runs(workers, monkeypatch, capsys):
    monkeypatch.setattr(gains, "driven", fake_runs)
    budget, held_out = Budget(4, 1, 4), range(20)
    with ThreadPoolExecutor(workers) as executor:
        pieced = [Search(family, budget, gains.runner_of(executor), held_out).found() for family in FAMILIES]
    whole = [Search(family, budget, Record(), held_out).found() for family in FAMILIES]
    assert gains.page(pieced, budget, held_out) == gains.page(whole, budget, held_out)
    assert "exploring: done" in capsys.readouterr().err


def test_the_page_has_shares_counts_and_gains_of_each_law():
    found = [Search(family, SMALL, Record()).found() for family in FAMILIES]
    text = gains.page(found, SMALL, gains.HELD_OUT)
    for one in found:
        rows = [line for line in text.splitlines() if line.startswith(f"| {one.family.name} |")]
        assert len(rows) == 4  # shares, best sets, gains for two paths
        assert rows[0].endswith(f"| {one.sets} | {one.runs} |")
        assert rows[1].count(" of 50: ") == len(FIGURES)
    assert "/home" not in text


def test_a_run_that_drives_away_is_over_and_one_that_stays_has_an_error():
    """Both from the start of Fig. 6: gains of the scenario, and none that steer at all."""
    good = "network.robot.controller.gamma1_per_s=2.05"
    lost = 'network.robot.controller={law="yang_kim", max_v_m_s=0.95, gamma1_per_s=0.0, p1_m_s2=0.0, q1_per_s=0.0}'
    seeds = range(2000, 2001)
    drives = [gains.driven(Task(setting, (6,), seeds, True))[6] for setting in (good, lost)]
    assert drives[0].settled == 1
    assert 0.0 < drives[0].errors_cm[0] < 3.0
    assert (drives[1].runs, drives[1].settled) == (1, 0)
    assert drives[1].ends_cm[0] > 3.0


@pytest.mark.parametrize(
    "arguments",
    [["--only", "weather"], ["--only", "paper", "--write", "x.md"], ["--jobs", "0"], ["--held-out", "x"]],
)
def test_what_cannot_be_searched_is_refused(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        gains.main(arguments)
    assert caught.value.code == 2
    assert "Traceback" not in capsys.readouterr().err
