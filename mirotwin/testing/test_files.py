"""Runs scenario files and cases as tests.

A case passes if its failed check passes now, as it should on repaired firmware. If the check never applied, the case is
not judged: firmware that does nothing at all has repaired nothing. A stream without expectations is judged by the
always-on checks.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_robot.image import SPACE_BYTES
from mirotwin.runs.failure_place import located_in
from mirotwin.runs.job import load_stream
from mirotwin.runs.result import Line, Result
from mirotwin.runs.sanitized import Allowed, judged, line_of, sanitized
from mirotwin.runs.test_file import cannot_be_run, run_test
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.verdicts import judge
from mirotwin.testing.test_options import TestOptions
from mirotwin.verify.cases.case import SUFFIX as CASE_SUFFIX
from mirotwin.verify.cases.replay_line import debug_line, replay_line
from mirotwin.verify.expectations import as_settings, in_files


def run_sanitized(
    options: TestOptions, file: str, allowed: Sequence[Allowed]
) -> tuple[Result, list[Allowed], list[str]]:
    """The result with the sanitizer's findings, the allowed entries that were used, and notes on images that it cannot
    observe.
    """
    with sanitized() as watching:
        result = run_file(options, file)
        findings, stale = judged(watching.take(), allowed, options.sanitizer.kinds)
    lines: list[Line] = []
    for finding in findings:
        verdict, text = line_of(finding)
        lines.append((verdict, text))
        if line := options.debug_line_for(file, finding):
            lines.append((verdict, f"    {line}"))
    used = [entry for entry in allowed if entry not in stale]
    verdict = judge((result.verdict, *(verdict for verdict, _ in lines)))
    return (
        replace(result, verdict=verdict, verdict_lines=[*result.verdict_lines, *lines]),
        used,
        [*watching.unseen],
    )


def run_file(options: TestOptions, file: str) -> Result:
    """Runs a case, or a scenario in the twin or at a port."""
    return _run_case(options, file) if file.endswith(CASE_SUFFIX) else _run_scenario(options, file)


def _run_scenario(options: TestOptions, file: str) -> Result:
    """Runs a scenario file as a test: in the twin, or at a port."""
    again = partial(options.line_for, file)
    if options.firmware is not None:  # an image that no file can run on ends the command
        load_firmware(options.firmware, SPACE_BYTES)
    settings = (
        *options.plugins.settings(options.settings),
        *options.settings,
        *as_settings(options.expected),
    )
    result = run_test(file, options.firmware, options.seed, settings, options.artifacts, again, options.desk)
    return replace(result, again=result.again or again())


def _run_case(options: TestOptions, path: str) -> Result:
    """Runs one on --firmware; a case that cannot be run is a result, too."""
    expected: Sequence[str] = ()
    try:
        job = load_stream(path, options.firmware)
        own_files = in_files(options.expected)
        expected = [own_files[name] for name in job.spec.scenario.expect if name in own_files]
        result = located_in(job.spec, _as_test(path, job.judge_case()))
    except BadInput as error:
        result = cannot_be_run(path, error)
    again, at_failure = (
        line(path, options.firmware, expected=tuple(expected), plugins=options.plugins)
        for line in (replay_line, debug_line)
    )
    return replace(result, again=again, commands=(again, at_failure) if result.failures else ())


def _as_test(path: str, result: Result) -> Result:
    """The result of a case as a test: it passes if its check passes, on any firmware."""
    if result.verdict in ("passed", "differs"):
        notes: list[Line] = [("passed", text) for text in result.texts[1:]]
        return replace(result, path=path, verdict="passed", verdict_lines=notes)
    lines: list[Line] = [("failed", f"expectation failed: {failure}") for failure in result.failures]
    return replace(result, path=path, verdict_lines=lines or result.verdict_lines)
