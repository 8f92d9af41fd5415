"""A stream that drives one robot of three."""

import pytest

from tests.mirotwin.desk.rig import stream_text


@pytest.fixture
def drive(tmp_path, monkeypatch):
    """A stream of 40 questions in an empty folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "drive.stream"
    path.write_text(stream_text(40))
    return path
