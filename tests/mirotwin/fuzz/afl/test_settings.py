"""What afl-fuzz is given: seeds, a dictionary, its command line and its cores; and what its errors come to."""

import ast
import os
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ServiceFrame, TeamFrame, decode_fields
from miro_protocol.table import ROBOT_COUNTS, SYNC, downlink
from mirotwin.fuzz.afl import run
from mirotwin.fuzz.afl.run import why_ended
from mirotwin.fuzz.afl.settings import REASONS, environment, job_name, line, missing
from mirotwin.fuzz.engine import LONGEST_BYTES, EngineInput, write_dictionary, write_seeds
from mirotwin.fuzz.inputs import message_tokens, wire_tokens
from mirotwin.fuzz.spec import TargetSpec, spec_of


def test_one_job_is_not_distributed_and_several_are():
    alone, main, other = (
        line(EngineInput("{}", Path("seeds"), Path("out"), Path("words"), jobs, seed=7), job)
        for job, jobs in ((0, 1), (0, 2), (1, 2))
    )
    assert not {"-M", "-S"} & set(alone)
    assert main[main.index("-M") + 1] == "main"
    assert other[other.index("-S") + 1] == "job1"
    assert [words[words.index("-s") + 1] for words in (main, other)] == ["7", "8"]
    server = [sys.executable, "-P", "-m", "mirotwin.fuzz.afl.serve", "{}"]
    assert alone[alone.index("--") + 1 :] == [*server, "out/default"]
    assert alone[alone.index("-x") + 1] == "words"


def test_what_is_not_asked_for_is_not_on_the_command_line():
    assert not {"-x", "-s"} & set(line(EngineInput("{}", Path("seeds"), Path("out")), 0))


@given(image=st.text("@/x", max_size=8))
def test_no_specification_holds_what_afl_replaces_by_the_name_of_a_file(image):
    one = TargetSpec(image=image)
    assert "@@" not in one.text()
    assert spec_of(one.text()) == one


def test_a_folder_whose_name_afl_would_replace_is_refused():
    with pytest.raises(BadInput, match="out@@: afl-fuzz puts the name of a file for @@; choose another"):
        line(EngineInput("{}", Path("seeds"), Path("out@@")), 0)


def test_our_settings_win_and_others_are_passed_on():
    found = environment({"AFL_MAP_SIZE": "65536", "AFL_SHUFFLE_QUEUE": "1", "HOME": "/h"})
    assert found["AFL_MAP_SIZE"] == "8192"
    assert found["AFL_SHUFFLE_QUEUE"] == "1"
    assert found["HOME"] == "/h"
    assert all(found[name].isdecimal() for name in REASONS)


def test_the_first_of_several_jobs_is_the_main_one():
    assert [job_name(job, 3) for job in range(3)] == ["main", "job1", "job2"]
    assert job_name(0, 1) == "default"


def test_what_is_missing_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    remedy = "install AFL++ (Debian, Ubuntu: `apt install afl++`)"
    assert missing() == f"afl-fuzz is not on the PATH; {remedy}"


# ---- cores -------------------------------------------------------------------------------------------------


def process(proc, number, allowed, kernel=False):
    """A process as `man 5 proc` describes its status."""
    (proc / str(number)).mkdir(parents=True)
    memory = "" if kernel else "VmSize:\t    8548 kB\n"
    (proc / str(number) / "status").write_text(f"Name:\tx\n{memory}Cpus_allowed_list:\t{allowed}\n")


def test_the_core_to_which_the_fewest_are_bound_comes_first(tmp_path):
    free = sorted(os.sched_getaffinity(0))
    for number in range(3):
        process(tmp_path, 10 + number, str(free[0]))
    process(tmp_path, 20, f"{free[0]}-{free[-1]}" if len(free) > 1 else "0-63")
    process(tmp_path, 30, str(free[-1]), kernel=True)
    (tmp_path / "40").mkdir()
    assert run.bound(tmp_path) == {free[0]: 3}
    assert run.cores_for(1, tmp_path) == [free[1 % len(free)]]
    assert sorted(run.cores_for(2 * len(free), tmp_path)) == sorted(2 * free)


