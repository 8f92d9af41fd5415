"""A run that is broken off: its parts stay, complete files are not touched, and every command reads what there is."""

import errno
import json
import os
import re
import signal
import sys

import pytest

from miro_exact.bad_input import BadInput
from miro_exact.domain import DomainError
from miro_sim.world.world import World
from mirotwin.recording import reader as recording_reader
from mirotwin.run import run_files
from mirotwin.shell.outputs import OutputFolder
from tests import children
from tests.mirotwin import program

PARTS = ["run.part.mcap", "summary.part.json"]
REPORT = "please report this line with the command (MIROTWIN_TRACEBACK=1 shows the place)"
ROOM = "make room, or choose another folder with --out"


HANDLERS = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
    signal.SIGHUP: signal.SIG_DFL,
}


@pytest.fixture(autouse=True)
def _default_signals():
    """A program in the background of a shell ignores SIGINT, one under nohup SIGHUP: so would the tests here."""
    before = {number: signal.signal(number, handler) for number, handler in HANDLERS.items()}
    yield
    assert {number: signal.signal(number, handler) for number, handler in before.items()} == HANDLERS


def at_period(monkeypatch, index, act):
    """Has `act` called when the world is about to compute control period `index`."""

    class Interrupted(World):
        def step(self):
            if self.index == index:
                act()
            return super().step()

    monkeypatch.setattr("miro_sim.world.world.World", Interrupted)


def raising(error):
    def act():
        raise error

    return act


def names(folder):
    return sorted(path.name for path in folder.iterdir())


ENDINGS = {
    "Ctrl-C": (lambda: signal.raise_signal(signal.SIGINT), 130, "mirotwin: interrupted"),
    "SIGTERM": (lambda: signal.raise_signal(signal.SIGTERM), 143, "mirotwin: ended by SIGTERM"),
    "SIGHUP": (lambda: signal.raise_signal(signal.SIGHUP), 129, "mirotwin: ended by SIGHUP"),
    "a mistake in the program": (raising(ValueError("angle")), 70, f"internal error: ValueError: angle; {REPORT}"),
    "parameters": (raising(DomainError("angle")), 2, "angle; the parameters are far outside those of a real robot"),
    "a full disk": (raising(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))), 2, f"No space left on device; {ROOM}"),
}  # fmt: skip


@pytest.mark.parametrize(("act", "code", "said"), ENDINGS.values(), ids=ENDINGS)
def test_what_was_recorded_stays_as_parts_and_complete_files_stay_as_they_were(
    mirotwin, finished, short, tmp_path, monkeypatch, act, code, said
):
    before = {path.name: path.read_bytes() for path in finished.iterdir()}
    for name, data in before.items():
        (tmp_path / name).write_bytes(data)
    at_period(monkeypatch, 3, act)
    found, out, err = mirotwin("run", short, "--seed", 5, "--out", tmp_path, "--force")
    assert (found, out) == (code, "")
    first, last = filter(None, err.splitlines())  # after ^C, a new line
    part = tmp_path / "run.part.mcap"
    assert first == f"mirotwin: the run broke off after 3 control periods, recorded in {part}"
    assert last.endswith(said)
    assert names(tmp_path) == sorted([*before, *PARTS])
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    recording = recording_reader.read(part)
    whole = recording_reader.read(finished / "run.mcap")
    assert recording.periods == whole.periods[:3]
    assert recording.broken_off
    summary = json.loads((tmp_path / "summary.part.json").read_bytes())
    assert summary["complete"] is False
    assert summary["digest"] == recording.digest
    assert "complete" not in json.loads(before["summary.json"])


def test_both_parts_say_which_part_of_which_robot_failed(mirotwin, short, tmp_path, monkeypatch):
    at_period(monkeypatch, 3, raising(BadInput("net0/robot0", "", "law 'mine' failed")))
    assert mirotwin("run", short, "--out", tmp_path, "-q")[0] == 2
    said = recording_reader.read(tmp_path / "run.part.mcap").broken_off
    assert said.endswith("was broken off: net0/robot0: law 'mine' failed")
    reason = json.loads((tmp_path / "summary.part.json").read_bytes())["reason"]
    assert reason == "net0/robot0: law 'mine' failed"


def test_a_run_that_recorded_nothing_leaves_nothing(mirotwin, short, tmp_path, monkeypatch):
    at_period(monkeypatch, 0, raising(KeyboardInterrupt()))
    assert mirotwin("run", short, "--out", tmp_path / "out") == (130, "", "\nmirotwin: interrupted\n")
    assert names(tmp_path) == []


@pytest.fixture
def parts(mirotwin, short, tmp_path, monkeypatch):
    """The folder of a run that was broken off after three control periods."""
    with monkeypatch.context() as patch:
        at_period(patch, 3, raising(KeyboardInterrupt()))
        assert mirotwin("run", short, "--seed", 5, "--out", tmp_path / "out", "-q")[0] == 130
    assert names(tmp_path / "out") == PARTS
    return tmp_path / "out"


