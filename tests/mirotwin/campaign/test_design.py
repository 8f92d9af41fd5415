"""What a campaign file says: its points in their order, its draws, values as settings; and the one that is built in."""

import contextlib
import hashlib
import itertools
import math
import re
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_host.posture import Posture
from miro_sim.pitch import ground
from miro_sim.scenario.build import reference_for
from miro_sim.scenario.file import parse as scenario_of
from mirotwin.campaign.columns import FIGURES
from mirotwin.campaign.design import Design, Draw, Factor, Level, inline
from mirotwin.campaign.file import BUILTIN, load, parse
from mirotwin.campaign.ranges import seeds_of
from mirotwin.campaign.rows import ResultRows
from mirotwin.commands import main
from tests.mirotwin.campaign.conftest import SHORT, plan_of

ROOT = Path(__file__).parents[3]
VALUES = st.recursive(
    st.booleans()
    | st.integers(-(10**12), 10**12)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(codec="utf-8"), max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)


@given(VALUES)
def test_a_value_as_a_setting_writes_it_is_read_as_the_same(value):
    text = inline(value)
    assert "\n" not in text
    assert tomllib.loads(f"value = {text}")["value"] == value


@given(st.lists(st.integers(1, 4), max_size=3), st.integers(1, 3), st.integers(1, 4), st.data())
def test_each_run_is_another_combination_in_the_order_of_nested_loops(sizes, draw_count, seed_count, data):
    factors = tuple(
        Factor(f"f{at}", tuple(Level(level) for level in range(size))) for at, size in enumerate(sizes)
    )
    draws = (Draw("key", 0.0, 1.0),)
    design = Design(7, seed_count, factors, draws, draw_count, 5)
    expected = [[]]
    for size in (*sizes, draw_count, seed_count):
        expected = [[*one, level] for one in expected for level in range(size)]
    points = [design.point(run) for run in range(design.runs)]
    assert [
        [*(level.value for level in point.levels), point.draw, point.seed - 7] for point in points
    ] == expected
    assert all(point.drawn == (draws[0].value(5, point.draw),) for point in points)


@pytest.mark.parametrize(
    ("draw", "holds"),
    [
        (Draw("k", 2.0, 5.0), lambda value: 2.0 <= value <= 5.0),
        (Draw("k", 1e-6, 1e-2, "log"), lambda value: 1e-6 <= value <= 1e-2),
        (Draw("k", -1.0, 2.0, whole=True), lambda value: value in (-1, 0, 1, 2) and isinstance(value, int)),
        (Draw("k", choices=("a", "b")), lambda value: value in ("a", "b")),
    ],
)
def test_draws_are_in_their_range_and_reach_all_of_it(draw, holds):
    values = [draw.value(0, index) for index in range(400)]
    assert all(map(holds, values))
    assert values != [draw.value(1, index) for index in range(400)]
    if draw.whole or draw.choices:
        assert len(set(values)) == (4 if draw.whole else 2)
    else:
        low, high = sorted(values)[20], sorted(values)[379]
        middle = (draw.low * draw.high) ** 0.5 if draw.scale == "log" else (draw.low + draw.high) / 2
        assert low < middle < high
        assert 140 < sum(value < middle for value in values) < 260


def test_equal_ratios_are_equally_likely_on_a_log_scale():
    values = [Draw("k", 1e-6, 1e-2, "log").value(3, index) for index in range(1000)]
    for low in (1e-6, 1e-5, 1e-4, 1e-3):
        assert 180 < sum(low <= value < 10 * low for value in values) < 320


def test_a_draw_is_shifted_neither_by_another_key_nor_by_more_draws():
    one = Design(0, 1, draws=(Draw("a", 0.0, 1.0),), draw_count=3)
    two = Design(0, 1, draws=(Draw("b", 0.0, 9.0), Draw("a", 0.0, 1.0)), draw_count=5)
    assert [one.point(run).drawn[0] for run in range(3)] == [two.point(run).drawn[1] for run in range(3)]


