"""Crashes of a board alone as files: the same verdict again, here and elsewhere; and checks of one's own for it."""

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol.actions import Reset
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.image import load_hex
from miro_sim.scenario.terminal import PinEvent
from mirotwin.fuzz.board_target import BoardTarget
from mirotwin.fuzz.oracle import BoardOracle
from mirotwin.runs.board_case import board_spec
from mirotwin.runs.job import load_stream
from mirotwin.runs.run import Run
from mirotwin.verify.checks.interface import Check, Monitor
from mirotwin.verify.expectations import as_settings, checks_alone
from tests.alone import Alone
from tests.exact import distribution
from tests.mirotwin.conftest import hex_file
from tests.mirotwin.verify.firmwares import POLLS, SLEEPS, image
from tests.mirotwin.verify.own_checks import check_of, source_of
from tests.robot.mcs51.asm import assemble

WRONG = "len(self.sent) > 2", "f'{len(self.sent)} are too many'"


def too_long(monitor):
    return f"{len(monitor.sent)} are too many" if len(monitor.sent) > 2 else None


CHECKS = [check_of("too_long", too_long)]


def program(folder, firmware):
    return hex_file(folder / "program.ihx", assemble(firmware))


def case(tmp_path, data, firmware=SLEEPS, checks=()):
    """The file of what a target finds in `data`."""
    check_of("too_long", too_long)
    target = BoardTarget(load_hex(program(tmp_path, firmware)), "bytes", checks=checks)
    assert target.run(data)
    found = target.failure
    path = tmp_path / "crash.stream"
    path.write_text(BoardOracle(target, {}).confirm(data, found).case())
    return path


def played(path, firmware):
    """A case played again on a program: the run, and what it comes to."""
    job = load_stream(f"{path}", f"{program(path.parent, firmware)}")
    run = job.run(job.case.end_tick)
    return run, job.result_of_case(run)


@pytest.mark.parametrize(
    ("data", "firmware", "code", "said"),
    [
        (b"ab!", SLEEPS, 3, "fails as recorded: no_fault: tick "),
        (b"ab!", POLLS, 3, "fails as recorded: no_fault: tick "),
        (b"ab?", SLEEPS, 1, "fails as recorded: never_sleeps: tick "),
    ],
)
def test_a_case_fails_again_as_recorded(tmp_path, data, firmware, code, said):
    _, again = played(case(tmp_path, data, firmware), firmware)
    assert (again.code, len(again.failures)) == (code, 1)
    assert again.texts[0].startswith(said)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mycheck.py"
    path.write_text(source_of("TooLong", "too_long", *WRONG) + source_of("Other", "other", *WRONG))
    return path


def test_a_case_of_a_check_needs_that_check(tmp_path, file):
    path = case(tmp_path, b"abc", checks=CHECKS)
    as_settings([f"{file}:TooLong"])
    _, again = played(path, SLEEPS)
    assert (again.code, again.texts[0].partition(":")[0]) == (1, "fails as recorded")
    assert again.texts[0].endswith("3 are too many")
    for others in ((), (f"{file}:Other",)):
        as_settings(others)
        with pytest.raises(BadInput, match=r"expect\.too_long: there is no such check"):
            played(path, SLEEPS)


def test_a_case_runs_no_program_that_it_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = case(tmp_path, b"abc", checks=CHECKS)
    source = source_of("Evil", "evil", "True", "'evil'")
    (tmp_path / "evil.py").write_text(f"open('was_run', 'w')\n{source}")
    as_settings(())
    honest = path.read_text()
    for name in ("evil.py:Evil", f"{tmp_path}/evil.py:Evil", "./evil.py:Evil", "evil:Evil", "evil"):
        path.write_text(honest.replace("too_long = true", f'"{name}" = true'))
        with pytest.raises(BadInput, match="there is no such check"):
            played(path, SLEEPS)
        assert not (tmp_path / "was_run").exists()


NO_TICKS = ("bit_ticks = 1152", 'bit_ticks = "x"')
HEADERS = {
    ("bit_ticks = 1152", "bit_ticks = 1"): "a bit of 1 ticks is outside 32..24000000",
    ("bit_ticks = 1152", ""): "says no bit_ticks; give the length of a bit",
    NO_TICKS: "header: bare.bit_ticks: expected a whole number, got a string; mend the value",
    ("crystal_hz = 24000000", "crystal_hz = 5"): "crystal 5 Hz is outside",
    ("begin_tick = ", "begin_tick = -1"): "begin_tick -1",
}


@pytest.mark.parametrize("change", HEADERS)
def test_a_header_that_says_nothing_useful_is_refused(mirotwin, tmp_path, change):
    path = case(tmp_path, b"ab!")
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change))
    file = hex_file(tmp_path / "a.ihx", assemble(SLEEPS))
    err = mirotwin.refuses("replay", path, "--firmware", file)
    assert HEADERS[change] in err
    assert err.startswith(str(path))


def stream_of(tmp_path, said, end_tick):
    """A stream for a board alone that expects nothing."""
    path = tmp_path / "x.stream"
    target = BoardTarget(image(SLEEPS), "bytes")
    head = f"# mirotwin stream 2\n#: end_tick = {end_tick}\n#: [bare]\n#: bit_ticks = {target.scenario.bit_ticks}\n"
    head += f"#: begin_tick = {target.scenario.begin_tick}\n"
    path.write_text(head + "".join(f"{one.tick} > {one.data.hex(' ')}\n" for one in said))
    return path


def test_characters_that_overlap_are_refused(tmp_path):
    path = stream_of(tmp_path, [Transmission(5000, DOWN, b"ab"), Transmission(5100, DOWN, b"c")], 9000)
    with pytest.raises(BadInput, match="the characters at tick 5100 begin before those before them end"):
        played(path, SLEEPS)


