"""The output folder: what is refused, what is replaced, and that nothing is left half-written."""

import os
from pathlib import Path

import pytest
from miro_sim.outdir import OutputError, OutputFolder, check_file, whole_file


def write_run(folder: Path, text: str = "new") -> None:
    for name in ("run.mcap", "summary.json"):
        (folder / name).write_text(text)


def test_a_new_folder_is_made_with_its_parents(tmp_path: Path) -> None:
    target = tmp_path / "runs" / "fig6-1"
    with OutputFolder(target) as staging:
        assert not target.exists()
        write_run(staging)
    assert sorted(path.name for path in target.iterdir()) == ["run.mcap", "summary.json"]
    assert [path.name for path in target.parent.iterdir()] == ["fig6-1"]


def test_an_empty_folder_may_be_used(tmp_path: Path) -> None:
    with OutputFolder(tmp_path / ".") as staging:
        write_run(staging)
    assert (tmp_path / "run.mcap").read_text() == "new"


def test_a_folder_with_other_content_is_refused_with_the_way_out(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(
        OutputError, match=r"not empty \(thesis\.tex\); choose another with --out, or .*--force"
    ):
        OutputFolder(tmp_path)


def test_force_replaces_the_files_of_a_run_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    for name in ("run.mcap", "summary.json", "figure.png"):
        (tmp_path / name).write_text("old")
    with OutputFolder(tmp_path, force=True) as staging:
        write_run(staging)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
    assert (tmp_path / "run.mcap").read_text() == "new"
    assert not (tmp_path / "figure.png").exists()


@pytest.mark.parametrize("kind", [ZeroDivisionError, KeyboardInterrupt])
def test_a_run_that_breaks_off_leaves_things_as_they_were(tmp_path: Path, kind: type[BaseException]) -> None:
    target = tmp_path / "out"
    target.mkdir()
    (target / "run.mcap").write_text("old")

    def broken_off() -> None:
        with OutputFolder(target, force=True) as staging:
            write_run(staging)
            raise kind

    with pytest.raises(kind):
        broken_off()
    assert (target / "run.mcap").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_file_where_the_folder_should_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(OutputError, match="not a folder"):
        OutputFolder(tmp_path / "out", force=True)
    with pytest.raises(OutputError, match="choose another"):
        OutputFolder(tmp_path / "out" / "deeper", force=True)
    (tmp_path / "made" / "run.mcap").mkdir(parents=True)
    with pytest.raises(OutputError, match=r"run\.mcap: is a folder"):
        OutputFolder(tmp_path / "made", force=True)


def test_a_folder_that_cannot_be_written_to_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda path, mode: False)  # root may write everywhere
    with pytest.raises(OutputError, match="the folder cannot be written to; choose another"):
        OutputFolder(tmp_path)
    with pytest.raises(OutputError, match="cannot be written to; choose another file with --dump"):
        check_file(tmp_path / "new.json", "--dump")
    (tmp_path / "old.json").touch()
    with pytest.raises(OutputError, match="the file cannot be written to"):
        check_file(tmp_path / "old.json", "--dump")


def test_a_link_to_nothing_is_called_that(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(OutputError, match="is a symbolic link to nowhere, which does not exist"):
        OutputFolder(tmp_path / "link")
    with pytest.raises(OutputError, match="is a symbolic link to nowhere, which does not exist"):
        check_file(tmp_path / "link", "--dump")


def test_a_whole_file_does_not_take_the_place_of_a_device() -> None:
    refusal = "is there and is not a regular file; choose another file with --out"
    with pytest.raises(OutputError, match=refusal), whole_file(Path(os.devnull), "--out"):
        pass
    assert not os.path.isfile(os.devnull)