def test_a_drawn_value_gets_into_its_run_and_its_column():
    plan = plan_of(
        'scenario = "fig7"\nseeds = "0-1"\n[random]\ncount = 3\n'
        "[random.range]\nhost.compute_s = { from = 0.001, to = 0.02 }\n"
        "host.word_bits = { from = 9, to = 12, whole = true }\n"
    )
    assert plan.runs == 6
    columns = plan.varied(3)
    assert columns["draw"] == 1
    assert columns["seed"] == 1
    assert plan.work(3).settings == (
        f"host.compute_s={columns['host.compute_s']!r}",
        f"host.word_bits={columns['host.word_bits']}",
    )


def test_without_a_count_each_seed_draws_its_own_for_all_levels_wherever_the_seeds_begin():
    text = 'scenario = "fig6"\nseeds = "{}"\n[grid]\nscenario = ["fig6", "fig8"]\n[random.range]\nhost.compute_s = {}\n'
    drawn = {}
    for seeds in ("3-5", "5-6"):
        plan = plan_of(text.format(seeds, "{ from = 0.001, to = 0.02 }"))
        assert plan.runs == 2 * len(seeds_of(seeds))
        for run in range(plan.runs):
            columns = plan.varied(run)
            value = drawn.setdefault(columns["seed"], columns["host.compute_s"])
            assert columns["host.compute_s"] == value
            assert f"host.compute_s={value!r}" in plan.work(run).settings
    assert len(set(drawn.values())) == len(drawn) == 4


def test_a_seed_of_draws_without_their_count_is_refused():
    text = 'scenario = "fig6"\n[random]\nseed = 1\n[random.range]\nhost.compute_s = { from = 0.001, to = 0.02 }\n'
    with pytest.raises(BadInput, match=r"random\.seed: has no effect"):
        plan_of(text)


def test_firmware_and_scenarios_are_factors_too(tmp_path):
    from miro_robot.firmware import image_path

    (tmp_path / "mine.ihx").write_bytes(image_path().read_bytes())
    plan = plan_of(
        'scenario = "fig6"\n[grid]\nscenario = ["fig6", "fig8"]\nfirmware = ["", "mine.ihx"]\n',
        tmp_path / "c.toml",
    )
    works = [plan.work(run) for run in range(4)]
    assert [work.origin for work in works] == ["fig6", "fig6", "fig8", "fig8"]
    assert [work.firmware.path for work in works] == [str(image_path()), str(tmp_path / "mine.ihx")] * 2
    assert len({work.firmware.sha256 for work in works}) == 1
    assert plan.varied(1)["firmware"] == "mine.ihx"


def test_expectations_of_the_file_are_added_to_those_of_the_scenario():
    plan = plan_of(SHORT + "[expect]\nsettles_within_s = { within_s = 0.2, position_cm = 2.5 }\n")
    assert plan.checks[-1] == "settles_within_s"
    assert "expect.settles_within_s={within_s = 0.2, position_cm = 2.5}" in plan.work(0).settings


@pytest.mark.parametrize(
    ("change", "same"),
    [
        (("0.3", "0.30"), True),
        (("[grid]", "# a comment\n[grid]"), True),
        (("3-5", "3-4"), False),
        (("0.3", "0.2"), False),
        (("[0.0,", "[1e-4,"), False),
        (("[grid]", "[expect]\ninside_pitch = true\n[grid]"), False),
    ],
)
def test_two_campaigns_are_the_same_when_their_runs_and_checks_are(change, same):
    assert (plan_of(SHORT.replace(*change)).hash == plan_of().hash) == same
    assert plan_of(path="elsewhere/other.toml").hash == plan_of().hash


