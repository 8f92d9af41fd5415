"""A campaign with plug-ins of other distributions: their sources belong to its results as our own do."""

import sys

import pytest

from miro_exact.bad_input import BadInput
from mirotwin import campaign
from mirotwin.campaign.journal import journal_path
from mirotwin.campaign.versions import versions_here
from mirotwin.campaign.workers import Processes
from tests.exact.distribution import install
from tests.host.test_plugins import GOOD
from tests.mirotwin.campaign.conftest import plan_of

pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")

STEADY = GOOD.replace('"steady"', '"edited"').replace(
    "Velocities(self.", "Velocities(plug_scale.SCALE * self."
)
CHECK = """
from typing import ClassVar
from mirotwin.verify.checks.interface import Check, Monitor

class Always(Check, frozen=True, kw_only=True, tag="always_fine"):
    KIND: ClassVar = "safety"

    def monitor(self, subject):
        return Fine(self, subject)

class Fine(Monitor):
    def period(self, record, tick):
        self.judged += 1
"""
SHORT = """
scenario = "fig7"
seeds = "0-3"
set = { duration_s = 0.2 }

[factor.law]
paper = []
edited = ["network.robot.controller={law = 'edited'}"]
"""


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder on the path with two distributions."""
    site = tmp_path / "site"
    monkeypatch.syspath_prepend(str(site))
    modules = {"plug_edited": f"import plug_scale\n{STEADY}", "plug_scale": "SCALE = 1.0\n"}
    install(site, "edited-law", "1.0", {"edited": "plug_edited:Parameters"}, **modules)
    (site / "edited_law-1.0.dist-info" / "top_level.txt").write_text("plug_edited\nplug_scale\n")
    install(site, "fine-check", "1.0", {"always_fine": "plug_fine:Always"}, "checks", plug_fine=CHECK)
    yield site
    for name in [name for name in sys.modules if name.startswith("plug_")]:
        del sys.modules[name]


class Interrupted(Exception):
    pass


def interrupt(tally, outcome):
    raise Interrupted


def test_results_of_a_law_that_was_edited_are_those_of_another_campaign(site, tmp_path):
    path = tmp_path / "short.parquet"
    assert campaign.run(plan_of(SHORT), path, Processes(1)).new == 8
    assert campaign.run(plan_of(SHORT), path, Processes(1)).new == 0
    before = path.read_bytes()
    (site / "plug_scale.py").write_text("SCALE = 0.25\n")  # a module that the law imports
    with pytest.raises(
        BadInput, match=r"law edited of edited-law 1.0, sources \w+ instead of edited-law 1.0, sources"
    ):
        campaign.run(plan_of(SHORT), path, Processes(1))
    assert path.read_bytes() == before
    campaign.run(plan_of(SHORT), path, Processes(1), force=True)
    (old, new) = (
        [row["digest"] for row in campaign.read(one)[0].to_pylist()] for one in (copy(before, tmp_path), path)
    )
    assert old[:4] == new[:4]
    assert not set(old[4:]) & set(new[4:])


def copy(content, folder):
    path = folder / "before.parquet"
    path.write_bytes(content)
    return path


def test_a_campaign_that_was_broken_off_does_not_go_on_with_another_law(site, tmp_path):
    path = tmp_path / "short.parquet"
    with pytest.raises(Interrupted):
        campaign.run(plan_of(SHORT), path, Processes(1), on_outcome=interrupt)
    left = journal_path(path).read_bytes()
    (site / "plug_edited.py").write_text(STEADY.replace("plug_scale.SCALE", "2.0"))
    with pytest.raises(
        BadInput, match=r"unfinished results of another campaign: law edited of edited-law 1.0"
    ):
        campaign.run(plan_of(SHORT), path, Processes(1))
    assert journal_path(path).read_bytes() == left


def test_the_sources_of_a_check_belong_to_the_results_too(site):
    with_check = SHORT + "[expect]\nalways_fine = true\n"
    before = plan_of(with_check).head
    (site / "plug_fine.py").write_text(CHECK + "# edited\n")
    assert "check always_fine of fine-check 1.0" in before.difference(plan_of(with_check).head)


def test_plug_ins_that_no_run_uses_do_not_matter(site):
    without = SHORT.partition("[factor")[0]
    before = plan_of(without).head
    (site / "plug_edited.py").write_text("raise RuntimeError('half edited')\n")
    assert before.difference(plan_of(without).head) == ""


def test_a_worker_whose_plug_in_is_another_one_is_refused(site, tmp_path, monkeypatch):
    """As on another machine, or where a file was saved between the plan and the first run."""
    plan = plan_of(SHORT)
    (site / "plug_scale.py").write_text("SCALE = 0.5\n")
    with pytest.raises(
        BadInput, match=r"worker .* has law edited of edited-law 1.0, sources \w+ instead of edited"
    ):
        campaign.run(plan, tmp_path / "short.parquet", Processes(1))


def test_a_worker_that_lacks_the_plug_in_says_so(site, monkeypatch):
    wanted = plan_of(SHORT).versions
    absent = wanted.parts[0].replace("law edited", "law absent")
    asked = type(wanted)(wanted.mirotwin, wanted.code, (absent,))
    assert asked.difference(versions_here(asked)).startswith(
        "law absent of no distribution instead of edited-law 1.0"
    )
