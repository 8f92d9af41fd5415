"""`mirotwin init`: a project with all its files, or nothing."""

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.mirotwin.cli.conftest import Result, mirotwin

from mirotwin.starter import project

__all__ = ["mirotwin"]


def tree(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_new_folder_gets_the_firmware_its_tests_and_a_workflow(
    mirotwin: Callable[..., Result], tmp_path: Path
) -> None:
    code, out, err = mirotwin("init", tmp_path / "mine")
    assert (code, err) == (0, "")
    assert tree(tmp_path / "mine") == {name for name, _ in project.files()}
    assert {"Makefile", "firmware/main.c", "tests/test_robot.py", ".github/workflows/firmware.yml"} <= tree(
        tmp_path / "mine"
    )
    assert f"next: cd {tmp_path}/mine && make test" in out


def test_an_empty_folder_will_do_and_other_files_stay(
    mirotwin: Callable[..., Result], tmp_path: Path
) -> None:
    (tmp_path / "LICENSE").write_text("mine")
    assert mirotwin("init", tmp_path)[0] == 0
    assert (tmp_path / "LICENSE").read_text() == "mine"


def test_nothing_is_written_where_one_of_the_files_is_there_already(
    mirotwin: Callable[..., Result], tmp_path: Path
) -> None:
    (tmp_path / "Makefile").write_text("all:\n")
    code, out, err = mirotwin("init", tmp_path)
    assert (code, out) == (2, "")
    assert err == f"mirotwin: error: {tmp_path}: holds Makefile already; name a folder that is new or empty\n"
    assert tree(tmp_path) == {"Makefile"}


def test_a_file_is_no_folder(mirotwin: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "a").write_text("")
    assert mirotwin("init", tmp_path / "a")[0] == 2
    code, _, err = mirotwin("init", tmp_path / "a" / "b")
    assert code == 2
    assert err.count("\n") == 1


def test_an_installation_without_the_files_says_so(
    mirotwin: Callable[..., Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(project, "source_folder", lambda: None)
    code, _, err = mirotwin("init", tmp_path / "a")
    assert code == 2
    assert "not part of this installation" in err
