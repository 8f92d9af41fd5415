"""Firmwares that differ from the robot's own in one place."""

import pytest

from tests.mirotwin.replay.rig import BUILDS, built


@pytest.fixture(scope="session")
def images(tmp_path_factory):
    """By name; the sources lie in `firmware` beside the folder of each."""
    return {name: built(tmp_path_factory.mktemp("build"), name) for name in BUILDS}
