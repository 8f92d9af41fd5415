"""Tables of steps are read, and whatever is wrong with one is one line with its place."""

import msgspec
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import load, parse
from miro_sim.world.conditions import CONDITIONS, Command, WheelSpeeds
from mirotwin.verify.checks.expect import CHECKS, expectations_of, struct_of
from mirotwin.verify.steps.keys import (
    PLAIN,
    SENDS,
    VERBS,
    HoldStep,
    PauseStep,
    SendBytes,
    SendTeam,
    WaitStep,
    acceleration_units,
)
from mirotwin.verify.steps.player import check_symbols
from mirotwin.verify.steps.reading import steps_in, steps_of
from tests.mirotwin.verify.steps.rig import ORIGIN, own_image, read, scenario_of

WRONG = {
    "{}": "step 1: does nothing; give it one of send, wait_for, expect, never, silence_for_ms, hold, stream",
    '{ snd = "team" }': "step 1: does nothing; did you mean send?",
    "{ pause_s = 1 }": "step 1: does nothing; use pause_ms, in milliseconds",
    '{ send = "team", pause_ms = 3 }': "step 1: has both send and pause_ms; one action or one wait a step",
    '{ send = "tem" }': "step 1.send: 'tem' is not one of the choices; use team, poll, ping, filter, acc",
    '{ send = "team", left_cm_s = 20 }': "step 1.left_cm_s: unknown key; use left_m_s, in metres per second",
    '{ send = "team", left_m_s = 3 }': "step 1.left_m_s: 3 is out of range; must be <= 2.876 in metres per sec",
    '{ send = "team", slot = 3 }': "step 1.slot: 3 does not exist on a network of 3 robots; use 0 to 2",
    '{ send = "team", network = 1 }': "step 1.network: there is no network 1; use 0",
    '{ send = "team", team_m_s = [[0, 0]] }': "step 1.team_m_s: 1 pair for 3 slots; give one pair",
    '{ send = "team", slot = 0, team_m_s = [[0, 0], [0, 0], [0, 0]] }': "step 1.team_m_s: tells all slots; leave",
    '{ send = "team", wrong_bits = [120] }': "step 1.wrong_bits: bit 120 is out of range 0..119, the bits from HDR",
    '{ send = "team", bad_stop = [3, 3] }': "step 1.bad_stop: [3, 3] are not characters of the frame in their",
    '{ send = "poll", seq = 3, slot = 1 }': "step 1.seq: 3 does not ask robot 1; leave it out",
    '{ send = "filter", kp = 1, ki = 1, kd = 1 }': "step 1.il: this key is missing; add it",
    '{ send = "bytes", hex = "5x" }': "step 1.hex: '5x' is no character; write two hex digits, and ! for a bad",
    '{ send = "bytes", hex = " " }': "step 1.hex: there is no character; write two hex digits for each",
    '{ stream = "on", every_s = 1 }': "step 1.every_s: unknown key; use every_ms, in milliseconds",
    '{ stream = "on", every_ms = 20 }': "step 1.every_ms: 20 is too short; a frame takes 23.958 ms",
    '{ stream = "yes" }': "step 1.stream: 'yes' is not one of the choices; use off or on",
    '{ wait_for = "frame", within_s = 1 }': "step 1.within_s: unknown key; use within_ms, in milliseconds",
    '{ wait_for = "frame", within_ms = "40 ms" }': "step 1.within_ms: expected a number in milliseconds, got a str",
    '{ wait_for = "frame", within_ms = -1 }': "step 1.within_ms: -1 is out of range; must be >= 0.0 in millisec",
    '{ wait_for = "frame", for_ms = 9 }': "step 1.for_ms: unknown key; it belongs to never and hold",
    '{ wait_for = { event = "frame", slot = 0 } }': 'step 1.wait_for: expected a name; write wait_for = "frame", and',
    "{ wait_for = { event = [1] } }": "step 1.wait_for: {'event': [1]} is not one of the choices",
    '{ wait_for = "telemetry" }': "step 1.wait_for: 'telemetry' is not one of the choices; use answer, heard,",
    '{ expect = "answer", acepted = 3 }': "step 1.acepted: unknown key; did you mean accepted?",
    '{ expect = "answer", slot = 2 }': "step 1.slot: there is no robot in slot 2; there is 0",
    '{ expect = "command", name = "GO" }': "step 1.name: 'GO' is not an LM629 command; there are RESET, STT,",
    '{ expect = "command", hex = "0" }': "step 1.hex: '0' are not bytes; write pairs of hex digits",
    '{ expect = "edge", pin = "P4.0" }': "step 1.pin: 'P4.0' is not a pin; there are rxd, txd,",
    '{ expect = "edge" }': "step 1.pin: this key is missing; add it",
    '{ expect = "reached" }': "step 1.reached: takes a symbol or an address; give one of the two",
    '{ expect = "wheels" }': "step 1.wheels: no speed is given; give left_m_s, right_m_s or both",
    '{ never = "command" }': "step 1.for_ms: this key is missing; add it",
    '{ never = "command", within_ms = 9 }': "step 1.within_ms: unknown key; use for_ms, in milliseconds",
    '{ wait_for = "command", side = "middle" }': "step 1.side: 'middle' is not one of the choices; use left or r",
    '{ hold = "answer", for_ms = 9 }': "step 1.hold: 'answer' is not one of the choices; use wheels",
    "{ silence_for_ms = 9, byte = 3 }": "step 1.byte: unknown key; keys here: network, note",
    "{ pause_ms = 0 }": "step 1.pause_ms: 0 is out of range; must be > 0.0 in milliseconds",
    "{ check = {} }": "step 1.check: there is no check; give it keys as [expect] has them",
    "{ check = { failsafe_s = 0.11 } }": "step 1.check.failsafe_s: there is no such check",
    '{ check = { failsafe_stop_ms = "x" } }': "step 1.check.failsafe_stop_ms: expected a number in milliseconds",
    '{ radio = "off" }': "step 1.radio: 'off' is not one of the choices; use down, noise or up",
    "{ reset = 2 }": "step 1.reset: 2 is not one of the choices; use 0 or 1",
    '{ power = "on", slot = 4 }': "step 1.slot: there is no robot in slot 4; there is 0",
    '{ fault = "encoder left" }': "step 1.fault: 'encoder left' is no hardware fault; write one of: flip ADDR.BIT",
    '{ fault = "rxd 0", slot = 4 }': "step 1.slot: there is no robot in slot 4; there is 0",
    '{ save = "../x.world" }': "step 1.save: '../x.world' is not the name of a file here; write letters, digits,",
    '{ save = "a.world" }, { save = "a.world" }': "step 2.save: step 1 saves a.world, too; give each its own name",
    "{ pause_ms = 1, number = 3 }": "step 1.number: unknown key; keys here: note, pause_ms",
    "{ pause_ms = 1, note = 3 }": "step 1.note: expected a string, got a whole number (3)",
    "3": "step[0]: expected a table, got a whole number (3)",
    "{ pause_ms = 1001 }, { pause_ms = 1 }": "step 2: begins after 1001.000 ms or later and goes on to 1002",
    "{ pause_ms = 1001 }, { reset = 1 }": "step 2: begins after 1001.000 ms or later, but the run ends after",
    "{ silence_for_ms = 1001.1 }": "step 1: begins after 0.000 ms or later and goes on to 1001.100 ms, but the run",
    '{ pause_ms = 990 }, { expect = "answer", within_ms = 12 }': "step 2: begins after 990.000 ms or later and goes",
}


