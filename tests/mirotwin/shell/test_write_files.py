"""Several files that belong together: all of them are written, or what was there before is there still."""

import errno
import os
import tempfile
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirotwin.shell.outputs import OutputError, write_files

REMEDY = "choose another folder"
names = st.lists(st.sampled_from("abc"), min_size=1, max_size=3).map("/".join)


def tree(folder):
    """Name of each file below with its content, of each folder with None."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


def disk_that_takes(count):
    """A disk that is full after so many bytes: the file that reaches its end stays half-written."""
    left = count

    def write_bytes(path, content):
        nonlocal left
        with path.open("wb") as file:
            file.write(content[:left])
        left -= len(content)
        if left < 0:
            raise OSError(errno.ENOSPC, "No space left on device")

    return mock.patch.object(Path, "write_bytes", write_bytes)


@given(
    before=st.dictionaries(st.sampled_from("abc"), st.binary(max_size=3)),
    files=st.dictionaries(names, st.binary(min_size=1, max_size=5), min_size=1),
    room=st.integers(0, 20),
    new=st.booleans(),
)
def test_all_files_are_there_or_all_is_as_before(before, files, room, new):
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        folder = top / "x" / "y" if new else top
        if not new:
            for each, content in before.items():
                (top / each).write_bytes(content)
        was = tree(top)
        try:
            with disk_that_takes(room):
                write_files(folder, files, REMEDY)
        except OutputError:
            assert tree(top) == was
        else:
            written = {name: content for name, content in tree(folder).items() if content is not None}
            assert written == ({} if new else before) | files


def test_a_full_disk_is_named_with_its_remedy(tmp_path):
    with disk_that_takes(3), pytest.raises(OutputError) as refused:
        write_files(tmp_path / "mine", {"a": b"12", "b/c": b"345"}, REMEDY)
    assert str(refused.value) == f"{tmp_path}/mine: No space left on device; make room, or {REMEDY}"
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("there", ["folder", "nothing"])
def test_no_link_below_the_folder_is_followed(tmp_path, there):
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    if there == "folder":
        outside.mkdir()
    (inside / "a").symlink_to(outside)
    with pytest.raises(
        OutputError, match=r"a: is a symbolic link to .*outside; remove it, or choose another"
    ):
        write_files(inside, {"0": b"", "a/b/c": b""}, REMEDY)
    assert os.listdir(inside) == ["a"]
    assert not outside.exists() or os.listdir(outside) == []


def test_a_link_of_a_files_name_is_replaced_and_not_written_through(tmp_path):
    (tmp_path / "other").write_bytes(b"mine")
    (tmp_path / "a").symlink_to("other")
    write_files(tmp_path, {"a": b"new"}, REMEDY)
    assert tree(tmp_path) == {"a": b"new", "other": b"mine"}
    assert not (tmp_path / "a").is_symlink()


def test_a_folder_where_a_file_is_to_be_is_named_before_anything_is_written(tmp_path):
    (tmp_path / "b").mkdir()
    with pytest.raises(OutputError, match="/b: is a folder where a file is to be written"):
        write_files(tmp_path, {"a": b"", "b": b""}, REMEDY)
    assert tree(tmp_path) == {"b": None}


def test_a_file_where_a_folder_is_to_be_is_named(tmp_path):
    (tmp_path / "a").write_bytes(b"mine")
    with pytest.raises(OutputError, match=r"/a: File exists; choose another folder"):
        write_files(tmp_path, {"0": b"", "a/b": b""}, REMEDY)
    assert tree(tmp_path) == {"a": b"mine"}


def test_what_is_written_has_the_mode_that_the_user_wants(tmp_path):
    before = os.umask(0o027)
    try:
        write_files(tmp_path, {"a": b""}, REMEDY)
    finally:
        os.umask(before)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640