@pytest.mark.parametrize(("data", "code"), [(b"ab", 0), (b"a!", 3)])
def test_a_stream_that_expects_nothing_is_judged_by_faults(tmp_path, data, code):
    path = stream_of(tmp_path, [Transmission(5000, DOWN, data)], 200_000)
    assert played(path, SLEEPS)[1].code == code


def run_of(said, end_tick, expect=None):
    """A script played to firmware that sleeps."""
    scenario = BoardTarget(image(SLEEPS), "bytes").scenario
    return Run.traced(board_spec(image(SLEEPS), scenario, said, expect or {}, end_tick))


def test_a_reset_starts_the_firmware_anew():
    resets = [Reset(40_000, 0, 0, 1), Reset(40_048, 0, 0, 0)]
    said = [Transmission(5000, DOWN, b"a?"), *resets, Transmission(80_000, DOWN, b"b")]
    check_of("too_long", too_long)
    run = run_of(said, 200_000, {"too_long": True}).play()
    (monitor,) = (one for one in run.checks.monitors if one.check.name == "too_long")
    assert (monitor.sent_bytes, monitor.sent_since_reset) == (b"ab", b"b")
    assert run.checks.sleep.slept


def test_an_answer_that_is_under_way_at_the_end_belongs_to_the_run():
    """`b` comes in within the last characters of the run, and its answer takes another."""
    check_of("too_long", too_long)
    run = run_of([Transmission(5000, DOWN, b"aab")], 5000 + 3 * 11_520, {"too_long": True}).play()
    assert [failure.found for failure in run.failures] == ["3 are too many"]


def test_the_case_of_a_run_is_the_script_that_was_played(tmp_path):
    path = case(tmp_path, b"ab!")
    run, _ = played(path, SLEEPS)
    assert run.case() == path.read_text()


def test_fw_run_has_the_same_fault_from_the_levels_on_its_pin():
    target = BoardTarget(image(SLEEPS), "session")
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


# Checks of one's own, and what they may say


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("self.nothing", "AttributeError: 'OwnMonitor' object has no attribute 'nothing'"),
        ("exit(0)", "SystemExit: 0"),
    ],
)
def test_a_check_that_fails_itself_says_where(mirotwin, tmp_path, file, wrong, said):
    path = case(tmp_path, b"abc", checks=CHECKS)
    source = source_of("TooLong", "too_long", wrong, "''")
    file.write_text(source)
    line = 1 + source[: source.index(wrong)].count("\n")
    as_settings([f"{file}:TooLong"])
    with pytest.raises(BadInput) as caught:
        played(path, SLEEPS)
    assert (
        f"check 'too_long' cannot judge: {said} ({file}:{line} in OwnMonitor.end); repair the check"
        in str(caught.value)
    )


class OfRobots(Check, frozen=True, kw_only=True, tag="of_robots"):
    KIND = "safety"

    def monitor(self, subject):
        return Monitor(self, subject)


def test_a_check_of_robots_cannot_be_observed_on_a_board_alone():
    check_of("of_robots", lambda monitor: None)
    from mirotwin.verify.checks.expect import CHECKS as known

    known.in_files["of_robots"] = OfRobots
    run = run_of([], 100_000, {"of_robots": True}).play()
    verdict = next(one for one in run.checks.verdicts() if one.name == "of_robots")
    assert (verdict.verdict, verdict.reason) == ("not observable", "it judges robots")
    assert run.checks.verdict() == "passed"


def test_two_checks_of_one_name_are_an_error_that_names_both(tmp_path, monkeypatch):
    source = source_of("Wrong", "always_wrong", "True", "'wrong'")
    for number in "12":
        folder = tmp_path / number
        parts = {"always_wrong": f"check_{number}:Wrong", "no_fault": f"check_{number}:Wrong"}
        distribution.install(
            folder, f"theirs-{number}", "1.0", parts, "checks", **{f"check_{number}": source}
        )
        monkeypatch.syspath_prepend(folder)
    with pytest.raises(BadInput) as caught:
        checks_alone(["always_wrong"])
    for place in ("theirs-1 1.0 (check_1:Wrong)", "theirs-2 1.0 (check_2:Wrong)"):
        assert place in str(caught.value)
    with pytest.raises(BadInput, match=r"check 'no_fault' is in mirotwin \(.*\) and in theirs-"):
        checks_alone(["no_fault"])


def test_a_distribution_may_bring_one(tmp_path, monkeypatch):
    source = source_of("Wrong", "installed_wrong", "True", "'wrong'")
    distribution.install(
        tmp_path, "theirs", "1.0", {"installed_wrong": "their_check:Wrong"}, "checks", their_check=source
    )
    monkeypatch.syspath_prepend(tmp_path)
    (check,) = checks_alone(["installed_wrong"])
    target = BoardTarget(image(SLEEPS), "bytes", checks=[check])
    assert target.run(b"a")
    assert (target.failure.check, target.failure.what) == ("installed_wrong", "wrong")


def test_a_case_of_a_fault_finds_it_in_a_build_that_comes_to_it_later(tmp_path):
    slower = SLEEPS.replace("LJMP 4000h", "MOV R7,#0FFh\nDJNZ R7,$\nLJMP 4000h")
    _, again = played(case(tmp_path, b"ab!"), slower)
    assert (again.verdict, again.texts[0].partition(":")[0]) == ("fault", "still fails, but not as recorded")


def test_a_stream_ends_where_it_says_also_before_its_last_line(tmp_path):
    said = [Transmission(5000, DOWN, b"a"), Transmission(100_000, DOWN, b"!")]
    run, again = played(stream_of(tmp_path, said, 50_000), SLEEPS)
    assert (again.verdict, run.world.tick) == ("passed", 50_000)
