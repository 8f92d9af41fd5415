"""The target process beside a fake AFL++, and without any."""

import ctypes
import os
import signal
import struct
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.fuzz.afl import serve
from mirotwin.fuzz.afl.serve import CASES_VARIABLE, MAP_VARIABLE, attach, wait_status
from mirotwin.fuzz.engine import read_executions
from mirotwin.fuzz.spec import TargetSpec
from tests import children
from tests.mirotwin.fuzz.afl.double import MAKER, MAP_SIZE, ROOT, WORD, spec

PRIVATE, CREATE, REMOVE = 0, 0o1000, 0
CASES_BYTES = 4096


class Segment:
    """A segment of shared memory, removed at the end."""

    def __init__(self, size):
        self._library = ctypes.CDLL(None, use_errno=True)
        self.number = self._library.shmget(PRIVATE, ctypes.c_size_t(size), CREATE | 0o600)
        assert self.number >= 0, os.strerror(ctypes.get_errno())
        self.memory = attach(self.number, size)

    def remove(self):
        self._library.shmctl(self.number, REMOVE, None)


class FakeAfl:
    """Starts the server of `spec` and speaks to it. `without`: a variable that it does not get.

    `answers`: whether it answers the server's first word.
    """

    def __init__(self, spec, beside="", without="", answers=True):
        self.answers = answers
        self.edges, self.cases = Segment(65536), Segment(CASES_BYTES)
        to_server, self.control = os.pipe()
        self.status, from_server = os.pipe()

        def prepare():
            os.dup2(to_server, serve.CONTROL_FD)
            os.dup2(from_server, serve.STATUS_FD)

        variables = {MAP_VARIABLE: str(self.edges.number), CASES_VARIABLE: str(self.cases.number)}
        variables.pop(without, None)
        self.server = children.start(
            [sys.executable, "-m", "mirotwin.fuzz.afl.serve", spec.text(), *([beside] if beside else [])],
            env={**os.environ, **variables},
            cwd=ROOT,
            close_fds=False,  # those two stay open, all others close by themselves
            preexec_fn=prepare,
            stderr=children.subprocess.PIPE,
            text=True,
        )
        os.close(to_server)
        os.close(from_server)

    def hello(self):
        """The first word of the server, answered as AFL++ does."""
        said = os.read(self.status, 4)
        if said:
            os.write(self.control, said)
        return struct.unpack("<I", said)[0] if said else 0

    def run(self, data):
        """Process id and wait status for an input; the edge map is cleared before."""
        self.edges.memory[:] = bytes(len(self.edges.memory))
        self.cases.memory[: 4 + len(data)] = struct.pack("<I", len(data)) + data
        os.write(self.control, bytes(4))
        return struct.unpack("<iI", self._read(8))

    def _read(self, count):
        found = b""
        while len(found) < count:
            piece = os.read(self.status, count - len(found))
            if not piece:
                return bytes(count)
            found += piece
        return found

    def end(self):
        """Ends as AFL++ does; the exit code of the server."""
        os.close(self.control)
        code = self.server.wait(20)
        os.close(self.status)
        return code

    def __enter__(self):
        if self.answers:
            self.hello()
        return self

    def __exit__(self, *_):
        self.edges.remove()
        self.cases.remove()
        if self.server.poll() is None:
            os.close(self.control)
            os.close(self.status)
            self.server.send_signal(signal.SIGKILL)
            self.server.wait()
        self.server.stderr.close()


def by_hand(specification, data):
    """Exit code, standard output and standard error of a run without AFL++."""
    text = specification if isinstance(specification, str) else specification.text()
    command = [sys.executable, "-m", "mirotwin.fuzz.afl.serve", text]
    done = children.run(command, input=data, capture_output=True, cwd=ROOT)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


@pytest.fixture
def afl():
    """It has said hello to the server of a double."""
    with FakeAfl(spec()) as found:
        yield found


def test_the_first_word_says_options_size_of_the_map_and_shared_memory():
    with FakeAfl(spec(), answers=False) as afl:
        said = afl.hello()
        assert said & 0x8000_0001 == 0x8000_0001
        assert said & 0x4000_0000, "the size of the map follows"
        assert ((said & 0x00FF_FFFE) >> 1) + 1 == MAP_SIZE
        assert said & 0x0100_0000, "test cases come through shared memory"
        assert not said & 0x3000_0000, "neither a snapshot module nor a dictionary"


