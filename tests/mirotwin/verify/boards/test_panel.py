"""Scenario files of a board as tests: steps, checks, their verdicts and the cases that they leave."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from miro_exact.bad_input import BadInput
from miro_exact.clock import ms
from miro_sim.scenario.board import BoardScenario
from miro_sim.scenario.board_scenario import load_any
from miro_sim.world.conditions import CONDITIONS
from mirotwin.runs.run import Run
from mirotwin.runs.spec import RunSpec
from mirotwin.runs.test_file import run_test
from mirotwin.testing.test_files import run_file
from mirotwin.testing.test_options import TestOptions
from mirotwin.verify.checks.expect import expectations_of
from mirotwin.verify.steps.keys import VERBS
from mirotwin.verify.steps.reading import steps_in, steps_of
from tests.mirotwin.verify.boards.panel import DEAF, PROGRAM, SLOW, STARVES, built, panel, project
from tests.mirotwin.verify.steps.rig import scenario_of
from tests.mutants.sdcc import needs_sdcc

pytestmark = needs_sdcc
CRYSTAL_HZ = 11_059_200
ALL = """
{ wait_for = "text", text = "ready\\r\\n", within_ms = 100 },
{ wait_for = "pulse", pin = "lamp.pin", level = 0, at_least_us = 51e3, at_most_us = 53e3, within_ms = 200 },
{ send = "text", text = "?" },
{ expect = "text", pattern = 'count \\d+', within_ms = 20 },
{ press = "key", for_ms = 30 },
{ wait_for = "text", text = "k1", within_ms = 20 },
{ wait_for = "value", of = "lamp.on", equals = true, within_ms = 110 },
{ wait_for = "frequency", pin = "P2.0", at_least_hz = 90, at_most_hz = 101, within_ms = 200 },
{ hold = "duty", pin = "P2.0", at_least = 0.25, at_most = 0.35, for_ms = 100 },
{ hold = "frequency", pin = "P2.0", at_least_hz = 90, for_ms = 50 },
{ send = "text", text = "sgs", gap_ms = 50 },
{ pause_ms = 110 },
{ wait_for = "level", pin = "P2.0", level = 0, steady_ms = 30, within_ms = 200 },
{ hold = "level", pin = "P2.0", level = 0, for_ms = 50 },
{ never = "text", text = "count", for_ms = 100 },
{ never = "pulse", pin = "P2.0", for_ms = 50 },
{ send = "bytes", hex = "3f 0d", gap_ms = 2 },
{ wait_for = "text", text = "count", within_ms = 20 },
{ pause_ms = 10 },
{ put = { key.pressed = true } },
{ expect = "text", text = "k2", within_ms = 10 },
{ hold = "value", of = "key.closed", equals = true, for_ms = 20 },
{ reset = 1 }, { pause_ms = 1 }, { reset = 0 },
{ wait_for = "text", text = "ready", within_ms = 100, from_now = true },
{ power = "off" }, { silence_for_ms = 50 }, { power = "on" },
{ wait_for = "text", text = "ready", within_ms = 100 },
"""


def outcome(tmp_path, steps="", expect="", program=PROGRAM, **options):
    return run_test(str(project(tmp_path, steps, expect, program)), **options)


def test_all_that_steps_can_do_with_a_board(tmp_path):
    path = project(tmp_path, ALL, duration_s=3)
    results = [run_test(str(path)) for _ in range(2)]
    assert (results[0].verdict, results[0].lines) == ("passed", ())
    assert results[0].done == results[0].steps == 30
    assert results[0].digest == results[1].digest


def test_a_run_with_steps_is_the_run_in_which_a_script_does_the_same(tmp_path):
    text = load_any(str(project(tmp_path, ALL, duration_s=3)))
    image = built(PROGRAM)[0]
    steps = Run.traced(RunSpec(scenario=text.scenario, image=image, steps=steps_in(text)))
    steps.drive()
    steps.finish()
    assert steps.trace is not None
    scenario = replace(text.scenario, step=(), bit_ticks=steps.world.lines[0].bit_ticks)
    script = Run(RunSpec(scenario=scenario, image=image, script=steps.trace.script()))
    script.drive()
    assert script.world.lines[0].board.cpu.cycles == steps.world.lines[0].board.cpu.cycles
    assert script.world.lines[0].transmissions == steps.world.lines[0].transmissions
    assert script.world.digest == steps.world.digest


READY = '{ wait_for = "text", text = "ready", within_ms = 100 },\n'
FAILS = {
    '{ wait_for = "pulse", pin = "lamp.pin", at_least_us = 6e4, within_ms = 300 }': (
        r"wanted pulse with pin = \"lamp.pin\", .* within 300 ms, found lamp.pin: \d pulses, the last 52\d+ us at"
    ),
    '{ wait_for = "frequency", pin = "P2.0", at_least_hz = 200, within_ms = 50 }': (
        "found P2.0: [45] periods, the last 95.[0-9]* Hz at"
    ),
    '{ expect = "frequency", pin = "P2.0", at_least_hz = 200, within_ms = 50 }': (
        "found frequency P2.0, 95.[0-9]* Hz"
    ),
    '{ wait_for = "text", text = "count", within_ms = 50 }': r"found 2 characters: '\\r\\n'",
    '{ wait_for = "value", of = "key.pressed", equals = true, within_ms = 50 }': (
        "within 50 ms, found key.pressed = false"
    ),
    '{ wait_for = "level", pin = "P2.0", level = 1, steady_ms = 9, within_ms = 50 }': (
        "found P2.0: it is at [01], and at 1 for 3.1[0-9]* ms at most"
    ),
    '{ hold = "duty", pin = "P2.0", at_least = 0.5, for_ms = 100 }': "found duty P2.0, 0.[0-9]* high",
    '{ hold = "frequency", pin = "P0.0", at_least_hz = 10, for_ms = 300 }': "found frequency P0.0, 0 Hz",
    '{ hold = "value", of = "lamp.on", equals = false, for_ms = 300 }': "found value lamp.on = 1",
    '{ hold = "level", pin = "BLINK", level = 1, for_ms = 300 }': "for 300 ms, found level BLINK",
    '{ never = "edge", pin = "BLINK", for_ms = 300 }': "wanted no edge with pin = .* found edge BLINK to [01]",
    '{ never = "text", text = "\\n", for_ms = 300 }': r"found text '\\n'",
}


@pytest.mark.parametrize(
    "step",
    [
        '{ hold = "frequency", pin = "P0.0", at_most_hz = 10, for_ms = 300 }',
        '{ hold = "duty", pin = "P0.0", at_least = 0.4, for_ms = 100 }',
    ],
)
def test_a_pin_that_stands_does_not_hold_a_duty_or_a_frequency(step, tmp_path):
    result = outcome(tmp_path, READY + step)
    assert result.verdict == "failed"
    assert "found P0.0: no period" in result.lines[0]


@pytest.mark.parametrize("verb", ['{ hold = "value", ', '{ never = "value", outside = true, '])
def test_what_is_put_holds_from_then_on(verb, tmp_path):
    put = "{ put = { key.pressed = true } },"
    result = outcome(tmp_path, READY + put + verb + 'of = "key.pressed", equals = true, for_ms = 1 }')
    assert result.verdict == "passed", result.lines


@pytest.mark.parametrize("step", FAILS)
def test_a_step_that_fails_says_what_was_there_and_leaves_a_case_with_this_verdict(step, tmp_path):
    result = outcome(tmp_path, READY + step, artifacts=tmp_path / "left")
    assert result.verdict == "failed", result.verdict_lines
    assert re.search(FAILS[step], result.lines[0]), result.lines
    folder = tmp_path / "left"
    (case,) = folder.rglob("*.stream")
    if "expect =" in step:
        assert case.name == "sent.stream"  # another event came: no check says that
        return
    (image,) = folder.rglob("*.ihx")
    again = run_file(TestOptions(paths=(str(case),), firmware=str(image)), str(case))
    assert again.verdict == "failed"
    tick = re.search(r"tick \d+ \([0-9.]+ ms\)", result.lines[0])[0]
    assert tick in again.lines[0]


def test_a_case_of_a_wait_is_cured_by_firmware_that_does_it(tmp_path):
    steps = f'{READY}{{ send = "text", text = "?" }}, {{ wait_for = "text", text = "count", within_ms = 30 }}'
    result = outcome(tmp_path, steps, program=DEAF, artifacts=tmp_path / "left")
    assert result.verdict == "failed"
    (case,) = (tmp_path / "left").rglob("case.stream")
    (tmp_path / "mended.ihx").write_text(built(PROGRAM)[1])
    options = TestOptions(paths=(str(case),), firmware=str(tmp_path / "mended.ihx"))
    assert run_file(options, str(case)).verdict == "passed"


PASS = [
    'pwm_at_least_hz = { "P2.0" = 90 }',
    'pwm_at_least_hz = { pins = { "P2.0" = 90, BLINK = 5 }, off_after_ms = 150 }',
    "one_driver = true",
    "main_loop_alive = true",
    "no_fault = true",
    "answers_within_ms = 15",
    'sends_text = "count 7"',
    'sends_text = { pattern = "re.dy", within_ms = 50 }',
    'value_at_most = { "lamp.on" = 1 }',
    'value_at_least = { "lamp.flashes" = 0 }',
    'happens = { condition = { event = "pulse", pin = "BLINK" }, until_tick = 3000000 }',
    'never_happens = { condition = { event = "text", text = "x" }, until_tick = 3000000 }',
]
ASKS = r'{ wait_for = "text", text = "ready\r\n" }, { send = "text", text = "?" },'


@pytest.mark.parametrize("expect", PASS)
def test_a_check_that_holds_has_passed(expect, tmp_path):
    result = outcome(tmp_path, ASKS, expect)
    assert (result.verdict, result.verdict_lines) == ("passed", [])


FAIL = {
    'pwm_at_least_hz = { "P2.0" = 90 }': (
        SLOW,
        r"pwm_at_least_hz: tick \d+ .* wanted PWM of P2.0 at 90 Hz or more, found a period of 47.",
    ),
    "main_loop_alive = true": (
        STARVES,
        "wanted a main loop that runs every 10 ms, found firmware starved its",
    ),
    "answers_within_ms = 15": (
        DEAF,
        "wanted an answer within 15 ms of the last character, found none to that of 9.",
    ),
    'sends_text = "count 7"': (
        DEAF,
        r"wanted text with text = \"count 7\" sent, found \d+ characters: 'ready\\r\\n",
    ),
    'value_at_most = { "lamp.flashes" = 3 }': (PROGRAM, r"wanted lamp.flashes at most 3, found 4"),
    'value_at_least = { "lamp.on" = 1 }': (PROGRAM, "wanted lamp.on at least 1, found 0"),
}


@pytest.mark.parametrize("expect", FAIL)
def test_a_check_that_fails_says_what_was_found_and_leaves_a_case(expect, tmp_path):
    program, line = FAIL[expect]
    steps = f'{ASKS} {{ pause_ms = 60 }}, {{ press = "key" }},'
    result = outcome(tmp_path, steps, expect, program, artifacts=tmp_path / "left")
    assert result.verdict == "failed"
    assert re.search(line, result.lines[0]), result.lines
    (case,) = (tmp_path / "left").rglob("case.stream")
    (image,) = (tmp_path / "left").rglob("*.ihx")
    again = run_file(TestOptions(paths=(str(case),), firmware=str(image)), str(case))
    assert (again.verdict, again.lines[:1]) == ("failed", result.lines[:1]), again.verdict_lines


def test_a_check_without_an_occasion_has_not_passed(tmp_path):
    for expect in ('pwm_at_least_hz = { "P0.0" = 90 }', "answers_within_ms = 15"):
        result = outcome(tmp_path, "", expect)
        assert result.verdict == "not judged"


@pytest.mark.parametrize(
    ("expect", "message"),
    [
        ('pwm_at_least_hz = { "P2.9" = 80 }', "pin: 'P2.9' is no pin"),
        ("pwm_at_least_hz = 80", "expect.pwm_at_least_hz"),
        ('value_at_most = { "lamp.no" = 1 }', "of: lamp.no: part 'lamp' (led) has no value 'no'; use on or"),
        ('sends_text = { pattern = "(" }', "pattern: '(' is no regular expression"),
        ('never_happens = { condition = { event = "edge", pin = "X" }, until_tick = 9 }', "'X' is no pin"),
        (
            'happens = { condition = { event = "value", of = "lamp.flashes", contains = "x" }, until_tick = 9 }',
            "check 'happens' cannot judge: of: lamp.flashes is no text; use above, below or equals",
        ),
        ("settles_within_s = 1", ""),
    ],
)
def test_what_no_check_can_judge_is_one_line(expect, message, tmp_path):
    result = outcome(tmp_path, "", expect)
    assert result.verdict in ("error", "not observable")
    assert message in result.verdict_lines[0][1]


WRONG = {
    '{ send = "team" }': "step 1.send: send = 'team' is for robots; use bytes or text",
    '{ stream = "on" }': "step 1.stream: stream = 'on' is for robots",
    '{ radio = "up" }': "step 1.radio: radio = 'up' is for robots",
    '{ wait_for = "answer" }': "step 1.wait_for: wait_for = 'answer' is for robots; use ",
    '{ hold = "wheels", left_m_s = 1, for_ms = 5 }': "hold = 'wheels' is for robots",
    '{ send = "text", text = "a", network = 0 }': "step 1.network: a board is alone on its line; leave it out",
    '{ wait_for = "edge", pin = "BLNK" }': "step 1.pin: 'BLNK' is no pin, net or part's pin of this board; did you",
    '{ wait_for = "value", of = "lamp.om", equals = 1 }': "step 1.of: lamp.om: part 'lamp' (led) has no value 'om'",
    "{ put = { lamp.on = 1 } }": "step 1.put: lamp.on: nothing can be put at 'on' of part 'lamp' (led)",
    "{ put = { key.pressed = 3 } }": "step 1.put: key.pressed = 3: ",
    '{ press = "lamp" }': "step 1.press: lamp.pressed: nothing can be put",
    '{ press = "kay" }': "did you mean key?",
    '{ hold = "frequency", pin = "P2.0", for_ms = 3 }': "no limit is given; give at_least_hz, at_most_hz or both",
    '{ hold = "pulse", pin = "P2.0", for_ms = 3 }': "'pulse' is not one of the choices",
    '{ wait_for = "text", within_ms = 3 }': "takes a text or a pattern",
    "{ pause_ms = 5000 }": "but the run ends after 1000.000 ms",
    '{ send = "text", text = "a", gap_ms = -1 }': "step 1.gap_ms",
    '{ press = "key" }, { press = "key" }': "step 2: key is pressed until 100.",
    '{ send = "text", text = "?" }': "step 1: net0: the receiver is off",
}


@pytest.mark.parametrize("steps", WRONG)
def test_what_is_wrong_with_a_step_is_one_line_with_its_place(steps, tmp_path):
    result = outcome(tmp_path, steps)
    assert result.verdict == "error"
    assert WRONG[steps] in result.verdict_lines[0][1]


@pytest.mark.parametrize(
    "step",
    [
        "{ put = { a.b = 1 } }",
        '{ press = "key" }',
        '{ send = "text", text = "a" }',
        '{ wait_for = "text", text = "a" }',
    ],
)
def test_robots_have_no_parts(step):
    from miro_sim.scenario.errors import ScenarioError

    with pytest.raises(ScenarioError, match="is for a board"):
        steps_of(scenario_of(step), "mine")


def test_milliseconds_are_ticks_of_the_boards_crystal_rounded(tmp_path):
    result = outcome(
        tmp_path, '{ pause_ms = 0.05 }, { wait_for = "value", of = "lamp.on", equals = 7, within_ms = 3.3 }'
    )
    tick = ms(0.05, CRYSTAL_HZ) + ms(3.3, CRYSTAL_HZ)
    assert (ms(0.05, CRYSTAL_HZ), tick) == (553, 553 + 36_495)
    assert f"tick {tick} ({tick / 11059.2:.3f} ms)" in result.lines[0]


WORDS = st.sampled_from(
    ["edge", "level", "pulse", "frequency", "duty", "text", "value", "P2.0", "BLINK", "key", "lamp.on"]
)
VALUES = st.one_of(
    WORDS,
    st.text(max_size=8),
    st.integers(-(1 << 70), 1 << 70),
    st.floats(),
    st.booleans(),
    st.lists(st.integers(), max_size=2),
    st.dictionaries(
        st.sampled_from(["key", "lamp", ""]), st.dictionaries(st.text(max_size=7), st.booleans()), max_size=2
    ),
)
CONDITION_KEYS = sorted({key for kind in CONDITIONS.values() for key in kind.__struct_encode_fields__})
KEYS = st.sampled_from([*VERBS, *CONDITION_KEYS, "hex", "gap_ms", "for_ms", "within_ms", "from_now", "note"])


def refused(read):
    """The message of a refusal, or the empty string."""
    try:
        read()
    except BadInput as error:
        return str(error)
    return ""


@settings(max_examples=300)
@given(st.dictionaries(KEYS, VALUES, min_size=1, max_size=5))
def test_whatever_a_step_says_it_is_read_or_refused_in_one_line(table):
    scenario = BoardScenario(board=panel(), duration_ticks=CRYSTAL_HZ, step=(table,))
    message = refused(lambda: steps_of(scenario, "mine"))
    assert message.startswith("mine: step 1") or not message
    assert "\n" not in message


@settings(max_examples=200)
@given(
    st.sampled_from(
        ["pwm_at_least_hz", "one_driver", "sends_text", "value_at_most", "value_at_least", "happens"]
    ),
    st.one_of(VALUES, st.dictionaries(st.one_of(KEYS, WORDS), VALUES, max_size=3)),
)
def test_whatever_a_board_is_expected_to_do_it_is_read_or_refused_in_one_line(check, value):
    scenario = BoardScenario(board=panel(), duration_ticks=CRYSTAL_HZ, expect={check: value})
    assert "\n" not in refused(lambda: expectations_of(scenario, "mine"))
