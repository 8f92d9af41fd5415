"""Any firmware with a serial port as a target: what it hears, how runs end, what is found; wire formats."""

import re
import sys
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.miro_wire import Miro
from miro_protocol.protocol import Damage, Frame, Protocol
from mirotwin.fuzz.board_target import (
    CHECK_CODE,
    NEVER_SLEEPS_CODE,
    NO_FAULT_CODE,
    BoardTarget,
    frame_input,
)
from mirotwin.fuzz.oracle import BoardOracle
from mirotwin.fuzz.protocols import protocol_named
from mirotwin.verify.checks.interface import Check, Monitor
from mirotwin.verify.checks.serial import Character
from tests.exact import distribution
from tests.mirotwin.verify.firmwares import DEAF, FAULTY, POLLS, SERIAL, SLEEPS, image
from tests.mirotwin.verify.own_checks import check_of

INPUTS = st.sampled_from(["bytes", "frames", "session"])


class Counted(Protocol, frozen=True, tag="counted"):
    """Frames are their number, and the body."""

    def repair(self, body, number=None):
        return bytes([255 if number is None else number]) + body


def received(target):
    return [Character(value, tick, bool(stop)) for value, stop, tick in target.bus.received]


def sent(target):
    return [Character(value, tick) for value, tick in target.bus.sent]


def text(characters):
    return bytes(one.value for one in characters)


def test_characters_come_in_at_the_rate_of_the_receiver_and_answers_go_out():
    target = BoardTarget(image(SLEEPS), "bytes")
    assert target.run(b"hello") == 0
    heard = received(target)
    assert text(heard) == text(sent(target)) == b"hello"
    assert {later.tick - one.tick for one, later in pairwise(heard)} == {10 * target.scenario.bit_ticks}
    assert all(one.stop_good for one in heard)
    assert target.machine.fault() is None
    assert target.scenario.begin_tick < heard[0].tick < target.end_tick()


def test_firmware_that_sleeps_before_its_timer_has_overflowed_once_is_heard():
    """TL1 is not preloaded: its first overflow, which starts the serial clock, comes after the first sleep."""
    slow = SLEEPS.replace("MOV TL1,#0FDh\n", "")
    assert slow != SLEEPS
    target = BoardTarget(image(slow), "bytes")
    assert target.run(b"hello") == 0
    assert text(sent(target)) == b"hello"


def test_a_wire_format_that_fails_itself_is_named():
    class Broken(Counted, frozen=True, tag="broken"):
        def repair(self, body, number=None):
            return "text"

    target = BoardTarget(image(SLEEPS), "frames", protocol=Broken())
    with pytest.raises(
        BadInput, match=r"--protocol: `repair` failed: TypeError: .*test_bare.py:\d+ in .*Broken.repair\)"
    ):
        target.run(b"\x00\x00")


def test_a_run_is_over_when_firmware_sleeps_and_has_sent_all_it_had():
    target = BoardTarget(image(SLEEPS), "bytes")
    target.run(b"abc")
    assert len(sent(target)) == 3
    assert target.end_tick() - sent(target)[-1].tick < 2 * 24_000


def test_firmware_that_polls_for_ever_is_listened_to_for_a_while_and_nothing_is_wrong_with_it():
    target = BoardTarget(image(POLLS), "bytes")
    assert target.run(b"abc") == 0
    assert text(received(target)) == b"abc"
    assert target.end_tick() - received(target)[-1].tick == pytest.approx(10 * 24_000, rel=0.05)


@pytest.mark.parametrize("firmware", [POLLS, SLEEPS])
def test_a_fault_is_found_with_tick_and_place(firmware):
    target = BoardTarget(image(firmware), "bytes")
    assert target.run(b"ab!cd") == NO_FAULT_CODE
    found = target.failure
    assert (found.check, found.pc) == ("no_fault", 0x4000)
    assert "executed outside the loaded image at 0x4000" in found.what
    assert found.tick > received(target)[2].tick
    assert target.run(b"abcd") == 0
    assert target.failure is None


def test_firmware_that_sleeps_no_more_is_found_and_only_where_it_is_one_that_sleeps():
    target = BoardTarget(image(SLEEPS), "bytes")
    assert target.run(b"a?") == NEVER_SLEEPS_CODE
    assert target.failure.check == "never_sleeps"
    assert target.run(b"a") == 0


