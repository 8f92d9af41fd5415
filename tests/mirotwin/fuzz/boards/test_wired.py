"""The fuzzer's target that is a board with parts: what it does is what a World does, to the tick."""

from pathlib import Path
from typing import Annotated, Literal

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.stream import parse
from miro_sim.scenario.board_scenario import load_any
from mirotwin.fuzz.board_target import BoardTarget, wired_target
from mirotwin.fuzz.oracle import BoardOracle
from mirotwin.fuzz.spec import TargetSpec
from mirotwin.fuzz.wired import WiredMachine, choice_of
from mirotwin.shell.firmware_image import image_for
from mirotwin.verify.steps.reading import steps_in
from tests.mirotwin.board_files import BOARD, ECHO, board_folder

BOARDS = Path(__file__).parents[4] / "examples" / "boards"


def target_of(name, steps=1, image=None, **more):
    text = load_any(str(BOARDS / name))
    image = image or image_for(text)
    machine = WiredMachine(text.scenario, image, steps_in(text), steps)
    return BoardTarget(image, machine=machine, **more)


@pytest.fixture(scope="module")
def car():
    return target_of("car/stops.scenario.toml")


def cpu_of(board):
    cpu = board.cpu
    return cpu.cycles, cpu.pc, bytes(cpu.peek_iram(place) for place in range(256))


SESSION = st.lists(
    st.one_of(
        st.sampled_from([b"\x09\x00g", b"\x09\x00e", b"\x09\x00?", b"\x0a\x40", b"\x0b\x05", b"\x0f"]),
        st.tuples(st.sampled_from([b"\x01", b"\x04"]), st.binary(min_size=3, max_size=3)).map(b"".join),
        st.binary(max_size=4),
    ),
    max_size=10,
).map(b"".join)


@settings(max_examples=25, deadline=None)
@given(data=SESSION)
def test_an_input_does_on_the_target_what_it_does_in_a_world_from_power_on(car, data):
    car.run(data)
    end_tick = car.end_tick()
    values = car.machine.device.values()
    here = cpu_of(car.machine.board)
    sent = car.machine.sent
    run = BoardOracle(car, {}).rerun(data, {}, end_tick)
    there = run.world.devices[0]
    assert cpu_of(there.board) == here
    assert there.values() == values
    begun = car.harness.begin_tick
    events = [there.board.log.event(serial) for serial in range(there.board.log.end)]
    assert [(value, tick) for tick, kind, _, value, _ in events if kind == 1 and tick > begun] == sent


def test_inputs_begin_where_the_waits_of_a_scenario_end(car):
    assert car.harness.begin_tick == car.machine.begin_tick
    assert car.machine.how.endswith("wait_for text")
    assert 1.5 < car.harness.begin_tick / 11_059.2 < 2.5  # ms: it has sent >


def test_without_steps_they_begin_when_the_firmware_has_settled():
    rover = target_of("rover/turns.scenario.toml", 0)
    began_ms = rover.harness.begin_tick / 11_059.2
    assert 500 < began_ms < 1000  # the display is written, the first ping is over
    assert rover.machine.how == "its receiver is on, and no branch was new for 300 ms"
    assert rover.machine.device.value("lcd.row2").startswith("ahead")


def test_what_can_be_put_follows_from_the_types_of_the_parts(car):
    choices = dict(car.machine.choices)
    assert list(choices)[: car.machine.values] == [
        f"{name}.{key}" for name, keys in car.machine.device.parts.items() for key in keys.PUTS
    ]
    distance = choices["eyes.distance_cm"]
    assert (distance(0), distance(0xFFFF)) == (2.0, 400.0)
    assert [choices["eyes.echo"](bits) for bits in range(4)] == ["high", "low", "none", "normal"]
    assert [choices["left.blocked"](bits) for bits in range(3)] == [False, True, False]
    assert choices["left.load_nm"](0) == 0.0
    pins = list(choices)[car.machine.values :]
    assert {"P0.0", "P1.3", "P3.7"} < {*pins}
    assert not {"P1.0", "P1.1", "P2.5", "P3.0", "P3.1"} & {*pins}  # parts, and the serial port
    for value_of in choices.values():
        assert len({value_of(bits) for bits in range(0, 0x10000, 17)}) > 1


def test_a_number_between_two_that_bits_choose_becomes_the_nearer_also_beside_words(car):
    machine = car.machine
    info = msgspec.inspect.type_info(Annotated[float, msgspec.Meta(ge=2.0, le=400.0)] | Literal["none"])
    machine.choices.append(("own.distance_cm", choice_of(info)))
    try:
        which = len(machine.choices) - 1
        value_of = machine.choices[which][1]
        assert value_of(machine.bits_of(which, 60.0001)) == pytest.approx(60.0001, abs=0.02)
        assert value_of(machine.bits_of(which, "none")) == "none"
    finally:
        machine.choices.pop()


def test_a_run_leaves_nothing_to_the_next(car):
    def outcome(data):
        car.run(data)
        return cpu_of(car.machine.board), car.machine.sent, car.machine.device.values()

    begins = b"\x09\x00?\x0b\x10"
    first = outcome(begins)
    outcome(b"\x09\x00g\x01\x00\x00\x00\x01\x03\x01\x00\x0b\x40\x0f")
    assert outcome(begins) == first


