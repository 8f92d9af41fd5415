"""Mirotwin-Bench 1: the built-in campaign, its fixed scenarios, and what an entry gets."""

import hashlib
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from miro_exact.bad_input import BadInput
from miro_sim.scenario.file import load
from mirotwin.campaign.file import BUILTIN
from mirotwin.campaign.plan import load_plan
from mirotwin.campaign.rows import ResultRows
from mirotwin.commands import main

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "benchmark.md").read_text(encoding="utf-8")
SHORT = "duration_s=0.3"
IMPROVED = ("network.robot.controller={law = 'body_frame'}", "network.robot.estimator={kind = 'ekf'}")
FIGURES = ("rms_position_cm", "seen_position_cm", "settling_s", "unsettled", "chattering_m_s2", "effort_m_s2")


def fixed():
    """File of each scenario -> SHA-256, as the page has them."""
    return dict(re.findall(r"^\| `(bench1/\w+\.toml)` \|.*\| `([0-9a-f]{12})` \|$", PAGE, re.M))


@pytest.mark.parametrize(
    ("name", "runs"), [("benchmarks/estimators.toml", 360), ("examples/campaign.toml", 240)]
)
def test_the_campaign_files_of_the_tree_can_be_run(name, runs):
    assert load_plan(ROOT / name).runs == runs


def test_the_scenarios_are_those_whose_hashes_the_page_has():
    files = sorted((BUILTIN / "bench1").glob("*.toml"))
    now = {f"bench1/{path.name}": hashlib.sha256(path.read_bytes()).hexdigest()[:12] for path in files}
    assert now == fixed(), "another scenario is another benchmark: bench2"


def test_the_benchmark_has_five_scenarios_with_fifty_seeds_each():
    plan = load_plan("bench1")
    assert plan.runs == 250
    assert {plan.varied(number)["scenario"] for number in range(plan.runs)} == set(fixed())
    assert [plan.varied(number)["seed"] for number in range(50)] == list(range(50))


def test_the_plan_is_the_same_wherever_the_program_is_installed(tmp_path):
    for path in BUILTIN.rglob("*.toml"):
        copy = tmp_path / path.relative_to(BUILTIN)
        copy.parent.mkdir(exist_ok=True)
        copy.write_bytes(path.read_bytes())
    assert load_plan(tmp_path / "bench1.toml").hash == load_plan("bench1").hash


def test_a_file_of_the_name_of_a_built_in_campaign_goes_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("bench1").write_text('scenario = "fig6"\n', encoding="utf-8")
    assert load_plan("bench1").runs == 1


def test_a_campaign_that_is_neither_file_nor_built_in_is_refused_with_the_names_of_those_that_are():
    with pytest.raises(BadInput, match=r"no such file; .*built-in: bench1"):
        load_plan("bench9")


def test_an_entry_is_a_law_in_every_scenario_and_its_figures_and_digests_are_in_the_results(tmp_path):
    results = tmp_path / "entry.parquet"
    options = [word for setting in (SHORT, *IMPROVED) for word in ("--set", setting)]
    command = ["campaign", "bench1", "--seeds", "0", "--jobs", "1", "-q", "--out", str(results), *options]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 0, done.output
    rows = ResultRows(results)
    assert rows.count == 5
    assert rows.about.campaign == "bench1"
    assert len(set(rows.column("digest"))) == 5
    for name in FIGURES:
        assert name in rows.metrics()
        assert f"`{name}`" in PAGE


@pytest.mark.parametrize("name", ["line", "turned", "arc", "radio", "slip"])
def test_each_scenario_says_which_law_the_first_entry_has(name):
    scenario = load(str(BUILTIN / "bench1" / f"{name}.toml")).scenario
    assert type(scenario.networks[0].robot[0].controller).__module__ == "miro_host.laws.yang_kim"