def test_the_process_that_is_told_cannot_exist(afl):
    process, _ = afl.run(b"hello")
    assert process > int(Path("/proc/sys/kernel/pid_max").read_text())


@given(st.integers(1, 255))
def test_each_kind_of_finding_is_a_signal_that_kills(kind):
    status = wait_status(kind)
    assert os.WIFSIGNALED(status)
    assert os.WTERMSIG(status) > signal.SIGSYS, "none that a program dies of by itself"


def test_no_two_of_the_first_93_kinds_have_the_same_signal():
    assert len({wait_status(kind) for kind in range(1, 94)}) == 93


def test_executions_are_kept_and_counted_on(tmp_path):
    beside = str(tmp_path / "main")
    for times in (1, 2):
        with FakeAfl(spec(), beside) as afl:
            for _ in range(serve.RUNS_A_COUNT):
                afl.run(b"hello")
            afl.end()
        assert read_executions(tmp_path / "main.counts") == serve.RUNS_A_COUNT * times
    assert not (tmp_path / "main.target").exists(), "there was nothing to complain of"


@given(content=st.binary(max_size=30).filter(lambda content: len(content) != 8))
def test_a_count_that_is_not_whole_is_zero(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("counts") / "main.counts"
    path.write_bytes(content)
    assert read_executions(path) == 0


def test_the_server_ends_when_afl_closes_its_pipes_before_the_answer(afl):
    os.close(afl.status)
    os.write(afl.control, bytes(4))
    os.close(afl.control)
    assert afl.server.wait(20) == 0
    assert afl.server.stderr.read() == ""


def test_the_server_ends_when_afl_does_not_answer_its_first_word():
    with FakeAfl(spec(), answers=False) as afl:
        assert afl.end() == 0


def test_a_target_that_raises_is_told_in_a_file(tmp_path):
    with FakeAfl(spec(raises=True), str(tmp_path / "main")) as afl:
        afl.run(b"!")
        assert afl.end() == 70
    assert (tmp_path / "main.target").read_text().splitlines()[-1] == "RuntimeError: the double raises"


@pytest.mark.parametrize(
    ("variable", "remedy"), [(MAP_VARIABLE, "by afl-fuzz"), (CASES_VARIABLE, "4.00c or newer")]
)
def test_an_afl_without_shared_memory_is_refused(variable, remedy):
    with FakeAfl(spec(), without=variable) as afl:
        assert afl.end() == 2
        said = afl.server.stderr.read()
        assert variable in said
        assert remedy in said
        assert said.count("\n") == 1


def test_shared_memory_that_is_not_there_is_an_error():
    with pytest.raises(OSError, match="shared memory 2147483647: Invalid argument"):
        attach(0x7FFF_FFFF, 1)


# ---- without AFL++ -----------------------------------------------------------------------------------------


def test_without_afl_standard_input_is_run_once_and_told():
    assert by_hand(spec(), WORD + b"Y") == (1, "word: found at 4 (tick 24, PC 0x0004)\n44 55 43 4b 59\n", "")
    assert by_hand(spec(), b"hello") == (0, "nothing found\n", "")


def test_the_target_runs_on_the_engine_that_is_asked_for():
    assert by_hand(TargetSpec(maker=MAKER, engine="python"), b"hello") == (0, "nothing found\n", "")


UNUSABLE = {
    "{": "target: Expecting property name",
    '{"board": "x"}': "target: Invalid enum value 'x' - at `$.board`; ",
    '{"bord": "miro"}': "target: Object contains unknown field `bord`; ",
    '{"robots": -1}': "target: Expected `int` >= 0 - at `$.robots`; ",
    '{"maker": "no_such:thing"}': "target: maker: no_such:thing: No module named 'no_such'; write it as",
    '{"maker": "os:nothing"}': "target: maker: os:nothing: module 'os' has no attribute 'nothing'; ",
}


@pytest.mark.parametrize("text", UNUSABLE)
def test_a_specification_that_cannot_be_used_is_one_line_and_exit_code_2(text):
    code, out, err = by_hand(text, b"")
    assert (code, out) == (2, "")
    assert err.startswith(UNUSABLE[text])
    assert err.count("\n") == 1
