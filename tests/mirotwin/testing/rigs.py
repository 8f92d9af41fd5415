"""A rig as the fixtures make it, for tests in this process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mirotwin.testing.rig import Rig
from mirotwin.verify.rig_options import marker_options, rig_options

HERE = Path(__file__).parent


def rig(seed: int = 0, **keys: Any) -> Rig:
    return Rig(rig_options(marker_options([((), keys)]), HERE, None, seed))
