"""A run from its spec to its result: the same bits, one verdict, the same lines, a case that says it again."""

import io

import msgspec
import pytest

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol import stream
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.file import of_text
from mirotwin.recording.reader import parse
from mirotwin.recording.recorder import source_of
from mirotwin.recording.track import Tracks
from mirotwin.runs.job import load_job
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec, silent_scenario
from mirotwin.shell.verdicts import VERDICTS
from mirotwin.verify.steps.reading import steps_in
from tests.mirotwin.conform.images import FAULTS, image_of
from tests.mirotwin.verify.checks.rig import own_image

FRAME = Transmission(10 * CONTROL_PERIOD_TICKS, DOWN, encode(TeamFrame(0, 0, ((9, 9),) * 3), 3))
TEXT = """
scenario = "silent"
set = { duration_s = 0.1, stop_on_fault = false }
expect.happens = { condition = { event = "answer" }, until_tick = 2000000 }
step = [{ wait_for = "answer", within_ms = 5.0 }]
"""


def spec(*settings, expect=None, image=None, **more):
    scenario = silent_scenario(("duration_s=0.5", *settings))
    scenario = msgspec.structs.replace(scenario, expect=expect or {})
    return RunSpec(scenario=scenario, image=image or own_image(), **more)


def test_a_spec_gives_the_same_bits_stepped_played_and_recorded():
    stepped, played, recorded = (Run(spec(script=[FRAME])) for _ in range(3))
    stepped.drive()
    played.play()
    stream, text = io.BytesIO(), of_text('scenario = "silent"\nset = { duration_s = 0.5 }\n', "mine")
    recorded.record(stream, source_of(text, recorded.world), Tracks())
    digests = {run.world.digest for run in (stepped, played, recorded)}
    assert digests == {parse(stream.getvalue(), "mine").digest}


def test_a_run_says_steps_checks_and_faults_in_this_order_and_lists_faults_first():
    text = of_text(TEXT, "mine")
    run = Run(msgspec.structs.replace(RunSpec.of(text, image_of(FAULTS)), steps=steps_in(text)))
    run.drive()
    run.finish()
    result = run.result()
    kinds = [text.partition(":")[0] for text in result.texts]
    assert kinds == ["step failed", "expectation failed", "firmware fault"]
    assert [line.partition(":")[0] for line in result.lines] == [kinds[2], *kinds[:2]]
    assert (result.verdict, result.code, result.notes) == ("fault", VERDICTS["fault"].code, ())


def test_several_faults_of_a_robot_are_one_line():
    run = Run(spec("stop_on_fault=false", image=image_of(FAULTS), until_tick=CONTROL_PERIOD_TICKS)).play()
    (line,) = (text for verdict, text in run.result().verdict_lines if verdict == "fault")
    assert line.endswith(" more)")


def test_what_a_traced_run_has_failed_fails_again_from_its_file(tmp_path):
    run = Run.traced(spec(script=[FRAME], expect={"frames_accepted_min": 2})).play()
    path = tmp_path / "case.stream"
    path.write_text(run.case())
    result = load_job(str(path)).judge_case()
    assert result.texts == (f"fails as recorded: {run.failure}",)
    assert (result.code, result.digest) == (run.result().code, run.result().digest)


def test_a_stream_of_a_run_expects_nothing(tmp_path):
    run = Run.traced(spec(script=[FRAME], expect={"frames_accepted_min": 2})).play()
    header = stream.decode(run.stream().encode(), "mine").header
    assert (header.verdict, header.expect) == (None, {})


def test_a_run_that_goes_on_from_a_saved_world_is_no_case():
    first = Run(spec(until_tick=CONTROL_PERIOD_TICKS)).play()
    later = Run.traced(spec(resumed=first.world.save(), script=()))
    assert later.trace is None
    later.play()
    whole = Run(spec()).play()
    assert later.world.digest == whole.world.digest


def test_a_saved_world_of_another_seed_is_refused():
    saved = Run(spec(seed=1, until_tick=CONTROL_PERIOD_TICKS)).play().world.save()
    with pytest.raises(BadInput, match="the recorded run was resumed"):
        spec(seed=2, resumed=saved).world()


def test_a_check_that_a_run_did_not_have_makes_a_case_of_it_only_where_it_fails():
    run = Run.traced(spec(script=[FRAME])).play()
    assert run.case_of_expect({"frames_accepted_min": 1}) is None
    assert 'verdict = "frames_accepted_min: ' in run.case_of_expect({"frames_accepted_min": 2})
