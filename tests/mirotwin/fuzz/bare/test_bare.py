"""Any firmware with a serial port as a target: what it hears, how runs end, what is found; wire formats."""

import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.miro_wire import Miro
from miro_protocol.protocol import Damage, Frame, Protocol
from mirotwin.fuzz.bare import (
    CHECK_CODE,
    NEVER_SLEEPS_CODE,
    NO_FAULT_CODE,
    BareTarget,
    frame_input,
    protocol_named,
)
from mirotwin.verify.bare.exchange import NamedCheck
from mirotwin.verify.bare.run import BarePlayback
from tests.exact import distribution
from tests.mirotwin.verify.bare.firmwares import DEAF, FAULTY, POLLS, SERIAL, SLEEPS, image

INPUTS = st.sampled_from(["bytes", "frames", "session"])


class Counted(Protocol, frozen=True, tag="counted"):
    """Frames are their number, and the body."""

    def repair(self, body, number=None):
        return bytes([255 if number is None else number]) + body


def check(function):
    return NamedCheck(function.__name__, "test", function, False)


def test_characters_come_in_at_the_rate_of_the_receiver_and_answers_go_out():
    target = BareTarget(image(SLEEPS), "bytes")
    assert target.run(b"hello") == 0
    run = target.exchange()
    assert run.received_bytes == run.sent_bytes == b"hello"
    assert {later.tick - one.tick for one, later in zip(run.received, run.received[1:], strict=False)} == {
        10 * target.line.bit_ticks
    }
    assert all(one.stop_good for one in run.received)
    assert run.fault is None
    assert run.begin_tick < run.received[0].tick < run.end_tick


def test_firmware_that_sleeps_before_its_timer_has_overflowed_once_is_heard():
    """TL1 is not preloaded: its first overflow, which starts the serial clock, comes after the first sleep."""
    slow = SLEEPS.replace("MOV TL1,#0FDh\n", "")
    assert slow != SLEEPS
    target = BareTarget(image(slow), "bytes")
    assert target.run(b"hello") == 0
    assert target.exchange().sent_bytes == b"hello"


def test_a_wire_format_that_fails_itself_is_named():
    class Broken(Counted, frozen=True, tag="broken"):
        def repair(self, body, number=None):
            return "text"

    target = BareTarget(image(SLEEPS), "frames", protocol=Broken())
    with pytest.raises(
        BadInput, match=r"--protocol: `repair` failed: TypeError: .*test_bare.py:\d+ in .*Broken.repair\)"
    ):
        target.run(b"\x00\x00")


def test_a_run_is_over_when_firmware_sleeps_and_has_sent_all_it_had():
    target = BareTarget(image(SLEEPS), "bytes")
    target.run(b"abc")
    run = target.exchange()
    assert len(run.sent) == 3
    assert run.end_tick - run.sent[-1].tick < 2 * 24_000


def test_firmware_that_polls_for_ever_is_listened_to_for_a_while_and_nothing_is_wrong_with_it():
    target = BareTarget(image(POLLS), "bytes")
    assert target.run(b"abc") == 0
    run = target.exchange()
    assert run.received_bytes == b"abc"
    assert run.end_tick - run.received[-1].tick == pytest.approx(10 * 24_000, rel=0.05)


@pytest.mark.parametrize("firmware", [POLLS, SLEEPS])
def test_a_fault_is_found_with_tick_and_place(firmware):
    target = BareTarget(image(firmware), "bytes")
    assert target.run(b"ab!cd") == NO_FAULT_CODE
    found = target.failure
    assert (found.check, found.pc) == ("no_fault", 0x4000)
    assert "executed outside the loaded image at 0x4000" in found.what
    assert found.tick > target.exchange().received[2].tick
    assert target.run(b"abcd") == 0
    assert target.failure is None


def test_firmware_that_sleeps_no_more_is_found_and_only_where_it_is_one_that_sleeps():
    target = BareTarget(image(SLEEPS), "bytes")
    assert target.run(b"a?") == NEVER_SLEEPS_CODE
    assert target.failure.check == "never_sleeps"
    assert target.run(b"a") == 0


def test_firmware_that_waits_for_its_transmitter_is_awake_and_not_stuck():
    """It sends 200 characters for one, without an interrupt: 104 ms at 19200 baud."""
    text = SLEEPS.replace(
        "answer:\nMOV SBUF,A\n", "answer:\nMOV R7,#200\nmore:\nMOV SBUF,A\nJNB TI,$\nCLR TI\nDJNZ R7,more\n"
    )
    target = BareTarget(image(text), "bytes")
    assert target.run(b"a") == 0
    assert len(target.exchange().sent) == 200


@settings(max_examples=60)
@given(INPUTS, st.sampled_from([POLLS, SLEEPS]), st.binary(max_size=60))
def test_any_input_gives_the_same_from_power_on_as_from_the_saved_moment(kind, firmware, data):
    target = TARGETS[kind, firmware]
    code = target.run(data)
    run = target.exchange()
    beyond = 240 if code == NO_FAULT_CODE else 0
    again = (
        BarePlayback(target.image, target.line, target.script(data), run.end_tick + beyond).play().processor
    )
    whole = again.exchange()
    assert whole.received == run.received
    assert whole.sent[: len(run.sent)] == run.sent
    assert (whole.fault, whole.memory.iram, whole.memory.xram) == (
        run.fault,
        run.memory.iram,
        run.memory.xram,
    )


TARGETS = {
    (kind, firmware): BareTarget(image(firmware), kind, Counted())
    for kind in ("bytes", "frames", "session")
    for firmware in (POLLS, SLEEPS)
}