def test_firmware_that_waits_for_its_transmitter_is_awake_and_not_stuck():
    """It sends 200 characters for one, without an interrupt: 104 ms at 19200 baud."""
    text = SLEEPS.replace(
        "answer:\nMOV SBUF,A\n", "answer:\nMOV R7,#200\nmore:\nMOV SBUF,A\nJNB TI,$\nCLR TI\nDJNZ R7,more\n"
    )
    target = BoardTarget(image(text), "bytes")
    assert target.run(b"a") == 0
    assert len(sent(target)) == 200


@settings(max_examples=60)
@given(INPUTS, st.sampled_from([POLLS, SLEEPS]), st.binary(max_size=60))
def test_any_input_gives_the_same_from_power_on_as_from_the_saved_moment(kind, firmware, data):
    target = TARGETS[kind, firmware]
    code = target.run(data)
    beyond = 240 if code == NO_FAULT_CODE else 0
    check_of("listens", lambda monitor: None)
    run = BoardOracle(target, {}).rerun(data, {"listens": True}, target.end_tick() + beyond)
    (listener,) = (one for one in run.checks.monitors if one.check.name == "listens")
    assert listener.received == received(target)
    assert listener.sent[: len(sent(target))] == sent(target)
    fault, memory, other = target.machine.fault(), target.subject.memory, listener.subject.memory
    assert run.world.faults == ([] if fault is None else [fault])
    assert (other.iram, other.xram) == (memory.iram, memory.xram)


TARGETS = {
    (kind, firmware): BoardTarget(image(firmware), kind, Counted())
    for kind in ("bytes", "frames", "session")
    for firmware in (POLLS, SLEEPS)
}


def test_bodies_become_frames_with_the_number_that_is_next():
    target = BoardTarget(image(SLEEPS), "frames", Counted())
    target.run(b"\x00A\x01BC\x00D")
    assert text(received(target)) == b"\x00A\x01BC\x02D"
    target.run(b"\x00A")
    assert text(received(target)) == b"\x00A"
    assert target.executions == 2


def test_a_body_may_have_more_than_32_bytes():
    target = BoardTarget(image(SLEEPS), "frames", Counted())
    target.run(b"\xff" + b"A" * 256)
    assert len(received(target)) == 257


def test_bad_stop_bits_pauses_and_damage_of_a_session_reach_the_receiver():
    target = BoardTarget(image(SLEEPS), "session")
    raw = b"\x09\x02abc"
    target.run(b"\x0a\x09" + raw)
    late = received(target)
    target.run(raw)
    soon = received(target)
    assert [one.tick - other.tick for one, other in zip(late, soon, strict=True)] == pytest.approx(
        [24_000] * 3, abs=72
    )
    target.run(b"\x0e\x01" + b"\x07\x02abc")
    assert [one.stop_good for one in received(target)] == [True, False, True]
    target.run(b"\x0c\x01\x20" + b"\x07\x02abc")
    assert text(received(target)) == b"aBc"


def test_without_a_protocol_bodies_are_sent_as_they_are_and_any_protocol_describes_them():
    bare = BoardTarget(image(SLEEPS), "frames")
    bare.run(frame_input(b"xyz", "frames"))
    assert text(received(bare)) == b"xyz"
    ours = BoardTarget(image(SLEEPS), "session", Miro())
    line = ours.describe(frame_input(bytes(13), "session"))
    assert line.endswith("# frame " + " ".join(["00"] * 13))
    assert ": 55 55 55 55 55 ff 2d d4 " in line


def test_seeds_are_the_samples_one_by_one_and_together():
    target = BoardTarget(image(SLEEPS), "frames", Miro())
    seeds = target.seeds()
    assert len(seeds) == len(Miro().samples()) + 1
    target.run(seeds[-1])
    assert target.program.frames == len(Miro().samples())
    plain = BoardTarget(image(SLEEPS), "bytes", Miro()).seeds()[0]
    assert plain == Miro().encode(Miro().samples()[0])


