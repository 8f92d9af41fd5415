"""Cases: what is left of a failure gives it again, to the tick."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_protocol import stream
from miro_protocol.frames import encode
from miro_sim.scenario.file import load, of_table
from miro_sim.scenario.keys import without_expectations
from miro_sim.world import conditions
from miro_sim.world.waits import WaitExpired
from mirotwin.verify.cases.case import Trace, case_of_checks, case_text, tables_of, write_case
from mirotwin.verify.checks.happens import expect_of
from tests.mirotwin import program
from tests.mirotwin.verify.checks.rig import MS, needs_sdcc, own_image, planted, silent_world, team
from tests.mirotwin.verify.checks.test_planted import ALL


@pytest.mark.parametrize("name", ["fig6", "fig9", "waypoints", "sine"])
def test_a_scenario_comes_back_from_its_tables(name):
    scenario = load(name, ["expect.inside_pitch=true"]).scenario
    assert of_table(tables_of(scenario), name) == without_expectations(scenario)


def failing(tmp_path, expect="failsafe_stop_ms = 100.0"):
    """A case of the shipped firmware, of which something else is expected than it does."""
    world, checks = silent_world(expect)
    trace = Trace(world)
    world.run_to(60 * MS)
    world.inject(encode(team(1, 900, 900, ask=True), 3))
    world.run_to(world.tick + 30 * MS)
    world.set_radio("noise")
    world.run_to(300 * MS + 1234)
    checks.finish()
    write_case(tmp_path / "a.stream", case_of_checks(world, trace, checks))
    return tmp_path / "a.stream"


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_a_case_gives_the_same_line_and_exit_code_on_any_engine(tmp_path, engine):
    path = failing(tmp_path)
    verdict = stream.read(path).header.verdict
    found = program.run("replay", path, "-q", "--engine", engine)
    assert (found.returncode, found.stderr) == (1, f"mirotwin: fails as recorded: {verdict}\n")


def test_settings_that_cure_it_are_told(mirotwin, tmp_path):
    path = failing(tmp_path)
    out = mirotwin.succeeds("replay", path, "-q", "--expect", "failsafe_stop_ms=110.0")
    assert out.startswith("cured: failsafe_stop_ms passes; recorded: failsafe_stop_ms: net0/robot1: tick ")
    err = mirotwin.ends(1, "replay", path, "-q", "--expect", "failsafe_stop_ms=90.0")
    assert "still fails, but not as recorded: failsafe_stop_ms: net0/robot1: " in err


def test_a_case_that_does_not_fail_again_is_a_difference(mirotwin, tmp_path):
    path = failing(tmp_path)
    path.write_text(path.read_text().replace("after_ms = 100.0", "after_ms = 110.0"))
    assert "not reproduced: failsafe_stop_ms passes" in mirotwin.ends(4, "replay", path, "-q")


def test_a_case_that_has_no_occasion_any_more_does_not_count_as_cured(mirotwin, tmp_path):
    path = failing(tmp_path)
    text = "".join(line for line in path.read_text().splitlines(True) if " > " not in line)
    path.write_text(text)
    assert "not judged" in mirotwin.ends(1, "replay", path, "-q")
    assert "not judged" in mirotwin("debug", path, "-x", "where")[1]


@needs_sdcc
def test_a_case_of_planted_firmware_is_cured_by_the_shipped_one(mirotwin, tmp_path):
    image = planted("stops 15 ms late")
    world, checks = silent_world("failsafe_stop_ms = true", image)
    trace = Trace(world)
    world.run_to(60 * MS)
    world.inject(encode(team(1, 900, 900), 3))
    world.run_to(400 * MS)
    checks.finish()
    path = tmp_path / "late.stream"
    write_case(path, case_of_checks(world, trace, checks))
    assert "name the image with --firmware" in mirotwin.ends(2, "replay", path, "-q")
    code, _, err = mirotwin("replay", path, "-q", "--firmware", image.path)
    assert (code, err.count("fails as recorded: failsafe_stop_ms")) == (1, 1)
    code, out, _ = mirotwin("replay", path, "-q", "--firmware", own_image().path)
    assert (code, out.startswith("cured: ")) == (0, True)


def test_a_wait_that_was_in_vain_is_judged_again(mirotwin, tmp_path):
    world, _ = silent_world("")
    trace = Trace(world)
    world.run_to(60 * MS)
    with pytest.raises(WaitExpired) as caught:
        world.run_until(conditions.Answer(slot=1), within=50 * MS)
    expect = expect_of("happens", caught.value.conditions[0], 60 * MS, world.tick)
    given = {"condition": {"event": "answer", "slot": 1}, "after_tick": 60 * MS, "until_tick": 110 * MS}
    assert expect == {"happens": given}
    line = "happens: net0/robot1: tick 2640000 (110.000 ms): wanted answer with slot = 1 within 50.000 ms, found none"
    write_case(tmp_path / "a.stream", case_text(world, trace, expect, line))
    code, _, err = mirotwin("replay", tmp_path / "a.stream", "-q")
    assert (code, err) == (1, f"mirotwin: fails as recorded: {line}\n")


def test_an_event_that_must_not_come_is_judged_again(mirotwin, tmp_path):
    world, _ = silent_world("")
    trace = Trace(world)
    world.run_to(60 * MS)
    world.inject(encode(team(1, 900, 900, ask=True), 3))
    heard = world.run_until(conditions.Heard(), within=80 * MS)
    expect = expect_of("never_happens", conditions.Heard(), 60 * MS, 140 * MS)
    write_case(tmp_path / "a.stream", case_text(world, trace, expect, "never_happens: of old"))
    err = mirotwin.ends(1, "replay", tmp_path / "a.stream", "-q")
    assert f"never_happens: net0/robot1: tick {heard.tick} " in err


@pytest.mark.parametrize(
    "condition", [conditions.When(predicate=bool), conditions.Edge(pin="rxd"), conditions.Reached(address=3)]
)
def test_waits_that_only_their_program_can_judge_make_no_check(condition):
    assert expect_of("never_happens", condition, 0, 1) is None


@settings(max_examples=20)
@given(st.data())
def test_a_trace_knows_what_happened_wherever_the_world_stands(data):
    world, _ = silent_world(ALL)
    trace = Trace(world)
    sent = []
    for seq in range(4):
        world.run_to(world.tick + data.draw(st.integers(1, 60 * MS)))
        sent.append(world.inject(encode(team(seq, 1, 1), 3)))
        if data.draw(st.booleans()):
            sent.append(world.set_reset(0, slot=1))
    world.run_to(max(sent) + 40 * MS)
    assert [one.tick for one in trace.script()] == sorted(sent)


def test_a_world_that_has_moved_has_no_trace():
    world, _ = silent_world("")
    world.run_to(1)
    with pytest.raises(ValueError, match="the world is at tick 1: what happened before is not known"):
        Trace(world)


def test_a_verdict_of_a_check_that_nothing_expects_is_refused(mirotwin, tmp_path):
    path = failing(tmp_path)
    path.write_text(path.read_text().replace("[expect.failsafe_stop_ms]", "[expect.motors_off_ms]"))
    for command in (("replay", path, "-q"), ("debug", path, "-x", "where")):
        err = mirotwin.refuses(*command)
        assert "the verdict is of the check 'failsafe_stop_ms', which nothing expects" in err


def test_a_case_ends_where_it_failed_whatever_the_duration_of_its_scenario(mirotwin, tmp_path):
    err = mirotwin.ends(1, "replay", failing(tmp_path), "-q", "--set", "duration_s=0.25")
    assert "fails as recorded: failsafe_stop_ms" in err
