"""Two teams that drive among each other: nobody is taken for somebody else."""

import random

import pytest

from miro_exact import engine
from miro_sim.pitch.picture_settings import PictureSettings
from tests.sim.pitch.crowd import Crowd

pytestmark = pytest.mark.skipif(engine.active() != "compiled", reason="takes minutes uncompiled")


@pytest.mark.parametrize(("centroid", "dropped", "mains_hz"), [("binary", 0.0, 60), ("weighted", 0.05, 50)])
def test_in_a_crowd_no_robot_is_swapped_or_wrong_and_few_are_lost(centroid, dropped, mains_hz):
    crowd = Crowd(7, PictureSettings(mains_hz=mains_hz), centroid)
    drops = random.Random(8)
    for frame in range(1, 401):
        crowd.step(frame, drops.random() < dropped)
    counts = crowd.counts
    assert counts.together > 100
    assert counts.fastest_m_s > 1.3
    assert (counts.swapped, counts.wrong) == (0, 0), counts.wrong_at
    assert counts.seen > 0.99 * (counts.seen + counts.lost) > 2000