@pytest.mark.parametrize("steps", WRONG)
def test_what_is_wrong_is_one_line_with_its_place_and_a_remedy(steps):
    with pytest.raises(ScenarioError) as caught:
        read(steps)
    assert f"{caught.value}".startswith(f"{ORIGIN}: {WRONG[steps]}")


def test_a_step_may_last_to_the_very_end_of_the_run():
    assert len(read('{ pause_ms = 900 }, { expect = "answer", within_ms = 101 }, { silence_for_ms = 101 }'))


def test_a_host_that_counts_its_own_frames_is_not_counted_for():
    head = 'duration_s = 1.0\nset = { network.host = "controller" }'
    for step, said in (
        ('{ send = "ping" }', r"step 1\.seq: this network's host counts its frames itself; give seq"),
        ('{ stream = "on" }', r"step 1\.stream: this network's host sends by itself; write host"),
    ):
        with pytest.raises(ScenarioError, match=said):
            read(step, head)
    assert read('{ send = "ping", seq = 3 }, { send = "bytes", hex = "55" }, { stream = "off" }', head)


def test_a_symbol_that_the_image_does_not_have_is_refused():
    good = '{ expect = "reached", symbol = "motion_stop" }, { expect = "reached", address = 0x33 }'
    check_symbols(read(good), own_image(), ORIGIN)
    what = r"step 1\.symbol: no symbol motion_halt in the code of .*miro.ihx; did you mean _?motion_"
    with pytest.raises(ScenarioError, match=what):
        check_symbols(read('{ expect = "reached", symbol = "motion_halt" }'), own_image(), ORIGIN)
    with pytest.raises(ScenarioError, match=r"step 1\.symbol: no symbol frames_accepted in the code"):
        check_symbols(read('{ expect = "reached", symbol = "frames_accepted" }'), own_image(), ORIGIN)


