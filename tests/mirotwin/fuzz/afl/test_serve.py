"""The target process beside a fake AFL++, and without any."""

import os
import signal
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mirotwin.fuzz.afl.job import read_executions
from mirotwin.fuzz.afl.serve import (
    CASES_VARIABLE,
    FIRST_SIGNAL,
    MAP_VARIABLE,
    RUNS_A_COUNT,
    attach,
    wait_status,
)
from tests import children
from tests.mirotwin.fuzz.afl.double import MAP_SIZE, WORD, Double, spec
from tests.mirotwin.fuzz.afl.fake_afl import CASES_BYTES, ROOT, FakeAfl


def by_hand(specification, data):
    """Exit code, standard output and standard error of a run without AFL++."""
    text = specification if isinstance(specification, str) else specification.text()
    command = [sys.executable, "-m", "mirotwin.fuzz.afl.serve", text]
    done = children.run(command, input=data, capture_output=True, cwd=ROOT)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def test_the_first_word_says_options_size_of_the_map_and_shared_memory():
    with FakeAfl(spec()) as afl:
        said = afl.hello()
        assert said & 0x8000_0001 == 0x8000_0001
        assert said & 0x4000_0000, "the size of the map follows"
        assert ((said & 0x00FF_FFFE) >> 1) + 1 == MAP_SIZE
        assert said & 0x0100_0000, "test cases come through shared memory"
        assert not said & 0x3000_0000, "neither a snapshot module nor a dictionary"
        assert afl.end() == 0


def test_the_process_that_is_told_cannot_exist():
    with FakeAfl(spec()) as afl:
        afl.hello()
        process, _ = afl.run(b"hello")
        assert process > int(Path("/proc/sys/kernel/pid_max").read_text())
        afl.end()


def test_edges_are_counted_in_the_memory_of_afl():
    with FakeAfl(spec()) as afl:
        afl.hello()
        assert afl.run(b"DUC") == (afl.run(b"DUC")[0], 0)
        assert bytes(afl.edges.memory[:MAP_SIZE]) == b"\0\1\1\1\1".ljust(MAP_SIZE, b"\0")
        afl.run(b"hello")
        assert bytes(afl.edges.memory) == b"\0\1".ljust(len(afl.edges.memory), b"\0")
        afl.end()


@pytest.mark.parametrize("kind", [1, 2, 8, 93])
def test_the_signal_of_a_find_tells_its_kind(kind):
    with FakeAfl(spec(kind=kind)) as afl:
        afl.hello()
        status = afl.run(WORD)[1]
        assert os.WIFSIGNALED(status)
        assert os.WTERMSIG(status) - FIRST_SIGNAL == kind - 1
        assert afl.run(b"hello")[1] == 0
        afl.end()


@given(st.integers(1, 255))
def test_each_kind_of_finding_is_a_signal_that_kills(kind):
    status = wait_status(kind)
    assert os.WIFSIGNALED(status)
    assert os.WTERMSIG(status) > signal.SIGSYS, "none that a program dies of by itself"


@pytest.mark.slow
def test_one_process_answers_a_thousand_inputs_as_the_target_itself_does():
    own = Double()
    with FakeAfl(spec()) as afl:
        afl.hello()
        seen = {}

        @settings(max_examples=1000, database=None)
        @given(st.binary(max_size=8) | st.binary(max_size=4).map(lambda tail: WORD + tail))
        def one(data):
            status = afl.run(data)[1]
            assert status == wait_status(own.run(data))
            seen.setdefault(data, status)
            assert seen[data] == status

        one()
        assert len(set(seen.values())) == 2
        assert afl.end() == 0


def test_a_length_beyond_the_segment_is_cut_to_it():
    with FakeAfl(spec()) as afl:
        afl.hello()
        afl.cases.memory[:4] = (1 << 31).to_bytes(4, "little")
        afl.cases.memory[4:8] = WORD
        os.write(afl.control, bytes(4))
        assert os.WIFSIGNALED(int.from_bytes(afl._read(8)[4:], "little"))
        afl.end()


def test_executions_are_kept_and_counted_on(tmp_path):
    beside = str(tmp_path / "main")
    for times in (1, 2):
        with FakeAfl(spec(), beside) as afl:
            afl.hello()
            for _ in range(RUNS_A_COUNT):
                afl.run(b"hello")
            afl.end()
        assert read_executions(tmp_path / "main.counts") == RUNS_A_COUNT * times
    assert not (tmp_path / "main.target").exists(), "there was nothing to complain of"


@given(content=st.binary(max_size=30).filter(lambda content: len(content) != 8))
def test_a_count_that_is_not_whole_is_zero(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("counts") / "main.counts"
    path.write_bytes(content)
    assert read_executions(path) == 0


def test_the_server_ends_when_afl_closes_its_pipes_before_the_answer():
    with FakeAfl(spec()) as afl:
        afl.hello()
        os.close(afl.status)
        os.write(afl.control, bytes(4))
        os.close(afl.control)
        assert afl.server.wait(20) == 0
        assert afl.server.stderr.read() == ""


def test_the_server_ends_when_afl_does_not_answer_its_first_word():
    with FakeAfl(spec()) as afl:
        assert afl.end() == 0


def test_a_target_that_raises_is_told_in_a_file(tmp_path):
    with FakeAfl(spec(raises=True), str(tmp_path / "main")) as afl:
        afl.hello()
        afl.run(b"!")
        assert afl.end() == 70
    assert (tmp_path / "main.target").read_text().splitlines()[-1] == "RuntimeError: the double raises"


@pytest.mark.parametrize(
    ("variable", "remedy"), [(MAP_VARIABLE, "by afl-fuzz"), (CASES_VARIABLE, "4.00c or newer")]
)
def test_an_afl_without_shared_memory_is_refused(variable, remedy):
    with FakeAfl(spec(), without=variable) as afl:
        afl.hello()
        assert afl.end() == 2
        said = afl.server.stderr.read()
        assert variable in said
        assert remedy in said
        assert said.count("\n") == 1


def test_shared_memory_that_is_not_there_is_an_error():
    with pytest.raises(OSError, match="shared memory 2147483647: Invalid argument"):
        attach(0x7FFF_FFFF)


def test_attached_memory_is_as_long_as_it_was_made():
    with FakeAfl(spec()) as afl:
        assert len(afl.edges.memory) == 65536
        assert len(afl.cases.memory) == CASES_BYTES


# ---- without AFL++ -----------------------------------------------------------------------------------------


def test_without_afl_standard_input_is_run_once_and_told():
    assert by_hand(spec(), WORD + b"Y") == (1, "word: found at 4 (tick 24, PC 0x0004)\n44 55 43 4b 59\n", "")
    assert by_hand(spec(), b"hello") == (0, "nothing found\n", "")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "target: Input data was truncated; give JSON with board, image,"),
        ('{"board": "x"}', "target: Invalid enum value 'x' - at `$.board`; "),
        ('{"bord": "miro"}', "target: Object contains unknown field `bord`; "),
        ('{"robots": -1}', "target: Expected `int` >= 0 - at `$.robots`; "),
        (
            '{"maker": "no_such:thing"}',
            "target: maker: no_such:thing: No module named 'no_such'; write it as",
        ),
        ('{"maker": "os:nothing"}', "target: maker: os:nothing: module 'os' has no attribute 'nothing'; "),
    ],
)
def test_a_specification_that_cannot_be_used_is_one_line_and_exit_code_2(text, said):
    code, out, err = by_hand(text, b"")
    assert (code, out) == (2, "")
    assert err.startswith(said)
    assert err.count("\n") == 1
