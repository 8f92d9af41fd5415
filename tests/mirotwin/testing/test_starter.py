"""`mirotwin examples` and `mirotwin init`: an example or a project with all its files, or nothing."""

import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from miro_robot.firmware import image_path
from mirotwin.testing import origin, starter
from tests import children
from tests.mirotwin import program
from tests.mutants import build
from tests.mutants.planted import PLANTED

LATE = PLANTED["stops 15 ms late"]


def test_without_a_name_each_example_has_a_line(mirotwin):
    out = mirotwin.succeeds("examples")
    assert [line.split()[0] for line in out.splitlines()[:-1]] == list(starter.EXAMPLES)
    assert max(map(len, out.splitlines())) <= 80


def test_all_that_lies_in_the_folder_can_be_written():
    there = {path.stem for path in starter.folder().iterdir()}
    assert there == {*starter.EXAMPLES, starter.PROJECT}


@pytest.mark.parametrize("name", starter.EXAMPLES)
def test_an_example_is_written_file_by_file(mirotwin, tmp_path, name):
    out = mirotwin.succeeds("examples", name, tmp_path / "here")
    written = [Path(line) for line in out.splitlines()]
    assert written == [tmp_path / "here" / one for one in starter.contents_of(name)]
    assert all(path.is_file() for path in written)


