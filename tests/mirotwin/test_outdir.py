"""The output folder: what is refused, what is replaced, and that nothing is left half-written."""

import errno
import os
import stat
from pathlib import Path

import pytest

from mirotwin.shell.outputs import OutputError, OutputFolder, check_file, check_new, whole_file


def write_run(folder, text="new"):
    for name in ("run.mcap", "summary.json"):
        folder.part(name).write_text(text)


def test_a_new_folder_is_made_with_its_parents(tmp_path):
    target = tmp_path / "runs" / "fig6-1"
    with OutputFolder(target) as staging:
        write_run(staging)
        assert sorted(path.name for path in target.iterdir()) == ["run.part.mcap", "summary.part.json"]
    assert sorted(path.name for path in target.iterdir()) == ["run.mcap", "summary.json"]
    assert [path.name for path in target.parent.iterdir()] == ["fig6-1"]


def test_a_folder_with_other_content_is_refused_with_the_way_out(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    said = r"not empty \(thesis\.tex\); choose another with --out, or .*--force"
    with pytest.raises(OutputError, match=said):
        OutputFolder(tmp_path)


def test_force_replaces_the_files_of_a_run_and_nothing_else(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    for name in ("run.mcap", "summary.json", "figure.svg"):
        (tmp_path / name).write_text("old")
    with OutputFolder(tmp_path, force=True) as staging:
        write_run(staging)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
    assert (tmp_path / "run.mcap").read_text() == "new"
    assert not (tmp_path / "figure.svg").exists()


@pytest.mark.parametrize("kind", [ZeroDivisionError, KeyboardInterrupt])
def test_a_run_that_breaks_off_leaves_things_as_they_were(tmp_path, kind):
    target = tmp_path / "out"
    target.mkdir()
    (target / "run.mcap").write_text("old")

    def broken_off():
        with OutputFolder(target, force=True) as staging:
            write_run(staging)
            raise kind

    with pytest.raises(kind):
        broken_off()
    assert (target / "run.mcap").read_text() == "old"
    assert [path.name for path in target.iterdir()] == ["run.mcap"]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_folder_takes_one_writer_at_a_time_and_is_free_after_it(tmp_path):
    refusal = "another process is writing into the folder; wait until it has finished"
    early = OutputFolder(tmp_path / "new")
    with OutputFolder(tmp_path / "new") as folder:
        write_run(folder)
        with pytest.raises(OutputError, match=refusal):
            OutputFolder(tmp_path / "new", force=True)
        with pytest.raises(OutputError, match=refusal):
            early.__enter__()
    with pytest.raises(OutputError, match=r"the folder is not empty \(run\.mcap, summary\.json\)"):
        early.__enter__()  # it was filled since it was checked
    with OutputFolder(tmp_path / "new", force=True):
        pass
    assert list((tmp_path / "new").iterdir()) == []


def test_parts_of_before_are_named_and_never_taken_for_new_ones(tmp_path):
    (tmp_path / "figure.part.svg").write_text("old")
    said = r"the folder holds parts of an interrupted command \(figure\.part\.svg\)"
    with pytest.raises(OutputError, match=said):
        OutputFolder(tmp_path)
    with OutputFolder(tmp_path, force=True) as folder:
        write_run(folder)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap", "summary.json"]


def test_a_file_where_the_folder_should_be_is_refused(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(OutputError, match="not a folder"):
        OutputFolder(tmp_path / "out", force=True)
    with pytest.raises(OutputError, match="choose another"):
        OutputFolder(tmp_path / "out" / "deeper", force=True)
    (tmp_path / "made" / "run.mcap").mkdir(parents=True)
    with pytest.raises(OutputError, match=r"run\.mcap: is a folder"):
        OutputFolder(tmp_path / "made", force=True)


def test_a_folder_that_cannot_be_written_to_is_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)  # root may write everywhere
    with pytest.raises(OutputError, match="the folder cannot be written to; choose another"):
        OutputFolder(tmp_path)
    with pytest.raises(OutputError, match="cannot be written to; choose another file with --dump"):
        check_file(tmp_path / "new.json", "--dump")
    (tmp_path / "old.json").touch()
    with pytest.raises(OutputError, match="the file cannot be written to"):
        check_file(tmp_path / "old.json", "--dump")


def test_a_link_to_nothing_is_called_that(tmp_path):
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(OutputError, match="is a symbolic link to nowhere, which does not exist"):
        OutputFolder(tmp_path / "link")
    with pytest.raises(OutputError, match="is a symbolic link to nowhere, which does not exist"):
        check_file(tmp_path / "link", "--dump")


@pytest.fixture(params=["a folder that is there", "a link to one"])
def made(request, tmp_path):
    (tmp_path / "target").mkdir()
    if request.param == "a folder that is there":
        return tmp_path / "target"
    (tmp_path / "link").symlink_to("target")
    return tmp_path / "link"


def test_a_folder_that_is_there_is_filled_from_inside_because_it_may_be_another_disk(made):
    with OutputFolder(made) as staging:
        assert staging.part("run.mcap").parent.samefile(made)
        write_run(staging)
    assert sorted(path.name for path in made.iterdir()) == ["run.mcap", "summary.json"]


def test_a_full_disk_is_named_with_the_way_out(tmp_path):
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    said = "new: No space left on device; make room, or choose another"
    with pytest.raises(OutputError, match=f"{said} folder with --out"), OutputFolder(tmp_path / "new"):
        raise full
    with pytest.raises(OutputError, match=f"{said} file with --dump"), whole_file(tmp_path / "new", "--dump"):
        raise full
    assert list(tmp_path.iterdir()) == []


def test_a_whole_file_is_written_through_a_link(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "real").write_text("old")
    (tmp_path / "link").symlink_to("data/real")
    with whole_file(tmp_path / "link", "--out") as staging:
        staging.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "data" / "real").read_text() == "new"
    assert [path.name for path in (tmp_path / "data").iterdir()] == ["real"]


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_a_whole_file_keeps_the_mode_of_the_one_before(tmp_path, mode):
    (tmp_path / "mine").touch()
    (tmp_path / "mine").chmod(mode)
    with whole_file(tmp_path / "mine", "--out") as staging:
        staging.write_text("new")
    assert stat.S_IMODE((tmp_path / "mine").stat().st_mode) == mode


@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_a_new_whole_file_has_the_mode_that_any_new_file_has(tmp_path, umask):
    before = os.umask(umask)
    try:
        with whole_file(tmp_path / "whole", "--out") as staging:
            staging.write_text("new")
        (tmp_path / "any").write_text("new")
    finally:
        os.umask(before)
    assert (tmp_path / "whole").stat().st_mode == (tmp_path / "any").stat().st_mode


def test_a_file_that_is_there_stays_unless_it_is_to_be_replaced(tmp_path):
    check_new(tmp_path / "x", "--out", force=False)
    (tmp_path / "x").touch()
    check_new(tmp_path / "x", "--out", force=True)
    said = r"x: is there already; choose another file with --out, or .* --force"
    with pytest.raises(OutputError, match=said):
        check_new(tmp_path / "x", "--out", force=False)


def test_a_whole_file_does_not_take_the_place_of_a_device():
    refusal = "exists and is not a regular file; choose another file with --out"
    with pytest.raises(OutputError, match=refusal), whole_file(Path(os.devnull), "--out"):
        pass
    with pytest.raises(OutputError, match=refusal):
        check_file(Path(os.devnull), "--out")
    assert not os.path.isfile(os.devnull)
