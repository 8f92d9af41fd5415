"""What the tests of plugs get: the command line in this process, and a world with ports."""

from collections.abc import Iterator

import pytest
from tests.mirotwin.bridges.ports import Rig
from tests.mirotwin.cli.conftest import mirotwin

__all__ = ["mirotwin", "rig"]


@pytest.fixture
def rig() -> Iterator[Rig]:
    found = Rig()
    yield found
    found.close()
