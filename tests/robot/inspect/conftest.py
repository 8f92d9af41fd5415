"""A program built once for all tests of this folder."""

import pytest

from tests.robot.inspect.programs import build


@pytest.fixture(scope="session")
def program(tmp_path_factory):
    return build(tmp_path_factory.mktemp("program"))
