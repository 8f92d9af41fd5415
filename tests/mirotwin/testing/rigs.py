"""A rig as the fixtures make it, for tests in this process."""

from pathlib import Path

from mirotwin.testing.rig import Rig
from mirotwin.verify.rig_options import marker_options, rig_options

HERE = Path(__file__).parent


def rig(seed=0, **keys):
    return Rig(rig_options(marker_options([((), keys)]), HERE, None, seed))
