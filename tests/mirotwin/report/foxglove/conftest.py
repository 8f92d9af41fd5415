"""One recording of two teams for all tests here."""

import pytest

from tests.mirotwin.report.foxglove import rig


@pytest.fixture(scope="session")
def recording(mirotwin, tmp_path_factory):
    """The two teams, 36 control periods, with frames."""
    return rig.teams(tmp_path_factory.mktemp("teams"), mirotwin)


@pytest.fixture(scope="session")
def shown(recording):
    """All messages of its export."""
    return rig.read(rig.exported(recording)[0])