def test_what_is_written_into_the_current_folder_is_said_to_be_there(mirotwin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    *names, last = mirotwin("examples", "firmware")[1].splitlines()
    assert sorted(names) == sorted(os.listdir(tmp_path))
    assert last == f"files written into this folder: {len(names)}"


def test_a_file_with_other_content_is_replaced_by_force_alone(mirotwin, tmp_path):
    (tmp_path / "late.ihx").write_text("mine")
    said = mirotwin.refuses("examples", "firmware", tmp_path)
    assert said == f"{tmp_path}: holds late.ihx already; name another folder, or replace with --force"
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
    assert hint in mirotwin.ends(2, "examples", name, tmp_path)


def test_the_late_image_is_the_shipped_firmware_with_one_mistake():
    if not build.compiler() and not os.environ.get("CI"):
        pytest.skip("needs make and SDCC 4.2.0")
    source = (build.SOURCE / LATE.file).read_text("utf-8")
    built = build.build({LATE.file: LATE.applied(source)})
    late = starter.folder() / "firmware" / "late.ihx"
    assert late.read_bytes() == built.image.read_bytes(), f"cp {built.image} {late}"


def tree(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


COMMANDS = [("init",), ("init", "--board", "car"), *(("examples", name) for name in starter.EXAMPLES)]
of_each_command = pytest.mark.parametrize("words", COMMANDS, ids=lambda words: words[-1])


@of_each_command
@pytest.mark.parametrize("size", [0, 700, 2500])
def test_on_a_full_disk_nothing_is_left(tmp_path, words, size):
    done = program.run(*words, "mine/here", cwd=tmp_path, preexec_fn=program.full_disk(size))
    if done.returncode == 0:  # its longest file is as short as that
        assert size
        return
    said = "mirotwin: error: mine/here: File too large; make room, or choose another folder\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", said)
    assert os.listdir(tmp_path) == []


@of_each_command
def test_no_link_leads_out_of_the_folder(mirotwin, tmp_path, words):
    """Each folder in turn is a link, to a folder that has the same files."""
    mirotwin(*words, tmp_path / "whole")
    folders = [path for path in (tmp_path / "whole").rglob("*") if path.is_dir()]
    for number, path in enumerate(folders):
        name = path.relative_to(tmp_path / "whole")
        outside, mine = tmp_path / f"outside{number}", tmp_path / f"mine{number}"
        shutil.copytree(path, outside)
        for file in outside.rglob("*"):
            if file.is_file():
                os.utime(file, (0, 0))
        (mine / name).parent.mkdir(parents=True)
        (mine / name).symlink_to(outside)
        said = mirotwin.refuses(*words, mine)
        assert said.startswith(
            f"{mine / name}: is a symbolic link to {outside}; remove it, or choose another"
        )
        assert tree(mine) == set()
        assert all(file.stat().st_mtime == 0 for file in outside.rglob("*") if file.is_file())


SDCC = """#!/bin/sh
# Stands in for SDCC: leaves what it would leave, empty.
[ "$1" = --version ] && exec echo "$VERSION"
while [ "$1" != -o ]; do shift; done
for suffix in ihx rel map cdb rst; do echo "      000000 00" > "${2%.*}.$suffix"; done
"""


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
@of_each_command
def test_no_makefile_writes_or_removes_anything_outside_of_its_folder(mirotwin, tmp_path, words):
    """As it is called, and with variables of its names in the environment."""
    mine = tmp_path / "a" / "b" / "mine"
    mirotwin(*words, mine)
    sdcc = tmp_path / "sdcc"
    sdcc.write_text(SDCC)
    sdcc.chmod(0o755)
    outside = ("build/x", "a/build/x", "a/build/firmware/x", "a/b/build/x", "a/b/build/firmware/x", "env/x")
    for name in outside:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("kept")
    before = tree(tmp_path)
    version = (starter.source_folder() / "sdcc.version").read_text("utf-8").strip()
    environment = {**os.environ, "SDCC": str(sdcc), "VERSION": version}
    for makefile in mine.rglob("*akefile"):
        for more in {}, dict.fromkeys(("BUILD", "OUT", "FAILED", "IMAGE"), str(tmp_path / "env")):
            for goal in "all", "clean":
                children.run(
                    ["make", "-s", goal],
                    cwd=makefile.parent,
                    env=environment | more,
                    check=True,
                    capture_output=True,
                )
                new = tree(tmp_path) - before
                assert all(name.startswith("a/b/mine/") for name in new)
                assert before <= tree(tmp_path)
                assert bool(new) is (goal == "all")


# A project


def test_a_new_folder_gets_the_firmware_its_tests_and_a_workflow(mirotwin, tmp_path):
    out = mirotwin.succeeds("init", tmp_path / "mine")
    found = tree(tmp_path / "mine")
    assert found == {name for name, _ in starter.project_files()}
    assert {"Makefile", "firmware/main.c", "tests/test_robot.py", ".github/workflows/firmware.yml"} <= found
    assert f"next: cd {tmp_path}/mine && make test" in out


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize("name", [b"-x", b"n\xff", b"it's"])
def test_the_printed_command_enters_the_folder_whatever_its_name(mirotwin, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    out = mirotwin.succeeds("init", "--without-firmware", "--", os.fsdecode(name))
    (enter,) = re.findall(r"^next: (cd .*) && make test", out, re.M)
    children.run(["bash", "-c", f"{enter} && touch entered"], check=True)
    assert Path(os.fsdecode(name), "entered").exists()


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_a_folder_whose_name_has_a_space_is_made_and_quoted(mirotwin, tmp_path):
    folder = tmp_path / "my röbot"
    _, out, _ = mirotwin("init", folder)
    assert f"next: cd '{folder}' && make test" in out
    done = children.run(["make", "-n", "test"], cwd=folder, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "cp ../build/objects/miro.ihx" in done.stdout
    assert tree(folder) == {name for name, _ in starter.project_files()}


def test_an_empty_folder_will_do_and_other_files_stay(mirotwin, tmp_path):
    (tmp_path / "LICENSE").write_text("mine")
    assert mirotwin("init", tmp_path)[0] == 0
    assert (tmp_path / "LICENSE").read_text() == "mine"


def test_nothing_is_written_where_one_of_the_files_is_there_already_and_differs(mirotwin, tmp_path):
    (tmp_path / "Makefile").write_text("all:\n")
    said = mirotwin.refuses("init", tmp_path)
    assert said == f"{tmp_path}: holds Makefile already; name a folder that is new or empty"
    assert tree(tmp_path) == {"Makefile"}
    (tmp_path / "Makefile").unlink()
    assert mirotwin("init", tmp_path)[0] == mirotwin("init", tmp_path)[0] == 0


def test_a_file_is_no_folder(mirotwin, tmp_path):
    (tmp_path / "a").write_text("")
    mirotwin.refuses("init", tmp_path / "a")
    mirotwin.refuses("init", tmp_path / "a" / "b")


def test_an_installation_without_the_files_says_so(mirotwin, tmp_path, monkeypatch):
    monkeypatch.setattr(starter, "source_folder", lambda: None)
    assert "not part of this installation" in mirotwin.ends(2, "init", tmp_path / "a")


def test_without_firmware_there_are_no_c_sources_and_no_test_that_names_one(mirotwin, tmp_path):
    out = mirotwin.succeeds("init", "--without-firmware", tmp_path / "mine")
    assert tree(tmp_path / "mine") == {
        name
        for name, _ in starter.project_files()
        if not name.startswith("firmware/") and name != "tests/test_firmware.py"
    }
    assert "SDCC" not in out


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [("scenarios",), ("scenarios", "pytest", f"IMAGE={image_path()}")],
    ids=["the robot's own", "an image"],
)
def test_a_project_without_firmware_passes_its_tests_without_a_c_compiler(mirotwin, tmp_path, words):
    make = shutil.which("make")
    if make is None:
        pytest.skip("needs make")
    mirotwin("init", "--without-firmware", tmp_path / "mine")
    programs = tmp_path / "programs"
    programs.mkdir()
    for name in ("mkdir", "sh"):
        (programs / name).symlink_to(shutil.which(name) or name)
    path = os.pathsep.join((str(Path(sys.executable).parent), str(programs)))
    done = children.run(
        [make, *words],
        cwd=tmp_path / "mine",
        env={**os.environ, "PATH": path, "PYTEST_ADDOPTS": "-p no:hypothesispytest"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "mine/build/scenarios.xml").is_file()
    assert (tmp_path / "mine/build/pytest.xml").is_file() is ("pytest" in words)


BOARDS = sorted(path.name for path in (starter.folder() / "boards").iterdir() if path.is_dir())


@pytest.mark.parametrize("board", BOARDS)
def test_a_project_of_a_board_passes_its_tests_with_pytest_alone(mirotwin, tmp_path, board):
    out = mirotwin.succeeds("init", tmp_path / "mine", "--board", board)
    found = tree(tmp_path / "mine")
    done = children.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:hypothesispytest"],
        cwd=tmp_path / "mine",
        capture_output=True,
        text=True,
    )

    assert found == {name for name, _ in starter.board_files(board)}
    assert {
        "Makefile",
        "README.md",
        "requirements.txt",
        ".gitignore",
        ".github/workflows/firmware.yml",
        "ci.sh",
        "Dockerfile",
    } <= found
    assert f"next: cd {tmp_path}/mine && pytest" in out
    scenarios = len(list((tmp_path / "mine").glob("*.scenario.toml")))
    in_python = {"modbus": 4, "monitor": 0}.get(board, 3)  # `board` of a test in Python is one board
    assert len(list((tmp_path / "mine").glob("test_*.py"))) == (in_python > 0)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"(\d+) passed in", done.stdout)[1] == f"{scenarios + in_python}"


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--board", "cart"), "--board: no such board 'cart'; did you mean car?"),
        (("--board", "x"), f"--board: no such board 'x'; there are {', '.join(BOARDS)}"),
        (("--board", "../hil"), f"--board: no such board '../hil'; there are {', '.join(BOARDS)}"),
    ],
)
def test_a_board_that_is_no_example_is_answered_with_those_there_are(mirotwin, tmp_path, words, line):
    assert mirotwin.refuses("init", tmp_path / "mine", *words) == line
    assert os.listdir(tmp_path) == []


