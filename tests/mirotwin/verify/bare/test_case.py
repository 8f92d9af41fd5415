"""Crashes on a bare processor as files: the same verdict again, here and elsewhere; and checks in Python for it."""

import sys

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol.actions import Reset
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.terminal import PinEvent
from mirotwin.fuzz.bare import BareTarget
from mirotwin.fuzz.oracle import BareProcessorOracle
from mirotwin.runs.bare_case import case_text, rerun_bare_case
from mirotwin.verify.bare.exchange import NamedCheck, check_named
from mirotwin.verify.bare.run import BarePlayback
from tests.alone import Alone
from tests.exact import distribution
from tests.mirotwin.verify.bare.firmwares import POLLS, SLEEPS, image
from tests.states import restore, snapshot

WRONG = 'def short(run):\n    return f"{len(run.sent)} are too many" if len(run.sent) > 2 else None\n'


def too_long(run):
    return f"{len(run.sent)} are too many" if len(run.sent) > 2 else None


CHECK = NamedCheck("too_long", "too_long", too_long, True)


def case(tmp_path, data, firmware=SLEEPS, check=None):
    """The file of what a target finds in `data`."""
    target = BareTarget(image(firmware), "bytes", check=check)
    assert target.run(data)
    found = target.failure
    path = tmp_path / "crash.stream"
    path.write_text(BareProcessorOracle(target, check).confirm(data, found).case())
    return path


@pytest.mark.parametrize(
    ("data", "firmware", "code", "said"),
    [
        (b"ab!", SLEEPS, 3, "fails as recorded: no_fault: tick "),
        (b"ab!", POLLS, 3, "fails as recorded: no_fault: tick "),
        (b"ab?", SLEEPS, 1, "fails as recorded: never_sleeps: tick "),
    ],
)
def test_a_case_fails_again_as_recorded(tmp_path, data, firmware, code, said):
    _, again = rerun_bare_case(case(tmp_path, data, firmware), image(firmware))
    assert (again.code, bool(again.failures)) == (code, True)
    assert again.texts[0].startswith(said)


def test_a_case_of_a_check_needs_that_check(tmp_path):
    path = case(tmp_path, b"abc", check=CHECK)
    file = tmp_path / "mycheck.py"
    file.write_text(WRONG.replace("short", "too_long"))
    _, again = rerun_bare_case(path, image(SLEEPS), f"{file}:too_long")
    assert (again.code, again.texts[0].partition(":")[0]) == (1, "fails as recorded")
    assert again.texts[0].endswith("3 are too many")
    with pytest.raises(
        BadInput, match="names the check 'too_long', which is not installed; give it: --check "
    ):
        rerun_bare_case(path, image(SLEEPS))
    file.write_text(WRONG)
    with pytest.raises(BadInput, match="is a case of the check 'too_long', and --check gives 'short'"):
        rerun_bare_case(path, image(SLEEPS), f"{file}:short")


def test_a_case_runs_no_program_that_it_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "evil.py").write_text("open('was_run', 'w')\ndef f(run):\n    return None\n")
    path = case(tmp_path, b"abc", check=CHECK)
    honest = path.read_text()
    for name in ("evil.py:f", f"{tmp_path}/evil.py:f", "./evil.py:f", "evil:f", "evil"):
        path.write_text(honest.replace("too_long = true", f'"{name}" = true'))
        with pytest.raises(BadInput, match="which is not installed"):
            rerun_bare_case(path, image(SLEEPS))
        with pytest.raises(BadInput, match="and --check gives 'f'"):
            rerun_bare_case(path, image(SLEEPS), f"{tmp_path}/evil.py:f")
        assert not (tmp_path / "was_run").exists()


NO_TICKS = ("bit_ticks = 1152", 'bit_ticks = "x"')
HEADERS = {
    ("#: [bare]", "#: [set]"): "says nothing of a bare processor",
    ("bit_ticks = 1152", "bit_ticks = 1"): "a bit of 1 ticks is outside 32..24000000",
    ("bit_ticks = 1152", ""): "says no bit_ticks; give the length of a bit",
    NO_TICKS: "header: bare.bit_ticks: expected a whole number, got a string; mend the value",
    ("crystal_hz = 24000000", "crystal_hz = 5"): "crystal 5 Hz is outside",
    ("begin_tick = ", "begin_tick = -1"): "begin_tick -1",
    ("no_fault = true", "no_fault = true\n#: never_sleeps = true"): "a case has one check",
}


