"""A few of the sessions that `python -m tests.mirotwin.ports.sessions` runs by the dozen."""

import pytest

from tests.mirotwin.ports import sessions


@pytest.mark.slow
def test_live_sessions_under_load_replay_to_their_own_digests(tmp_path):
    with sessions.load(1):
        for seed in (0, 1):
            periods, _ = sessions.session(seed, tmp_path)
            assert periods > 10