def test_more_jobs_than_cores_are_told():
    count = len(os.sched_getaffinity(0))
    assert run.shared_cores(count) == []
    assert f"; --jobs {count} makes as many executions" in run.shared_cores(count + 1)[0]


# ---- errors ------------------------------------------------------------------------------------------------

ABORT = """\
\x1b[1;94m[*] \x1b[0mGetting to work...\x1b[0m
\x1b[?25h\x1b[0m\x1b[1;91m
[-] PROGRAM ABORT : \x1b[0m%s\x1b[1;91m
         Location : \x1b[0mmain(), src/afl-fuzz.c:1234

"""
OS_ERROR = """\
[-]  SYSTEM ERROR : \x1b[0mUnable to create 'out'\x1b[1;91m
    Stop location : \x1b[0msetup_dirs_fds(), src/afl-fuzz-init.c:1869
       OS message : \x1b[0mRead-only file system
"""


def said(folder, output, complaint=""):
    (folder / "main.log").write_text(output)
    (folder / "main.target").write_text(complaint)
    return f"{why_ended(folder / 'main.log', folder / 'main.target')}"


def test_the_message_of_the_system_is_quoted_too(tmp_path):
    told = "Unable to create 'out' (Read-only file system); choose a folder that can be written to"
    assert told in said(tmp_path, OS_ERROR)


def test_what_the_target_complained_of_is_the_cause(tmp_path):
    output = ABORT % "Fork server handshake failed"
    assert said(tmp_path, output, "x.ihx:3: no hex\n") == f"{tmp_path}/main.target:1: x.ihx:3: no hex"
    long = said(tmp_path, output, "Traceback\n  File x\nKeyError: 3\n")
    assert long == f"{tmp_path}/main.target:3: KeyError: 3; whole text: {tmp_path}/main.target"


@pytest.mark.parametrize("output", ["", "\n \n", "Segmentation fault\n"])
def test_an_end_without_a_reason_shows_the_last_line(tmp_path, output):
    assert (output.strip() or "it said nothing") in said(tmp_path, output)


# ---- seeds and dictionaries ---------------------------------------------------------------------------------


def read_back(path):
    """The strings of a dictionary, by Python's reader of byte strings."""
    return [ast.literal_eval(f"b{line}") for line in path.read_text(encoding="ascii").splitlines()]


@given(st.lists(st.binary(min_size=1, max_size=128)))
def test_each_string_of_a_dictionary_is_written_once(tmp_path_factory, tokens):
    path = tmp_path_factory.mktemp("dictionary") / "words"
    write_dictionary(path, tokens)
    assert read_back(path) == list(dict.fromkeys(tokens))


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
def test_the_strings_of_the_wire_hold_sync_preamble_and_whole_frames(robots):
    tokens = wire_tokens(robots)
    assert {SYNC, downlink(robots).lead} <= set(tokens)
    frames = [token for token in tokens if len(token) == downlink(robots).wire_size]
    received = [event for frame in frames for event in Decoder(robots).feed(frame)]
    messages = [decode_fields(event.body, robots) for event in received if isinstance(event, Received)]
    assert sum(isinstance(message, TeamFrame) for message in messages) == 2
    assert sum(isinstance(message, ServiceFrame) for message in messages) == 3


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
def test_all_our_strings_fit_a_dictionary(robots):
    tokens = [*wire_tokens(robots), *message_tokens(robots)]
    assert len(set(tokens)) > 20
    assert all(1 <= len(token) <= 128 for token in tokens)  # MAX_DICT_FILE of afl-fuzz's config.h


def test_seeds_are_written_one_a_file_and_cut(tmp_path):
    long = bytes(range(256)) * 17
    write_seeds(tmp_path / "seeds", [b"x", long])
    left = {path.name: path.read_bytes() for path in (tmp_path / "seeds").iterdir()}
    assert left == {"seed-0000": b"x", "seed-0001": long[:LONGEST_BYTES]}