def test_the_page_of_ci_names_all_boards_that_a_project_begins_with():
    page = (Path(__file__).parents[3] / "docs/howto/ci.md").read_text("utf-8")

    sentence = re.search(r"For a board of your own, .*?:", page, re.DOTALL)[0]
    assert re.findall(r"`(\w+)`", sentence) == BOARDS


def test_a_board_has_its_own_firmware(mirotwin, tmp_path):
    said = mirotwin.ends(2, "init", tmp_path / "mine", "--board", "car", "--without-firmware")
    assert "--board does not go with --without-firmware" in said


def requirements(folder):
    return (folder / "requirements.txt").read_text("utf-8").splitlines()


def test_a_project_requires_what_is_installed_here(mirotwin, tmp_path, monkeypatch):
    monkeypatch.setattr(origin, "installed", lambda project: f"mirotwin[report] @ {project.as_uri()}")
    out = mirotwin.succeeds("init", tmp_path / "mine")
    line = f"mirotwin[report] @ {(tmp_path / 'mine').as_uri()}"
    assert requirements(tmp_path / "mine")[1:] == [line, "pytest>=8.3,<10"]
    assert f"Mirotwin comes from: {line}\nThat is a path of this machine." in out


def test_a_project_requires_what_the_user_names_instead(mirotwin, tmp_path):
    source = "git+https://example.org/mirotwin.git@0123abc"
    out = mirotwin.succeeds("init", tmp_path / "mine", "--from", source)
    assert f"mirotwin[report] @ {source}" in requirements(tmp_path / "mine")
    assert "this machine" not in out


@pytest.mark.parametrize(
    "source", ["mirotwin", "mirotwin==0.3.0", "/no/such/folder", "https://x/a b", "file:///x"]
)
def test_a_mere_name_is_no_source_of_a_project(mirotwin, tmp_path, monkeypatch, source):
    monkeypatch.chdir(tmp_path)
    said = mirotwin.refuses("init", tmp_path / "mine", "--from", source)
    assert said.startswith(
        f"{source}: --from: is no address, and there is no such file or folder; give git+https://"
    )
    assert os.listdir(tmp_path) == []


def test_where_the_source_is_not_known_pip_fails_with_the_sentence_that_says_what_to_write(
    mirotwin, tmp_path, monkeypatch
):
    monkeypatch.setattr(origin, "installed", lambda project: None)
    out = mirotwin.succeeds("init", tmp_path / "mine")
    assert f"Mirotwin comes from: not known; write it into {tmp_path}/mine/requirements.txt" in out
    (line,) = origin.UNKNOWN.findall((tmp_path / "mine/requirements.txt").read_text("utf-8"))
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--dry-run",
        "--no-index",
        "-q",
        "-r",
        "requirements.txt",
    ]
    done = children.run(command, cwd=tmp_path / "mine", capture_output=True, text=True)
    assert done.returncode == 1
    assert f"Invalid requirement: '{line}'" in done.stderr
    assert "git+https://HOST/PATH@COMMIT, or the path of a wheel or a checkout" in line
