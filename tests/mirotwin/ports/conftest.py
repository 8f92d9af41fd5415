"""What the tests of plugs get: the command line in this process, and a world with ports."""

import pytest

from tests.mirotwin.ports.ports import Rig


@pytest.fixture
def rig():
    found = Rig()
    yield found
    found.close()
