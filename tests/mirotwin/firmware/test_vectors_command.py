"""`mirotwin fw vectors` that does not get to its end. (What is in the files: tests/vectors.)"""

import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests import children

MIROTWIN = Path(sys.executable).with_name("mirotwin")
FILE_BYTES = 16384


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_where_the_folder_should_be_is_refused_with_the_way_out(mirotwin, tmp_path):
    (tmp_path / "mine").write_text("mine")
    expected = f"mirotwin: error: {tmp_path / 'mine'}: exists and is not a folder; choose another folder with --out\n"
    assert mirotwin("fw", "vectors", "--out", tmp_path / "mine", "--force") == (2, "", expected)
    assert (tmp_path / "mine").read_text() == "mine"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_set_leaves_nothing(tmp_path, number):
    command = [MIROTWIN, "fw", "vectors", "--out", tmp_path / "set", "--per-opcode", "2000"]
    with children.start(command, stderr=subprocess.PIPE) as running:
        while running.poll() is None and not any(tmp_path.rglob("*.json")):
            time.sleep(0.01)
        running.send_signal(number)
        assert running.wait() == (130 if number is signal.SIGINT else 128 + number)
    assert names(tmp_path) == []


def test_a_disk_that_is_full_leaves_nothing_and_is_named(tmp_path):
    """A limit on the length of files stands in for the disk."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))

    command = [MIROTWIN, "fw", "vectors", "--out", tmp_path / "set", "--per-opcode", "100"]
    done = children.run(command, preexec_fn=limit, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1] == (
        f"mirotwin: error: {tmp_path / 'set'}: File too large; make room, or choose another folder with --out"
    )
    assert names(tmp_path) == []