def test_bodies_become_frames_with_the_number_that_is_next():
    target = BareTarget(image(SLEEPS), "frames", Counted())
    target.run(b"\x00A\x01BC\x00D")
    assert target.exchange().received_bytes == b"\x00A\x01BC\x02D"
    target.run(b"\x00A")
    assert target.exchange().received_bytes == b"\x00A"
    assert target.executions == 2


def test_a_body_may_have_more_than_32_bytes():
    target = BareTarget(image(SLEEPS), "frames", Counted())
    target.run(b"\xff" + b"A" * 256)
    assert len(target.exchange().received_bytes) == 257


def test_bad_stop_bits_pauses_and_damage_of_a_session_reach_the_receiver():
    target = BareTarget(image(SLEEPS), "session")
    raw = b"\x09\x02abc"
    target.run(b"\x0a\x09" + raw)
    late = target.exchange().received
    target.run(raw)
    soon = target.exchange().received
    assert [one.tick - other.tick for one, other in zip(late, soon, strict=True)] == pytest.approx(
        [24_000] * 3, abs=72
    )
    target.run(b"\x0e\x01" + b"\x07\x02abc")
    assert [one.stop_good for one in target.exchange().received] == [True, False, True]
    target.run(b"\x0c\x01\x20" + b"\x07\x02abc")
    assert target.exchange().received_bytes == b"aBc"


def test_without_a_protocol_bodies_are_sent_as_they_are_and_any_protocol_describes_them():
    bare = BareTarget(image(SLEEPS), "frames")
    bare.run(frame_input(b"xyz", "frames"))
    assert bare.exchange().received_bytes == b"xyz"
    ours = BareTarget(image(SLEEPS), "session", Miro())
    line = ours.describe(frame_input(bytes(13), "session"))
    assert line.endswith("# frame " + " ".join(["00"] * 13))
    assert ": 55 55 55 55 55 ff 2d d4 " in line


def test_seeds_are_the_samples_one_by_one_and_together():
    target = BareTarget(image(SLEEPS), "frames", Miro())
    seeds = target.seeds()
    assert len(seeds) == len(Miro().samples()) + 1
    target.run(seeds[-1])
    assert target.program.frames == len(Miro().samples())
    plain = BareTarget(image(SLEEPS), "bytes", Miro()).seeds()[0]
    assert plain == Miro().encode(Miro().samples()[0])


def test_a_check_judges_each_run_and_sees_memory_characters_and_time():
    def keeps_the_last(run):
        last = run.received[-1].value if run.received else 0
        return None if run.memory.xram[0x1234] == last < 0x80 else f"the last one is {last}"

    target = BareTarget(image(SLEEPS), "bytes", check=check(keeps_the_last))
    assert target.run(b"abc") == 0
    assert target.run(b"ab\xff") == CHECK_CODE
    assert target.failure.what == "the last one is 255"
    assert target.failure.check == "keeps_the_last"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: BareTarget(image(DEAF)), "has not turned its serial receiver on 200 ms after power-on"),
        (lambda: BareTarget(image(FAULTY)), "comes up with a fault: firmware executed outside"),
        (lambda: BareTarget(image(POLLS), baud=3), "--baud: 3 is outside 50.."),
        (lambda: BareTarget(image(POLLS), baud=10_000_000), "is outside 50..750000 at 24000000 Hz"),
        (lambda: BareTarget(image(POLLS), crystal_hz=1), "--crystal: crystal 1 Hz is outside"),
        (lambda: BareTarget(image(POLLS), "words"), "'words' is no class of inputs"),
    ],
)
def test_what_cannot_be_fuzzed_is_refused_with_the_reason(make, said):
    with pytest.raises(BadInput, match=said.replace("(", r"\(")):
        make()


def test_a_given_rate_is_taken_instead_of_the_receivers():
    target = BareTarget(image(SERIAL + "SJMP $"), "bytes", crystal_hz=11_059_200, baud=9600)
    assert target.line.bit_ticks == 1152


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
        ("", "'' is not one of the choices"),
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
    target = BareTarget(image(LATE), "bytes", after_ticks=after_ticks)
    assert target.run(b"a") == code
    ms = (target.end_tick() - target.harness.end_tick) / 24_000
    assert code or ms == pytest.approx(10 if after_ms is None else after_ms, abs=0.1)


def test_firmware_that_sleeps_is_watched_that_long_too():
    target = BareTarget(image(SLEEPS), "bytes", after_ticks=24_000 * 70)
    assert target.run(b"a") == 0
    assert target.end_tick() - target.harness.end_tick >= 24_000 * 70


# The page about foreign firmware: its check and its format work as they stand there

PAGE = (Path(__file__).parents[4] / "docs" / "fuzz-any-8051.md").read_text(encoding="utf-8")
CHECK, FORMAT = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def test_its_check_says_what_is_wrong():
    found = {}
    exec(CHECK, found)
    levels = [found["level_is_kept"](SimpleNamespace(memory={"level": level})) for level in (100, 101)]
    assert levels == [None, "the level is 101"]


def test_its_format_keeps_the_laws_of_the_interface():
    found = {}
    exec(FORMAT, found)
    lines = found["Lines"]()
    assert lines.encode(b"ab") == b"abc3\n"
    assert lines.decode(b"abc3\n" + b"abc4\n") == [Frame(b"ab", 0, 5), Damage(5, 10, "bad sum")]
    assert lines.decode(lines.repair(b"a\nb")) == [Frame(b"a b", 0, 6)]