@pytest.mark.parametrize(
    "text",
    [
        "{ from = 2, to = 1 }",
        "{ from = 0, to = 1, scale = 'log' }",
        "{ from = 1, to = 2, scale = 'ln' }",
        "{ from = 0.5, to = 2, whole = true }",
        "{ from = 1, to = 2, whole = 1 }",
        "{ from = 1, to = 2, steps = 3 }",
        "{ from = 1 }",
        "{ from = 'a', to = 2 }",
        "{ choose = [] }",
        "{ choose = [[1]] }",
        "{ choose = [1], from = 1 }",
        "{ from = -1.7e308, to = 1.7e308 }",
        "3",
        "{}",
    ],
)
def test_what_is_no_range_is_refused_with_its_place(text):
    document = f'scenario = "fig6"\n[random]\ncount = 1\n[random.range]\nhost.compute_s = {text}\n'
    with pytest.raises(BadInput, match=r"^c\.toml: random\.range\.host\.compute_s: ") as raised:
        parse(document, "c.toml")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("text", ["3", "[0.001, 0.02]", "{ low = 0.001, high = 0.02 }"])
def test_how_a_range_is_written_is_told_where_there_is_none(text):
    document = f'scenario = "fig6"\n[random]\ncount = 1\n[random.range]\nhost.compute_s = {text}\n'
    with pytest.raises(BadInput, match=r"expected a range, got .*; write { from = .., to = .. }$"):
        parse(document, "c.toml")


@given(st.text(max_size=80) | st.lists(st.sampled_from(SHORT.split()), max_size=30).map("\n".join))
def test_any_other_text_is_a_campaign_or_is_refused(text):
    with contextlib.suppress(BadInput):
        parse(text, "c.toml")


def test_names_of_other_columns_are_no_factors():
    for name in ("run", "verdict", "check.no_fault", next(iter(FIGURES))):
        with pytest.raises(BadInput, match="is the name of a column"):
            plan_of(f'scenario = "fig6"\n[factor."{name}"]\na = []\n')


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        ("own = []\nlate = { firmware = 'own' }", r"factor.image.late: expected a list, got a table"),
        ("own = []\nlate = ['a=1', 2]", r"factor.image.late\[1\]: expected a string, got a whole number"),
        ("own = 3\nlate = 4", r"factor.image.own: expected a list, got a whole number"),
    ],
)
def test_a_level_that_cannot_be_used_is_named(levels, expected):
    with pytest.raises(BadInput, match=f"^c.toml: {expected}"):
        parse(f'scenario = "fig6"\n[factor.more]\nown = []\n[factor.image]\n{levels}\n', "c.toml")


def test_a_setting_of_a_key_that_the_campaign_varies_would_have_no_effect_and_is_refused():
    text = 'scenario = "fig6"\n[grid]\nnetwork.radio.bit_error_rate = [0.0, 1e-3]\n'
    expected = "the campaign varies network.radio.bit_error_rate, this would have no effect"
    with pytest.raises(BadInput, match=rf"--set network.radio.bit_error_rate=0.5: {expected}"):
        parse(text, "c.toml", ["network.radio.bit_error_rate=0.5"])
    with pytest.raises(BadInput, match=rf"c.toml: set.network.radio.bit_error_rate: {expected}"):
        parse(f"set = {{ network.radio.bit_error_rate = 0.5 }}\n{text}", "c.toml")


def test_ranges_of_seeds_may_be_as_long_as_is_said():
    assert len(seeds_of("0-9999999", 10**7)) == 10**7
    with pytest.raises(ValueError, match="give 1 to 9"):
        seeds_of("0-9", 9)


# The benchmarks: their fixed scenarios, and what an entry gets

PAGE = (ROOT / "docs" / "benchmark.md").read_text(encoding="utf-8")
BRIEF = "duration_s=0.3"
IMPROVED = ("network.robot.controller={law = 'body_frame'}", "network.robot.estimator={kind = 'ekf'}")
SHOWN = ("rms_position_cm", "seen_position_cm", "settling_s", "unsettled", "chattering_m_s2", "effort_m_s2")


