"""What the tests of pages share: recordings, the pages made of them, and a way to call the program in this process."""

import pytest
from click.testing import CliRunner

from mirotwin.commands import main

SEED = 3
TWO = """
name = "two"
duration_s = 0.5
[[network]]
[network.radio]
bit_error_rate = 1e-3
[[network.robot]]
slot = 0
reference.kind = "line"
[[network.robot]]
slot = 2
reference.kind = "arc"
"""


def called(*arguments):
    """Exit code and what stderr said. Anything but a clean exit fails the test."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stderr


@pytest.fixture(scope="session")
def mirotwin():
    return called


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pages")


@pytest.fixture(scope="session")
def fig6(folder):
    """The folder of a run of 1.5 s that does not settle in time."""
    out = folder / "fig6"
    options = ["--set", "duration_s=1.5", "--expect", "settles_within_s=0.4"]
    code, _ = called("run", "fig6", "--seed", SEED, *options, "--out", out, "--no-figure", "-q")
    assert code == 1
    return out


@pytest.fixture(scope="session")
def fig6_page(folder, fig6):
    page = folder / "fig6.html"
    assert called("report", fig6, "-o", page, "-q") == (0, "")
    return page


@pytest.fixture(scope="session")
def two(folder):
    """The folder of a run of two robots, with the camera's frames."""
    scenario = folder / "two.toml"
    scenario.write_text(TWO)
    out = folder / "two"
    assert called("run", scenario, "--out", out, "--record-frames", "--no-figure", "-q") == (0, "")
    return out
