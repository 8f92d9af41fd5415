"""What the tests of campaigns share: the results of the short one."""

import pytest

from mirotwin import campaign
from tests.mirotwin.campaign.plans import InThisProcess, plan_of


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """The results of SHORT, made in this process."""
    path = tmp_path_factory.mktemp("alone") / "short.parquet"
    campaign.run(plan_of(), path, InThisProcess())
    return path