def fixed():
    """Each file of a benchmark -> SHA-256."""
    lines = (ROOT / "benchmarks/bench.sha256").read_text(encoding="utf-8").splitlines()
    return {name: digest for digest, name in (line.split() for line in lines)}


@pytest.mark.parametrize(
    ("name", "runs"),
    [
        ("benchmarks/estimators.toml", 360),
        ("examples/campaign.toml", 240),
        ("examples/boards/car/campaign.toml", 180),
        ("examples/boards/follower/campaign.toml", 80),
    ],
)
def test_the_campaign_files_of_the_tree_can_be_run(name, runs):
    assert load(ROOT / name).runs == runs


def test_the_files_are_those_whose_hashes_the_tree_has():
    files = {path.relative_to(BUILTIN).as_posix(): path.read_bytes() for path in BUILTIN.rglob("*.toml")}
    now = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    assert now == fixed(), "another file is another benchmark: bench3"
    shown = re.findall(r"^\* `(bench2/\w+\.toml)`: ", PAGE, re.M)
    assert sorted(shown) == sorted(name for name in now if name.startswith("bench2/"))


@pytest.mark.parametrize(("name", "seeds"), [("bench1", range(50)), ("bench2", range(5000, 5020))])
def test_a_benchmark_runs_all_its_scenarios_with_the_same_seeds(name, seeds):
    plan = load(name)
    columns = [plan.varied(number) for number in range(plan.runs)]
    assert {one["scenario"] for one in columns} == {one for one in fixed() if one.startswith(f"{name}/")}
    for scenario in {one["scenario"] for one in columns}:
        assert {one["seed"] for one in columns if one["scenario"] == scenario} == set(seeds)


@pytest.mark.parametrize("name", ["bench2", "bench2-noise"])
def test_wherever_a_start_is_drawn_the_robot_stands_on_the_pitch(name):
    plan = load(name)
    names = [f"network.robot.start_error_{key}" for key in ("x_cm", "y_cm", "theta_rad")]
    ends = {draw.name: draw.ends() for draw in plan.design.draws}
    assert list(ends) == names
    for text in plan.scenarios.values():
        path = reference_for(scenario_of(text, name).networks[0].robot[0], 1.0)
        at = path.at(0.0).posture
        for x_cm, y_cm in itertools.product(ends[names[0]], ends[names[1]]):
            corner = Posture(at.x_m + x_cm / 100.0, at.y_m + y_cm / 100.0, math.pi / 4.0)  # reaches furthest
            assert ground.holds(corner)


def test_the_plan_is_the_same_wherever_the_program_is_installed(tmp_path):
    for path in BUILTIN.rglob("*.toml"):
        copy = tmp_path / path.relative_to(BUILTIN)
        copy.parent.mkdir(exist_ok=True)
        copy.write_bytes(path.read_bytes())
    assert load(tmp_path / "bench1.toml").hash == load("bench1").hash


def test_a_file_of_the_name_of_a_built_in_campaign_goes_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("bench1").write_text('scenario = "fig6"\n', encoding="utf-8")
    assert load("bench1").runs == 1


def test_a_campaign_that_is_neither_file_nor_built_in_is_refused_with_the_names_of_those_that_are():
    with pytest.raises(BadInput, match=r"no such file; .*built-in: bench1"):
        load("bench9")


def test_an_entry_is_a_law_in_every_scenario_and_its_figures_and_digests_are_in_the_results(tmp_path):
    results = tmp_path / "entry.parquet"
    options = [word for setting in (BRIEF, *IMPROVED) for word in ("--set", setting)]
    command = ["campaign", "bench1", "--seeds", "0", "--jobs", "1", "-q", "--out", str(results), *options]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 0, done.output
    rows = ResultRows(results)
    assert rows.count == 5
    assert rows.about.campaign == "bench1"
    assert len(set(rows.column("digest"))) == 5
    for name in SHOWN:
        assert name in rows.metrics()
        assert f"`{name}`" in PAGE
