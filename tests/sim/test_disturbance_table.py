"""The table of disturbances: its cases can be run, and change what they say; a small one comes out."""

import re
from pathlib import Path

import pytest

from benchmarks import disturbances
from miro_sim.scenario.file import load

PAGE = Path(__file__).parents[2] / "docs/disturbances.md"


@pytest.mark.parametrize("case", disturbances.CASES[1:], ids=lambda case: case.name)
def test_each_case_is_a_scenario_of_its_own(case):
    base = disturbances.settings_of(disturbances.CASES[0], "paper")
    for figure in disturbances.FIGURES:
        assert load(figure, disturbances.settings_of(case, "paper")).scenario != load(figure, base).scenario


@pytest.mark.parametrize("controller", disturbances.CONTROLLERS)
def test_estimators_are_told_the_delay_and_nothing_else(controller):
    cases = {case.name: case for case in disturbances.CASES}
    ages = set()
    for case in cases.values():
        scenario = load("fig6", disturbances.settings_of(case, controller)).scenario
        estimator = scenario.networks[0].robot[0].estimator
        if controller != "paper":
            assert estimator.age_s == pytest.approx(scenario.camera.delay_frames * 1001 / 30000, abs=1e-9)
            ages.add(estimator.age_s)
    assert len(ages) == (0 if controller == "paper" else 3)


def test_names_of_groups_and_parts_of_names_choose_cases():
    chosen = disturbances.chosen(["slip", "8 bits"])
    assert {disturbances.CASES[number].group for number in chosen} == {"slip", "word"}
    assert len(chosen) == 3
    assert len(disturbances.chosen([""])) == len(disturbances.CASES)


@pytest.mark.slow
def test_a_table_of_one_seed_has_a_figure_in_each_cell(capsys):
    assert disturbances.main(["--only", "base", "--seeds", "0", "--jobs", "1"]) == 0
    out, err = capsys.readouterr()
    *head, row = out.splitlines()
    assert head == list(disturbances.head())
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[0] == "none"
    assert all(re.fullmatch(r"0\.\d\d|1\.\d\d", cell) for cell in cells[1:])
    assert len(cells) == 7
    assert "6 of 6 cells" in err


@pytest.mark.parametrize("arguments", [["--only", "weather"], ["--seeds", "x"], ["--jobs", "0"]])
def test_what_cannot_be_run_is_refused(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        disturbances.main(arguments)
    assert caught.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_the_page_has_a_row_for_each_case():
    table = PAGE.read_text(encoding="utf-8").partition("## The bridge and the gears")[0]
    rows = re.findall(r"^\| (.+?) \| \d", table, re.MULTILINE)
    assert rows == [case.name for case in disturbances.CASES]
