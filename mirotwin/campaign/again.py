"""The command that makes one row of a campaign again.

Scenarios and images are named without their folders: they stand beside the campaign's file, or are the product's own.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from miro_sim.scenario.settings import EXPECT
from mirotwin.campaign.inline import inline
from mirotwin.campaign.results import ResultsInfo
from mirotwin.run.run_options import RunOptions


def arm_line(about: ResultsInfo, levels: Mapping[str, Any]) -> str:
    """`mirotwin run ..` with all that the levels of the factors set; "" for a file that does not say it."""
    if not about.scenario:
        return ""
    scenario, firmware, settings = about.scenario, about.firmware, list(about.settings)
    for name, known in zip(about.factors, about.levels, strict=True):
        level = next((one for one in known if one.value == levels[name]), None)
        if level is None:
            return ""
        scenario, firmware = level.scenario or scenario, level.firmware or firmware
        settings += level.settings
    expected = [one for one in settings if one.startswith(EXPECT)]
    return RunOptions(
        scenario=scenario,
        firmware=firmware or None,
        settings=tuple(one for one in settings if one not in expected),
        expected=tuple(one.removeprefix(EXPECT) for one in expected),
    ).command_line()


def drawn_words(about: ResultsInfo, row: Mapping[str, Any]) -> str:
    """What was drawn for a row, as words of that command."""
    words = [word for name in about.drawn for word in ("--set", f"{name}={inline(row[name])}")]
    return shlex.join(words)
