"""Cases of a bare processor: finds as files, and run again.

    # mirotwin stream 2
    #: firmware_sha256 = ".."
    #: verdict = "no_fault: tick 368772 (33.346 ms): firmware executed outside the loaded image at 0x03c0, .."
    #: end_tick = 368772
    #:
    #: [bare]
    #: crystal_hz = 11059200
    #: bit_ticks = 576
    #: begin_tick = 9840
    #:
    #: [expect]
    #: no_fault = true
    11040 > c0 03 c0 ..

A case names its check and never the file that holds it: what is played again must not choose which program is run.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.installed import entries_of
from miro_protocol import stream
from miro_protocol.actions import ScriptItem
from miro_protocol.toml_text import TomlError, struct_of
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.image import SPACE_BYTES, Image
from mirotwin.runs.result import Result, result_of_case
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.verdicts import Verdict
from mirotwin.verify.bare.exchange import (
    GROUP,
    NEVER_SLEEPS,
    NO_FAULT,
    OPTION,
    OWN,
    NamedCheck,
    check_named,
    installed_check,
    installed_entry,
)
from mirotwin.verify.bare.machine import BareLine
from mirotwin.verify.bare.run import BarePlayback
from mirotwin.verify.cases.case import stream_text
from mirotwin.verify.checks.interface import Failure


class BareFailure(Failure, frozen=True, kw_only=True):
    """A check that failed on a bare processor."""

    crystal_hz: int

    def __str__(self) -> str:
        return f"{self.check}: tick {self.tick} ({self.tick * 1000 / self.crystal_hz:.3f} ms): {self.found}"


class BareRerun(msgspec.Struct, frozen=True):
    """A script played from power-on. `failure`: what its check said, None where it passed. `unjudged`: why the check
    had no occasion, "" where it had one.
    """

    image: Image
    line: BareLine
    script: Sequence[ScriptItem]
    end_tick: int
    failure: BareFailure | None
    unjudged: str = ""

    def verdict_on(self, name: str) -> Verdict:
        """That of its check."""
        return "failed" if self.failure is not None else "not judged" if self.unjudged else "passed"

    def case(self) -> str:
        """The case of the failure."""
        assert self.failure is not None
        end_tick = max(self.end_tick, self.failure.tick)
        return case_text(self.image, self.line, self.script, end_tick, self.failure)

    def stream(self) -> str:
        """The script as a stream that nothing is expected of."""
        return case_text(self.image, self.line, self.script, self.end_tick)


def rerun_bare(
    image: Image,
    line: BareLine,
    script: Sequence[ScriptItem],
    until_tick: int,
    name: str = NO_FAULT,
    check: NamedCheck | None = None,
    source: str = "",
) -> BareRerun:
    """Plays a script from power-on to `until_tick`, under the check `name`; a fault goes before what that says."""
    run = BarePlayback(image, line, script, until_tick, source).play()
    fault = run.processor.fault()
    what, unjudged, tick = "", "", 12 * run.processor.cpu.cycles
    if fault is not None:
        name, what, tick = NO_FAULT, str(fault), fault.tick
    elif name == NEVER_SLEEPS:
        what = "" if run.idle else "the firmware is awake long after the last character"
        unjudged = "" if run.sleeps else "the firmware does not sleep before the first character"
    elif check is not None and name == check.name:
        what = run.verdict(check)
    failure = BareFailure(
        check=name,
        network=0,
        slot=0,
        tick=tick,
        wanted=name,
        found=what,
        fault=name == NO_FAULT,
        crystal_hz=line.crystal_hz,
    )
    return BareRerun(image, line, script, until_tick, failure if what else None, unjudged)


def case_text(
    image: Image,
    line: BareLine,
    script: Sequence[ScriptItem],
    end_tick: int,
    failure: BareFailure | None = None,
) -> str:
    """The stream file; a case, if something failed."""
    expect = {} if failure is None else {"expect": {failure.check: True}}
    more = {"end_tick": end_tick, **expect, "bare": msgspec.to_builtins(line)}
    return stream_text(script, image, {}, str(failure or ""), more)


def load_case_firmware(path: str, firmware: str | None) -> Image:
    """The image that a case is run on. Raises BadInput where none is given."""
    if firmware is None:
        what = "is for a bare processor, which has no firmware of its own"
        raise BadInput(path, "", what, "give --firmware IMAGE.ihx")
    return load_firmware(firmware, SPACE_BYTES)


def check_of_case(path: str | Path) -> str:
    """The name of the check that a case is of."""
    return _name(stream.read(path))


def rerun_bare_case(path: str | Path, image: Image, check: str | None = None) -> tuple[BareRerun, Result]:
    """Plays a case on `image`, from power-on. `check`: FILE.py:FUNCTION, where the case names one that is in a file.

    Raises BadInput for what is no such case.
    """
    case = stream.read(path)
    name, line, header = _name(case), _line(case), case.header
    if name in OWN and header.expect:
        installed_entry(name)  # an error where an installed check has the name, too
    judge = None if name in OWN else _check(case, name, check)
    script = _heard(case)
    end_tick = header.end_tick or _end_tick(script, line)
    again = rerun_bare(image, line, script, end_tick, name, judge, case.source)
    changed = header.firmware_sha256 not in (None, image.sha256)
    failures = [] if again.failure is None else [again.failure]
    why = [f"expectation not judged: {name}: {again.unjudged}"] if again.unjudged else []
    return again, result_of_case(
        header.verdict or "", failures, changed, "not judged" if why else "passed", why
    )


AFTER_MS = 50
"""So long after the last character a stream that names no end ends: firmware may answer meanwhile, or do wrong."""


def after_ticks(line: BareLine) -> int:
    return line.crystal_hz * AFTER_MS // 1000


def _end_tick(script: Sequence[ScriptItem], line: BareLine) -> int:
    ends = [one.tick + (line.ticks(len(one.data)) if isinstance(one, Transmission) else 0) for one in script]
    return max(ends, default=line.begin_tick) + after_ticks(line)


def _name(case: stream.StreamFile) -> str:
    names = list(case.header.expect or {})
    if len(names) > 1:
        what = f"expects {', '.join(names)} of a bare processor"
        raise BadInput(case.source, "header: expect", what, "a case has one check")
    return names[0] if names else NO_FAULT


def _line(case: stream.StreamFile) -> BareLine:
    if case.header.bare is None:
        remedy = "`mirotwin replay` plays what is for the robot"
        raise BadInput(case.source, "header", "says nothing of a bare processor", remedy)
    try:
        line = struct_of(case.header.bare, BareLine)
    except TomlError as error:
        raise BadInput(case.source, f"header: bare.{error.place}", error.what, error.remedy) from None
    if not line.bit_ticks:
        raise BadInput(case.source, "header: bare", "says no bit_ticks", "give the length of a bit")
    return line


def _check(case: stream.StreamFile, name: str, given: str | None) -> NamedCheck:
    """The check that the case names: the one given on the command line, or one that is installed."""
    if given:
        if (found_name := given.rpartition(":")[2]) != name:
            what = f"is a case of the check {name!r}, and {OPTION} gives {found_name!r}"
            raise BadInput(case.source, "header: expect", what, f"give {name}")
        return check_named(given)
    if entries_of(GROUP, name):
        return installed_check(name)
    what = f"names the check {name!r}, which is not installed"
    own = name.isidentifier()
    remedy = f"give it: {OPTION} FILE.py:{name}" if own else "a case names a check, and never its file"
    raise BadInput(case.source, "header: expect", what, remedy)


def _heard(case: stream.StreamFile) -> list[ScriptItem]:
    return [
        one
        for one in case.script()
        if not isinstance(one, Transmission) or (one.direction == DOWN and one.network == 0)
    ]
