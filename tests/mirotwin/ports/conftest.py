"""What the tests of plugs get: the command line in this process, and a world with ports."""

import pytest

from tests.mirotwin.conftest import mirotwin
from tests.mirotwin.ports.ports import Rig

__all__ = ["mirotwin", "rig"]


@pytest.fixture
def rig():
    found = Rig()
    yield found
    found.close()
