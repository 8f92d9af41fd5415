"""A recording that would take more memory than there is is refused in words, before it is read."""

import pytest

from miro_exact import inputs
from miro_exact.inputs import RECORDING_BYTES, RECORDING_NEEDS, InputError, read_input
from tests import children
from tests.mirotwin.program import COMMAND


@pytest.mark.parametrize("spare", [0, 1])
def test_a_recording_is_read_where_its_memory_is_available_and_refused_where_it_is_not(
    tmp_path, monkeypatch, spare
):
    path = tmp_path / "run.mcap"
    path.write_bytes(bytes(3_000_000))
    monkeypatch.setattr(inputs, "available_bytes", lambda: 3_000_000 * RECORDING_NEEDS - 1 + spare)
    if spare:
        assert read_input(path, RECORDING_BYTES) == bytes(3_000_000)
        return
    with pytest.raises(
        InputError, match=r"run.mcap: takes up to 21 MB of memory to read, and 21 MB are available; end"
    ):
        read_input(path, RECORDING_BYTES)


def test_where_the_system_does_not_say_nothing_is_refused_and_other_files_are_not_recordings(
    tmp_path, monkeypatch
):
    path = tmp_path / "a"
    path.write_bytes(b"text")
    monkeypatch.setattr(inputs, "available_bytes", lambda: None)
    assert read_input(path, RECORDING_BYTES) == b"text"
    monkeypatch.setattr(inputs, "available_bytes", lambda: 0)
    assert read_input(path) == b"text"


@pytest.mark.skipif(
    inputs.available_bytes() is None, reason="this system does not say how much memory there is"
)
@pytest.mark.parametrize(
    "words",
    [("replay",), ("report", "--out", "x.html"), ("diff",), ("export", "--as", "foxglove", "--out", "x")],
)
def test_each_command_that_reads_a_whole_recording_refuses_one_that_is_too_large_for_its_limit(
    tmp_path, words
):
    with (tmp_path / "run.mcap").open("wb") as file:
        file.write(b"\x89MCAP0\r\n")
        file.truncate(900_000_000)  # takes no room on the disk

    def limited():
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (4_000_000_000, 4_000_000_000))

    name, *options = words
    subjects = ["run.mcap"] * (2 if name == "diff" else 1)
    command = [*COMMAND, name, *subjects, *options]
    done = children.run(command, cwd=tmp_path, capture_output=True, text=True, preexec_fn=limited)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith("mirotwin: error: run.mcap: takes up to 6300 MB of memory to read, and ")
