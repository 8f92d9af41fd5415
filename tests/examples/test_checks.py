"""A check in a distribution of its own: installed by pip, named in a scenario and on the command line."""

import pytest

from tests.examples.rig import EXAMPLES, MIROTWIN, installed, run


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return installed("checks", tmp_path_factory.mktemp("site"))


def turning(site, out, *options):
    command = (MIROTWIN, "run", EXAMPLES / "checks/turning.toml", "-q", "--no-figure", "--out", out)
    done = run(site, *command, *options)
    return done.returncode, done.stderr


@pytest.mark.slow
def test_its_scenario_meets_it_and_a_tighter_one_fails(site, tmp_path):
    assert turning(site, tmp_path / "met") == (0, "")
    tighter = "network.robot.expect.turns_at_most_rad_s={limit_rad_s=0.05, from_s=0.5}"
    code, err = turning(site, tmp_path / "tighter", "--set", tighter)
    assert code == 1
    assert err.startswith("mirotwin: expectation failed: turns_at_most_rad_s: net0/robot0: tick ")
    assert "wanted at most 0.05 rad/s, found " in err


def test_without_the_distribution_its_key_is_refused(tmp_path):
    code, err = turning("", tmp_path / "refused")
    assert code == 2
    assert "turning.toml: expect.turns_at_most_rad_s: there is no such check; " in err
