"""The page that a failed test leaves behind: its run, made again from all that went into its world.

There is none where Bokeh is not installed, where the test wrote into a robot's memory, which nobody can do again, and
where the run cannot be made again: a report of a failure does not fail.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import tomli_w

from miro_sim.world.world import World
from mirotwin.firmware.coverage_files import source_folders
from mirotwin.report.page.bokeh_page import has_bokeh
from mirotwin.report.page.document import MOST_BYTES
from mirotwin.report.page.reproduction import reproduce
from mirotwin.report.page.run_page import Material, PageHeader, run_page
from mirotwin.testing.rig import Rig
from mirotwin.testing.waiting import WaitFailed
from mirotwin.verify.cases.case import tables_of
from mirotwin.verify.checks.expect import expectations_of


def page_of(
    rig: Rig, name: str, caught: BaseException | None, text: str, again: Sequence[str]
) -> bytes | None:
    """The page; None where there is none. `text`: the story of the failure, `again`: commands that give it again."""
    if rig.written or not has_bokeh():
        return None
    try:
        page = run_page(_material(rig, name, caught, text, again))
    except ValueError:  # what its own parts raise, too
        return None
    return page if len(page) <= MOST_BYTES else None


def _material(rig: Rig, name: str, caught: BaseException | None, text: str, again: Sequence[str]) -> Material:
    wanted = rig.wanted
    scenario = wanted.scenario
    expected = dict(wanted.expected)
    if isinstance(caught, WaitFailed) and caught.expect is not None:
        waited = msgspec.structs.replace(scenario, expect=dict(caught.expect))
        for place, checks in expectations_of(waited, scenario.name).items():
            known = [check.name for check in expected.get(place, ())]
            expected[place] = [*expected.get(place, ()), *(one for one in checks if one.name not in known)]
    world = World(scenario, wanted.seed, wanted.image, rig.trace.script())
    done = reproduce(world, rig.tick, expected)
    return Material(
        about=PageHeader(
            kind="failed test",
            file=name,
            name=name,
            seed=wanted.seed,
            firmware=wanted.image.path.name,
            firmware_sha256=wanted.image.sha256 or "",
            report=text,
            again=again,
            verdict="failed",
        ),
        scenario=scenario,
        scenario_text=tomli_w.dumps(tables_of(scenario)),
        periods=done.periods,
        again=done,
        sources=source_folders(wanted.image),
    )
