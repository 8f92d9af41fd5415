"""A check in a distribution of its own: installed by pip, named in a scenario and on the command line."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from tests import children

EXAMPLE = Path(__file__).parents[2] / "examples" / "checks"
PROGRAM = "from mirotwin.commands import main; main()"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder with the example as pip installs it."""
    folder = tmp_path_factory.mktemp("site")
    source = shutil.copytree(EXAMPLE, folder / "source")
    options = ["--quiet", "--no-index", "--no-build-isolation", "--no-deps", "--target", folder / "installed"]
    children.run([sys.executable, "-m", "pip", "install", *options, source], check=True)
    return folder / "installed"


def run(site, out, *options):
    paths = [str(site), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}
    command = [
        sys.executable,
        "-c",
        PROGRAM,
        "run",
        EXAMPLE / "turning.toml",
        "-q",
        "--no-figure",
        "--out",
        out,
    ]
    done = children.run([*command, *options], env=environment, capture_output=True, text=True, check=False)
    return done.returncode, done.stderr


@pytest.mark.slow
def test_its_scenario_meets_it_and_a_tighter_one_fails(site, tmp_path):
    assert run(site, tmp_path / "met") == (0, "")
    tighter = "network.robot.expect.turns_at_most_rad_s={limit_rad_s=0.05, from_s=0.5}"
    code, err = run(site, tmp_path / "tighter", "--set", tighter)
    assert code == 1
    assert err.startswith("mirotwin: expectation failed: turns_at_most_rad_s: net0/robot0: tick ")
    assert "wanted at most 0.05 rad/s, found " in err


def test_without_the_distribution_its_key_is_refused(tmp_path):
    code, err = run("", tmp_path / "refused")
    assert code == 2
    assert "turning.toml: expect.turns_at_most_rad_s: there is no such check; " in err