def test_a_check_judges_each_run_and_sees_memory_characters_and_time():
    def keeps_the_last(monitor):
        last = monitor.received[-1].value if monitor.received else 0
        kept = monitor.subject.memory.xram[0x1234]
        return None if kept == last < 0x80 else f"the last one is {last}"

    target = BoardTarget(image(SLEEPS), "bytes", checks=[check_of("keeps_the_last", keeps_the_last)])
    assert target.run(b"abc") == 0
    assert target.run(b"ab\xff") == CHECK_CODE
    assert target.failure.what == "the last one is 255"
    assert target.failure.check == "keeps_the_last"


def test_a_check_that_raises_fails_with_what_it_raised():
    target = BoardTarget(image(SLEEPS), "bytes", checks=[check_of("raises", lambda monitor: monitor.nothing)])
    assert target.run(b"a") == CHECK_CODE
    assert target.failure.check == "raises"
    assert target.failure.what.startswith("AttributeError: 'OwnMonitor' object has no attribute 'nothing' (")


class Hears(Monitor):
    EVENTS = ("transmitted",)

    def event(self, event):
        self.judged += 1
        if event.value == 0x62:
            self.fail(event.tick, "no b", "one")


class NoB(Check, frozen=True, kw_only=True, tag="no_b"):
    KIND = "safety"
    SUBJECTS = ("board",)

    def monitor(self, subject):
        return Hears(self, subject)


def test_a_check_of_events_judges_each_run_too_and_one_that_wants_more_is_refused(monkeypatch):
    target = BoardTarget(image(SLEEPS), "bytes", checks=[NoB()])
    assert target.run(b"ac") == 0
    assert target.run(b"ab") == CHECK_CODE
    assert target.failure.what == "wanted no b, found one"
    monkeypatch.setattr(Hears, "EVENTS", ("transmitted", "fault"))
    with pytest.raises(BadInput, match="no_b judges by fault, which only a whole run shows; leave it out"):
        BoardTarget(image(SLEEPS), "bytes", checks=[NoB()])


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: BoardTarget(image(DEAF)), "has not turned its serial receiver on 200 ms after power-on"),
        (lambda: BoardTarget(image(FAULTY)), "comes up with a fault: firmware executed outside"),
        (lambda: BoardTarget(image(POLLS), baud=3), "--baud: 3 is outside 50.."),
        (lambda: BoardTarget(image(POLLS), baud=10_000_000), "is outside 50..750000 at 24000000 Hz"),
        (lambda: BoardTarget(image(POLLS), crystal_hz=1), "--crystal: crystal 1 Hz is outside"),
        (lambda: BoardTarget(image(POLLS), "words"), "'words' is no class of inputs"),
    ],
)
def test_what_cannot_be_fuzzed_is_refused_with_the_reason(make, said):
    with pytest.raises(BadInput, match=said.replace("(", r"\(")):
        make()


def test_a_given_rate_is_taken_instead_of_the_receivers():
    target = BoardTarget(image(SERIAL + "SJMP $"), "bytes", crystal_hz=11_059_200, baud=9600)
    assert target.scenario.bit_ticks == 1152


# Wire formats by name and parameters, ours and those of distributions

THEIRS = """
from miro_protocol.protocol import Protocol

class Lines(Protocol, frozen=True, tag="lines"):
    end: str = "x"
    def encode(self, body):
        return body + self.end.encode()

class Other:
    pass
"""


def test_ours_by_name_with_parameters():
    assert protocol_named("miro") == Miro(robots=3)
    assert protocol_named("miro:robots=5") == Miro(robots=5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mire", "'mire' is not one of the choices; did you mean miro?"),
        ("miro:robots=4", "miro:robots=4: robots: invalid enum value 4; miro has robots"),
        ("miro:robots", "'robots' are no parameters; write NAME:KEY=VALUE,KEY=VALUE, such as miro:robots=5"),
        ("miro:rate=1", "miro:rate=1: rate: unknown key; miro has robots"),
        ("", "'' is not one of the choices; use miro, or one of your own: --protocol FILE.py:CLASS"),
    ],
)
def test_what_is_no_protocol_is_refused(text, said):
    with pytest.raises(BadInput) as caught:
        protocol_named(text)
    assert str(caught.value).startswith(f"--protocol: {said}")