def test_steps_know_their_number_and_note():
    first, second, third = read(
        '{ note = "off", send = "team", left_m_s = 1 }, { silence_for_ms = 3 }, { wait_for = "command", name = "STT" }'
    )
    assert first == SendTeam(number=1, note="off", left_m_s=1.0)
    assert f"{first}" == "step 1 (off): send team"
    assert isinstance(second, HoldStep)
    assert (second.number, second.for_ms, second.condition.what) == (2, 3.0, "heard")
    assert third == WaitStep(number=3, verb="wait_for", condition=Command(name="STT"))


def test_bytes_carry_their_stop_bits():
    assert SendBytes(hex="55 5a! ff!").characters() == (b"\x55\x5a\xff", (1, 2))


def test_the_default_acceleration_is_that_of_the_contract():
    assert acceleration_units(6.0) == 5973


# Whatever stands in a table

STRUCTS = (*CONDITIONS.values(), *SENDS.values(), *PLAIN.values(), *map(struct_of, CHECKS.own))
FIELDS = (key for struct in STRUCTS for key in struct.__struct_encode_fields__)
KEYS = st.sampled_from(
    sorted({*VERBS, *FIELDS, "within_ms", "for_ms", "from_now", "note", "within_s", "check", "x"})
)
WORDS = [*CONDITIONS, *SENDS, "on", "off", "up", "left", "STT", "txd", "a.world", "55 55!", ""]
SCALARS = st.one_of(
    *(st.sampled_from(WORDS), st.text(max_size=8), st.booleans(), st.integers(-3, 300), st.just(1 << 70)),
    *(st.floats(-3.0, 300.0), st.floats(), st.dates()),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=2),
    max_leaves=4,
)
STEPS = st.lists(st.dictionaries(KEYS, VALUES, max_size=5), max_size=3)
EXPECT = st.dictionaries(st.sampled_from([*CHECKS.own, "a b", ""]), VALUES, max_size=3)


@pytest.mark.slow
@settings(max_examples=300)
@given(STEPS, EXPECT)
def test_any_table_of_steps_and_of_checks_is_read_or_refused_with_its_place(tables, expect):
    scenario = scenario_of("")
    ways = ("step", tuple(tables), "step ", steps_of), ("expect", expect, "expect.", expectations_of)
    for key, value, begin, reader in ways:
        said = ""
        try:
            reader(msgspec.structs.replace(scenario, **{key: value}), ORIGIN)
        except ScenarioError as error:
            said = str(error)
        assert not said or said.startswith(f"{ORIGIN}: {begin}")
        assert "\n" not in said


def test_a_setting_that_makes_a_step_wrong_is_named():
    with pytest.raises(ScenarioError, match=r"silent with --set step=\[{pauze_ms=1}\]: step 1: does nothing"):
        steps_in(load("silent", ["step=[{pauze_ms=1}]"]))


SMALL = st.floats(0.001, 9.0).map(lambda value: round(value, 3))
SPEED = st.floats(-2.0, 2.0).map(lambda value: round(value, 3))
GOOD = st.one_of(
    st.fixed_dictionaries({"pause_ms": SMALL}, optional={"note": st.text("abc ", max_size=9)}),
    st.fixed_dictionaries({"send": st.just("team")}, optional={"left_m_s": SPEED, "ask": st.booleans()}),
    st.fixed_dictionaries(
        {"wait_for": st.just("answer")}, optional={"accepted": st.integers(0, 255), "within_ms": SMALL}
    ),
    st.fixed_dictionaries({"hold": st.just("wheels"), "left_m_s": SPEED, "for_ms": SMALL}),
)


@given(st.lists(GOOD, min_size=1, max_size=8))
def test_steps_say_what_their_tables_say(tables):
    text = tomli_w.dumps({"scenario": "silent", "duration_s": 1.0, "step": tables})
    for step, table in zip(steps_of(parse(text, ORIGIN), ORIGIN), tables, strict=True):
        assert step.note == table.get("note", "")
        if isinstance(step, PauseStep):
            assert step.pause_ms == table["pause_ms"]
        elif isinstance(step, SendTeam):
            assert (step.left_m_s, step.ask) == (table.get("left_m_s"), table.get("ask", False))
        elif isinstance(step, WaitStep):
            assert step.within_ms == table.get("within_ms")
            assert msgspec.to_builtins(step.condition).get("accepted") == table.get("accepted")
        else:
            assert step.condition == WheelSpeeds(left_m_s=table["left_m_s"])