@pytest.mark.parametrize("change", HEADERS)
def test_a_header_that_says_nothing_useful_is_refused(tmp_path, change):
    path = case(tmp_path, b"ab!")
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change))
    with pytest.raises(BadInput) as caught:
        rerun_bare_case(path, image(SLEEPS))
    assert HEADERS[change] in str(caught.value)
    assert str(caught.value).startswith(str(path))


def stream_of(tmp_path, said, end_tick):
    """A stream for a bare processor that expects nothing."""
    path = tmp_path / "x.stream"
    path.write_text(case_text(image(SLEEPS), BareTarget(image(SLEEPS), "bytes").line, said, end_tick))
    return path


def test_characters_that_overlap_are_refused(tmp_path):
    path = stream_of(tmp_path, [Transmission(5000, DOWN, b"ab"), Transmission(5100, DOWN, b"c")], 9000)
    with pytest.raises(BadInput, match="the characters at tick 5100 begin before those before them end"):
        rerun_bare_case(path, image(SLEEPS))


@pytest.mark.parametrize(("data", "code"), [(b"ab", 0), (b"a!", 3)])
def test_a_stream_that_expects_nothing_is_judged_by_faults(tmp_path, data, code):
    path = stream_of(tmp_path, [Transmission(5000, DOWN, data)], 200_000)
    assert rerun_bare_case(path, image(SLEEPS))[1].code == code


def test_a_reset_starts_the_firmware_anew(tmp_path):
    line = BareTarget(image(SLEEPS), "bytes").line
    resets = [Reset(40_000, 0, 0, 1), Reset(40_048, 0, 0, 0)]
    said = [Transmission(5000, DOWN, b"a?"), *resets, Transmission(80_000, DOWN, b"b")]
    run = BarePlayback(image(SLEEPS), line, said, 200_000).play()
    assert run.processor.exchange().sent_bytes == b"ab"
    assert run.idle


def test_a_processor_that_is_put_back_to_before_its_fault_has_none():
    line = BareTarget(image(SLEEPS), "bytes").line
    run = BarePlayback(image(SLEEPS), line, [Transmission(50_000, DOWN, b"!")], 200_000)
    run.to(40_000)
    before = snapshot(run.processor)
    assert run.play().processor.fault()
    restore(run.processor, before)
    run.put_back()
    assert run.processor.fault() is None


def test_the_bare_machine_of_fw_run_has_the_same_fault_from_the_levels_on_its_pin():
    target = BareTarget(image(SLEEPS), "session")
    data = b"\x09\x01ab" + b"\x0a\x05" + b"\x0e\x00\x07\x01c!" + b"\x09\x00!"
    assert target.run(data)
    events = []
    for one in target.script(data):
        tick = one.tick
        for at, value in enumerate(one.data):
            levels = [0, *(value >> place & 1 for place in range(8)), 0 if at in one.bad_stop else 1]
            events += [PinEvent(tick + place * 1152, 3, 0, level) for place, level in enumerate(levels)]
            events += [PinEvent(tick + 9 * 1152 + 864, 3, 0, 1)] if at in one.bad_stop else []
            tick += 11_520
    machine = Alone(image(SLEEPS), pins=tuple(events))
    machine.run(max_cycles=100_000)
    assert (machine.faults[0].tick, machine.faults[0].pc) == (target.failure.tick, target.failure.pc)


# Checks in Python: finding them by name, and what they may say

