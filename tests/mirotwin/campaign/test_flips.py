"""Campaigns of bits that turn over: each is a run of its own, and falls into one class."""

import json

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from mirotwin.campaign.design import Level
from mirotwin.campaign.flips import CLASSES, flipped, variable_names
from mirotwin.campaign.plan import plan_of_levels

TEXT = 'scenario = "fig6"\nseeds = "3-4"\nset = { duration_s = 0.3 }\n'


def test_variables_have_the_names_of_the_debug_file():
    names = variable_names(load_hex(image_path()))
    assert {"motion:state", "last_left"} <= {*names.values()}


def test_flips_are_functions_of_their_number_alone():
    plan = plan_of_levels("it", [Level("fig6", scenario="fig6")], range(2))
    few, many = (flipped(plan, count).design.factors[-1].levels for count in (3, 5))
    assert many[:4] == few
    assert few[0].settings == ()
    assert few[1].settings[0].startswith("step=[{pause_ms=")


@pytest.mark.slow
def test_each_flip_falls_into_one_class_and_none_without_effect_fails_the_campaign(mirotwin, tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "c.toml").write_text(TEXT)
    mirotwin.succeeds(
        "campaign", "run", tmp_path / "c.toml", "--flips", "12", "--out", tmp_path / "c.parquet", "-q"
    )
    found = json.loads(mirotwin.succeeds("campaign", "show", tmp_path / "c.parquet", "--json"))["flips"]
    counted = [count for kinds in found.values() for count in kinds.values()]
    assert sum(counted) == 24
    assert {kind for kinds in found.values() for kind in kinds} <= {*CLASSES}
    assert {"no effect", "lies there"} <= {kind for kinds in found.values() for kind in kinds}
    assert "no effect" in mirotwin.succeeds("campaign", "show", tmp_path / "c.parquet")


def test_a_scenario_with_steps_has_its_faults_in_them(mirotwin, tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "c.toml").write_text(
        TEXT.replace("duration_s = 0.3", "duration_s = 0.3, step = [{ pause_ms = 5 }]")
    )
    assert "--flips: the scenario has steps" in mirotwin.refuses(
        "campaign", "run", tmp_path / "c.toml", "--flips", "2"
    )
