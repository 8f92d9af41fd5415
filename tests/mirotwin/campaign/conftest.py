"""Campaigns that the tests run: short ones."""

from concurrent.futures import Executor, Future

import pytest

from mirotwin import campaign

SHORT = """
scenario = "fig7"
seeds = "3-5"
set = { duration_s = 0.3 }

[grid]
network.radio.bit_error_rate = [0.0, 1e-2]
"""


def plan_of(text=SHORT, path="short.toml"):
    return campaign.parse(text, path)


def rows(path):
    """The rows of results, as dictionaries."""
    return campaign.read(path)[0].to_pylist()


class InThisProcess(Executor):
    """Runs a job when it is handed over."""

    def submit(self, function, /, *arguments, **named):
        future = Future()
        future.set_result(function(*arguments, **named))
        return future


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """The results of SHORT, made in this process."""
    path = tmp_path_factory.mktemp("alone") / "short.parquet"
    campaign.run(plan_of(), path, InThisProcess())
    return path
