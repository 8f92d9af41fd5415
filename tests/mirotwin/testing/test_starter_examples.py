"""`mirotwin examples`: lists what there is, and writes one into a folder, all of it or nothing."""

import os
from pathlib import Path

import pytest

from miro_robot.firmware import image_path
from mirotwin.testing import starter
from tests.mutants import build
from tests.mutants.planted import PLANTED

LATE = PLANTED["stops 15 ms late"]


def test_without_a_name_each_example_has_a_line(mirotwin):
    code, out, err = mirotwin("examples")
    assert (code, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()[:-1]] == list(starter.EXAMPLES)
    assert max(map(len, out.splitlines())) <= 80


def test_all_that_lies_in_the_folder_can_be_written():
    there = {path.stem for path in starter.folder().iterdir()}
    assert there == {*starter.EXAMPLES, starter.PROJECT}


@pytest.mark.parametrize("name", starter.EXAMPLES)
def test_an_example_is_written_file_by_file(mirotwin, tmp_path, name):
    code, out, err = mirotwin("examples", name, tmp_path / "here")
    assert (code, err) == (0, "")
    assert [Path(line) for line in out.splitlines()] == [
        tmp_path / "here" / one for one, _ in starter.example_files(name)
    ]
    assert all(path.is_file() for path in map(Path, out.splitlines()))


def test_what_is_written_into_the_current_folder_is_said_to_be_there(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    *names, last = mirotwin("examples", "firmware")[1].splitlines()
    assert sorted(names) == sorted(os.listdir(tmp_path))
    assert last == f"files written into this folder: {len(names)}"


def test_a_file_with_other_content_is_replaced_by_force_alone(mirotwin, tmp_path):
    (tmp_path / "late.ihx").write_text("mine")
    code, _, err = mirotwin("examples", "firmware", tmp_path)
    assert code == 2
    assert err == (
        f"mirotwin: error: {tmp_path}: holds late.ihx already; name another folder, or replace with --force\n"
    )
    assert os.listdir(tmp_path) == ["late.ihx"]
    assert mirotwin("examples", "firmware", tmp_path, "--force")[0] == 0
    assert (tmp_path / "mine.ihx").read_bytes() == image_path().read_bytes()
    assert mirotwin("examples", "firmware", tmp_path)[0] == 0


def test_a_link_is_not_written_through(mirotwin, tmp_path):
    (tmp_path / "other").write_text("kept")
    (tmp_path / "late.ihx").symlink_to(tmp_path / "other")
    assert mirotwin("examples", "firmware", tmp_path, "--force")[0] == 2
    assert (tmp_path / "other").read_text() == "kept"


@pytest.mark.parametrize(
    ("name", "hint"), [("frimware", "did you mean firmware?"), ("x", "there are firmware, ")]
)
def test_a_name_that_is_none_is_answered_with_those_there_are(mirotwin, tmp_path, name, hint):
    code, _, err = mirotwin("examples", name, tmp_path)
    assert code == 2
    assert hint in err


def test_the_late_image_is_the_shipped_firmware_with_one_mistake():
    if not build.compiler() and not os.environ.get("CI"):
        pytest.skip("needs make and SDCC 4.2.0")
    source = (build.SOURCE / LATE.file).read_text("utf-8")
    built = build.build({LATE.file: LATE.applied(source)})
    late = starter.folder() / "firmware" / "late.ihx"
    assert late.read_bytes() == built.image.read_bytes(), f"cp {built.image} {late}"