def test_firmware_that_fails_in_a_step_is_refused_in_one_line():
    with pytest.raises(BadInput, match=r"does not come up: step 1 .*; mend it, or .* by fewer --steps"):
        target_of(
            "car/stops.scenario.toml", 6, image_for(load_any(str(BOARDS / "rover/turns.scenario.toml")))
        )


def test_steps_that_send_bring_the_board_up_too():
    target = target_of("car/stops.scenario.toml", 2)
    assert [item.data for item in target.machine.script] == [b"g"]
    assert target.harness.begin_tick >= target.machine.script[0].tick + 10 * target.harness.bit_ticks


READS_A_PIN = ECHO.replace("MOV SBUF,A\nJNB TI,$", "MOV C,P1.3\nMOV ACC.7,C\nMOV SBUF,A\nJNB TI,$")
"""Bit 7 of what it sends back is P1.3."""


def test_an_input_puts_levels_on_pins_that_nothing_drives_and_a_stream_does_so_too(tmp_path):
    path = board_folder(tmp_path, program=READS_A_PIN)
    text = load_any(str(path))
    image = image_for(text)
    target = BoardTarget(image, machine=WiredMachine(text.scenario, image))
    pin = [path for path, _ in target.machine.choices[target.machine.values :]].index("P1.3")
    low, high = bytes([4, pin, 0, 0]), bytes([4, pin, 1, 0])
    character = b"\x09\x00A\x0a\x20"
    data = character + low + character + high + character
    target.run(data)
    assert [value for value, _ in target.machine.sent] == [0xC1, 0x41, 0xC1]
    assert [line.split(": ")[1] for line in target.describe(data).splitlines()] == [
        *("41", "P1.3 = 0", "41", "P1.3 = 1", "41"),
    ]  # fmt: skip
    stream = BoardOracle(target, {}).judged(data, {}).stream()
    assert target.inputs_of(parse(stream).script()) == [data.removesuffix(b"\x0a\x20")]
    without = stream.replace("P1.3 = 0", "P1.3 0").replace("P1.3 = 1", "P1.3 1")
    assert parse(without).script() == parse(stream).script()


@pytest.mark.parametrize(("kind", "puts"), [("session", "key.pressed, 27 pins"), ("bytes", "nothing")])
def test_the_note_names_what_inputs_of_a_class_put(tmp_path, kind, puts):
    text = load_any(str(board_folder(tmp_path)))
    target = BoardTarget(image_for(text), kind, machine=WiredMachine(text.scenario, image_for(text)))
    assert f"; they put {puts}" in target.note()


def test_a_pin_with_something_wired_to_it_is_put_by_no_scenario(tmp_path):
    path = board_folder(tmp_path)
    path.write_text(path.read_text().replace("put = { key.pressed = true }", "put = { P2.0 = 1 }"))
    with pytest.raises(BadInput, match=r"put\.P2\.0: something is wired to it; put a value of that"):
        load_any(str(path))
    path.write_text(path.read_text().replace("P2.0 = 1", "P1.3 = 2"))
    with pytest.raises(BadInput, match=r"P1\.3.* is no level; use 0 or 1"):
        load_any(str(path))


SCENARIO = """
board = "lamp.board.toml"
firmware = "lamp.hex"
duration_s = 1.0
[expect]
value_at_most = { "lamp.flashes" = 2 }
sends_text = "done"
[[step]]
pause_ms = 20
[[step]]
put = { key.pressed = true }
[[step]]
send = "text"
text = "hi"
"""


def test_the_expectations_of_a_scenario_judge_each_input_but_one_that_fails_without_any(tmp_path):
    text = load_any(str(board_folder(tmp_path, SCENARIO, BOARD.replace("bounce_ms = 3", ""))))
    image, parameters = str(tmp_path / "lamp.hex"), {"tables": text.tables, "steps": 1}
    target = wired_target(TargetSpec(board="wired", image=image, parameters=parameters))
    assert [check.name for check in target.checks] == ["value_at_most"]
    assert list(target.left_out) == ["sends_text"]
    press, let_go, wait = b"\x01\x00\x01\x00", b"\x01\x00\x00\x00", b"\x0a\x40"
    twice, thrice = (wait.join([press, let_go] * count) + wait for count in (1, 5))
    assert target.run(twice) == 0
    assert target.run(thrice) == 3
    assert target.failure.check == "value_at_most"
    run = BoardOracle(target, text.scenario.expect).confirm(thrice, target.failure)
    assert run.failure.check == "value_at_most"
    (seed,) = target.inputs_of(target.wired.played())
    assert seed == b"\x09\x01hi" + press


def test_a_reset_ends_no_period_of_a_pwm():
    text = load_any(str(BOARDS / "car/stops.scenario.toml"))
    image, parameters = str(image_for(text).path), {"tables": text.tables, "steps": 1}
    target = wired_target(TargetSpec(board="wired", image=image, parameters=parameters))
    go, stop, reset = b"\x09\x00g\x0b\x30", b"\x09\x00s\x0a\x80", b"\x09\x00x\x0f\x0b\x02"
    going_again = (go + stop + reset) * 2 + go  # ports go high with the reset, 30 ms after the last period
    assert target.run(going_again) == 0
    run = BoardOracle(target, {}).judged(going_again, text.scenario.expect)
    assert run.failure is None
    assert run.verdict_on("pwm_at_least_hz") == "passed"
