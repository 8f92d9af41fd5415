"""A world with ports."""

import pytest

from tests.mirotwin.ports.rig import Rig


@pytest.fixture
def rig():
    found = Rig()
    yield found
    found.close()