def test_the_next_run_names_the_parts_and_replaces_them_by_force(mirotwin, parts, short, finished):
    err = mirotwin.refuses("run", short, "--seed", 5, "--out", parts)
    assert f"{parts}: the folder holds parts of an interrupted command ({', '.join(PARTS)}); " in err
    assert "with --force" in err
    (parts / "thesis.tex").write_text("years of work")
    assert mirotwin("run", short, "--seed", 5, "--out", parts, "-q", "--force") == (0, "", "")
    assert names(parts) == ["figure.svg", "run.mcap", "summary.json", "thesis.tex"]
    assert (parts / "run.mcap").read_bytes() == (finished / "run.mcap").read_bytes()


def test_replay_compares_as_far_as_it_goes_and_says_so(mirotwin, parts):
    code, out, err = mirotwin("replay", parts / "run.part.mcap")
    assert code == 0
    assert "equals the recorded one in all 3 control periods" in out
    assert err.endswith("the run that wrote it was broken off; it goes to control period 2\n")


@pytest.mark.parametrize("target", ["pcapng", "stream"])
def test_decode_and_export_read_it_and_say_so(mirotwin, parts, tmp_path, target):
    note = f"mirotwin: {parts / 'run.part.mcap'}: the run that wrote it was broken off\n"
    code, out, err = mirotwin("decode", parts / "run.part.mcap")
    assert (code, err) == (0, note)
    assert "team_ask" in out
    out_file = tmp_path / f"x.{target}"
    assert mirotwin.ends(0, "export", parts / "run.part.mcap", "--out", out_file, "-q") == note
    assert out_file.stat().st_size > 0


def killed(parts, more):
    """What is left of the run of `parts` if it is killed `more` bytes into the message after its second period."""
    data = (parts / "run.part.mcap").read_bytes()
    chunk = data.index(b"mirotwin.Posture") - 200
    (parts / "cut.mcap").write_bytes(data[: max(chunk, data.rindex(b'"index":1,') + 10 + 64 + 14 + more)])
    return parts / "cut.mcap"


def test_a_part_of_a_copy_is_compared_too_and_is_bad_input_for_decode(mirotwin, parts):
    path = killed(parts, 30)
    code, out, err = mirotwin("replay", path, "-q")
    assert (code, err.count("\n")) == (0, 1)
    assert "equals the recorded one in all 2 control periods" in out
    said = "the file ends in the middle of a record; it was cut short; .*; it goes to control period 1"
    assert re.search(said, err)
    assert mirotwin("decode", path)[0] == 2


def test_a_second_interruption_waits_until_the_files_are_closed(mirotwin, short, tmp_path, monkeypatch):
    encode = run_files.to_json

    def impatient(summary):
        signal.raise_signal(signal.SIGINT)
        return encode(summary)

    monkeypatch.setattr(run_files, "to_json", impatient)
    with monkeypatch.context() as patch:
        at_period(patch, 3, lambda: signal.raise_signal(signal.SIGTERM))
        assert mirotwin("run", short, "--out", tmp_path / "out", "-q")[0] == 143
    assert names(tmp_path / "out") == PARTS
    assert len(recording_reader.read(tmp_path / "out" / "run.part.mcap").periods) == 3
    assert mirotwin.ends(130, "run", short, "--out", tmp_path / "whole", "-q") == "\nmirotwin: interrupted\n"
    assert names(tmp_path / "whole") == ["figure.svg", "run.mcap", "summary.json"]


def test_two_runs_into_one_folder_the_second_is_refused(mirotwin, short, tmp_path):
    with OutputFolder(tmp_path / "out"):
        for more in ((), ("--force",)):
            said = mirotwin.refuses("run", short, "--out", tmp_path / "out", "-q", *more)
            assert "another process is writing into the folder; wait until it has finished, or" in said
    assert names(tmp_path) == []


def test_a_disk_that_takes_no_more_leaves_complete_files_and_what_it_took(finished, short, tmp_path):
    for path in finished.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    size = (finished / "run.mcap").stat().st_size * 3 // 4

    done = program.run("run", short, "--out", tmp_path, "--force", "-q", preexec_fn=program.full_disk(size))
    assert done.returncode == 2
    assert f"error: {tmp_path}: File too large; {ROOM}" in done.stderr
    for path in finished.iterdir():
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()
    assert recording_reader.read(tmp_path / "run.part.mcap").periods
    assert names(tmp_path) == sorted([*names(finished), *PARTS])


def test_a_closed_stderr_is_no_terminal_and_takes_nothing_away(finished, short, tmp_path):
    done = program.run("run", short, "--seed", 5, "--out", tmp_path / "out", preexec_fn=lambda: os.close(2))
    assert (done.returncode, "digest" in done.stdout) == (0, True)
    assert (tmp_path / "out" / "run.mcap").read_bytes() == (finished / "run.mcap").read_bytes()


def test_an_internal_error_shows_its_place_when_asked(mirotwin, short, tmp_path, monkeypatch):
    at_period(monkeypatch, 0, raising(AssertionError("angle")))
    monkeypatch.setenv("MIROTWIN_TRACEBACK", "1")
    assert "Traceback" in mirotwin("run", short, "--out", tmp_path / "out")[2]


@pytest.mark.slow
def test_killed_runs_leave_recordings_that_lack_half_a_second_at_most():
    words = [sys.executable, "-m", "tests.mirotwin.shell.killed", "--times", "3"]
    done = children.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "3 runs killed, 3 recordings readable" in done.stdout