SOURCE = """
limit = 3

def quiet(run):
    return None

def loud(run):
    return f"too\\n  {run}"

def odd(run):
    return 5

def broken(run):
    return run.nothing

def leaves(run):
    raise SystemExit(0)
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mycheck.py"
    path.write_text(SOURCE)
    return path


def test_a_function_of_a_file(file):
    found = check_named(f"{file}:loud")
    assert (found.name, found.from_file) == ("loud", True)
    assert found.judge("loud") == "too loud"
    assert check_named(f"{file}:quiet").judge("anything") is None


NO_ATTRIBUTE = "raised AttributeError: 'str' object has no attribute 'nothing'"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("odd", "returned 5 ({file}:10 in odd); return None, or what is wrong as text"),
        ("leaves", "raised SystemExit: 0 ({file}:17 in leaves); repair the check"),
        ("broken", f"{NO_ATTRIBUTE} ({{file}}:14 in broken); repair the check"),
    ],
)
def test_a_check_that_fails_itself_says_where(file, name, said):
    with pytest.raises(BadInput) as caught:
        check_named(f"{file}:{name}").judge("text")
    assert str(caught.value).endswith(said.format(file=file))
    assert f"--check {file}:{name}" in str(caught.value)


def test_what_is_no_check_is_refused(file, tmp_path):
    for text, said in (
        (f"{file}:nothing", "there is no function 'nothing'; it has quiet, loud, odd, broken"),
        (f"{file}:limit", "there is no function 'limit'"),
        (f"{tmp_path}/none.py:f", "there is no such file"),
        ("nothing", "there is no check 'nothing' for a bare processor; give FILE.py:FUNCTION"),
    ):
        with pytest.raises(BadInput) as caught:
            check_named(text)
        assert said in str(caught.value)
    file.write_text("raise RuntimeError('no')")
    with pytest.raises(BadInput, match=r"cannot be run: RuntimeError: no \(.*mycheck.py:1\); repair it"):
        check_named(f"{file}:quiet")


def test_two_checks_of_one_name_are_an_error_that_names_both(tmp_path, monkeypatch):
    source = "def wrong(run):\n    return 'wrong'\n"
    for number in "12":
        folder = tmp_path / number
        parts = {"always_wrong": f"check_{number}:wrong", "no_fault": f"check_{number}:wrong"}
        distribution.install(
            folder, f"theirs-{number}", "1.0", parts, "bare_checks", **{f"check_{number}": source}
        )
        monkeypatch.syspath_prepend(folder)
    with pytest.raises(BadInput) as caught:
        check_named("always_wrong")
    for place in ("theirs-1 1.0 (check_1:wrong)", "theirs-2 1.0 (check_2:wrong)"):
        assert place in str(caught.value)
    both = r"check 'no_fault' is in mirotwin \(always on\) and in theirs-"
    with pytest.raises(BadInput, match=both):
        check_named("no_fault")
    with pytest.raises(BadInput, match=both):
        rerun_bare_case(case(tmp_path, b"ab!"), image(SLEEPS))


@pytest.mark.parametrize("name", ["no_fault", "never_sleeps"])
def test_a_check_in_a_file_does_not_take_the_name_of_one_that_is_always_on(tmp_path, name):
    """A case that says this name is about our own, so the file's would never be asked again."""
    path = tmp_path / "mine.py"
    path.write_text(f"def {name}(run):\n    return 'wrong'\n")
    with pytest.raises(
        BadInput, match=rf"check '{name}' is in mirotwin \(always on\), too; give the function"
    ):
        check_named(f"{path}:{name}")


def test_a_distribution_may_bring_one(tmp_path, monkeypatch):
    parts = {
        "always_wrong": "their_check:wrong",
        "no_function": "their_check:text",
        "absent": "their_check:absent",
    }
    source = "text = 'x'\n\ndef wrong(run):\n    return 'wrong'\n"
    distribution.install(tmp_path, "theirs", "1.0", parts, "bare_checks", their_check=source)
    monkeypatch.syspath_prepend(tmp_path)
    found = check_named("always_wrong")
    assert (found.judge(None), found.from_file, found.name) == ("wrong", False, "always_wrong")
    with pytest.raises(BadInput, match="is no function"):
        check_named("no_function")
    with pytest.raises(BadInput, match="cannot be imported: AttributeError"):
        check_named("absent")
    sys.modules.pop("their_check")


def test_a_case_of_a_fault_finds_it_in_a_build_that_comes_to_it_later(tmp_path):
    slower = SLEEPS.replace("LJMP 4000h", "MOV R7,#0FFh\nDJNZ R7,$\nLJMP 4000h")
    _, again = rerun_bare_case(case(tmp_path, b"ab!"), image(slower))
    assert (again.verdict, again.texts[0].partition(":")[0]) == ("fault", "still fails, but not as recorded")


def test_a_stream_ends_where_it_says_also_before_its_last_line(tmp_path):
    said = [Transmission(5000, DOWN, b"a"), Transmission(100_000, DOWN, b"!")]
    found, verdict = rerun_bare_case(stream_of(tmp_path, said, 50_000), image(SLEEPS))
    assert (verdict.verdict, found.end_tick) == ("passed", 50_000)