def test_a_distribution_may_bring_one(tmp_path, monkeypatch):
    parts = {"lines": "their_lines:Lines", "other": "their_lines:Other"}
    distribution.install(tmp_path, "theirs", "1.0", parts, "protocols", their_lines=THEIRS)
    monkeypatch.syspath_prepend(tmp_path)
    assert protocol_named('lines:end="\\n"').encode(b"a") == b"a\n"
    with pytest.raises(BadInput, match="is not a struct of parameters; derive it from miro_protocol"):
        protocol_named("other")
    sys.modules.pop("their_lines")


def test_a_file_may_hold_one(tmp_path):
    path = tmp_path / "my_lines.py"
    path.write_text(THEIRS)
    assert protocol_named(f"{path}:Lines").encode(b"a") == b"ax"
    assert protocol_named(f'{path}:Lines:end="\\n"').encode(b"a") == b"a\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nowhere.py:Lines", "nowhere.py: --protocol: there is no such file"),
        ("{}", "there is no class '' derived from Protocol; it has Lines"),
        ("{}:Line", "there is no class 'Line' derived from Protocol; did you mean Lines?"),
        ("{}:Other", "there is no class 'Other' derived from Protocol"),
        ("{}:Lines:end", "'end' are no parameters"),
        ("{}:Lines:rate=1", "rate: unknown key; Lines has end"),
    ],
)
def test_what_a_file_does_not_hold_is_refused(tmp_path, text, said):
    path = tmp_path / "my_lines.py"
    path.write_text(THEIRS)
    with pytest.raises(BadInput) as caught:
        protocol_named(text.format(path))
    assert said in str(caught.value)


def test_a_file_that_cannot_be_run_is_refused(tmp_path):
    path = tmp_path / "broken.py"
    path.write_text("1 / 0")
    with pytest.raises(BadInput, match="--protocol: cannot be run: ZeroDivisionError"):
        protocol_named(f"{path}:Lines")


LATE = f"""{SERIAL}
JNB RI,$
MOV R5,#4
wait:
MOV R6,#0
outer:
MOV R7,#0
DJNZ R7,$
DJNZ R6,outer
DJNZ R5,wait
LJMP 4000h
"""
"""Runs into nothing 263 ms after the first character, at 24 MHz."""


@pytest.mark.parametrize(("after_ms", "code"), [(None, 0), (1, 0), (200, 0), (300, NO_FAULT_CODE)])
def test_a_run_goes_on_after_its_last_character_as_long_as_it_was_told(after_ms, code):
    after_ticks = None if after_ms is None else after_ms * 24_000
    target = BoardTarget(image(LATE), "bytes", after_ticks=after_ticks)
    assert target.run(b"a") == code
    ms = (target.end_tick() - target.harness.end_tick) / 24_000
    assert code or ms == pytest.approx(10 if after_ms is None else after_ms, abs=0.1)


def test_firmware_that_sleeps_is_watched_that_long_too():
    target = BoardTarget(image(SLEEPS), "bytes", after_ticks=24_000 * 70)
    assert target.run(b"a") == 0
    assert target.end_tick() - target.harness.end_tick >= 24_000 * 70


# The page about fuzzing: its check and its format work as they stand there

PAGE = (Path(__file__).parents[4] / "docs" / "howto" / "fuzz.md").read_text(encoding="utf-8")
CHECK, FORMAT = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def test_its_check_says_what_is_wrong():
    found = {}
    exec(CHECK, found)
    for level, failures in ((100, []), (101, ["wanted at most 100, found 101"])):
        place = {"network": 0, "slot": 0, "clock": 24_000_000, "alone": True}
        monitor = found["LevelIsKept"]().monitor(SimpleNamespace(memory={"level": level}, **place))
        monitor.end(1000)
        assert [one.what for one in monitor.failures] == failures


def test_its_format_keeps_the_laws_of_the_interface():
    found = {}
    exec(FORMAT, found)
    lines = found["Lines"]()
    assert lines.encode(b"ab") == b"abc3\n"
    assert lines.decode(b"abc3\n" + b"abc4\n") == [Frame(b"ab", 0, 5), Damage(5, 10, "bad sum")]
    assert lines.decode(lines.repair(b"a\nb")) == [Frame(b"a b", 0, 6)]
