"""What every command does that writes a file: what is there stays, and a place for no file is told before the work."""

import os

import pytest

from tests.mirotwin.conftest import hex_file

WITH_FORCE = {
    "export": ("export", "RUN", "--as", "pcapng", "--out"),
    "export for Foxglove": ("export", "RUN", "--as", "foxglove", "--out"),
    "report": ("report", "RUN", "--out"),
    "fw header": ("fw", "header", "--out"),
    "fw trace": ("fw", "trace", "RUN", "--to", "1ms", "--out"),
    "fw coverage": ("fw", "coverage", "RUN", "--to", "1ms", "--out"),
    "fw vcd": ("fw", "vcd", "RUN", "--to", "1ms", "--out"),
    "camera look": ("camera", "look", "fig6", "--at", "0s", "--out"),
    "camera calibrate": ("camera", "calibrate", "--scenario", "fig6", "--points-out", "OTHER", "--out"),
    "points of camera calibrate": ("camera", "calibrate", "--scenario", "fig6", "--out", "OTHER", "--points-out"),
}  # fmt: skip
COMMANDS = {**WITH_FORCE, "fw run": ("fw", "run", "IMAGE", "--dump")}
SAYS_C = bytes.fromhex("759850 758bff 758920 d28e 7599c3 80fe")
"""Sends a character at once: a place is refused before the firmware runs."""
READING = [name for name, words in COMMANDS.items() if {"RUN", "IMAGE"} & set(words)]


def forces(name):
    """The options of a command with which a file is replaced."""
    return ("--force",) if name in WITH_FORCE else ()


@pytest.fixture
def line(finished, tmp_path):
    """The words of a command that writes to a place, and reads the recording or the image of that name beside it."""
    given = {"RUN": tmp_path / "run.mcap", "IMAGE": tmp_path / "a.ihx", "OTHER": tmp_path / "other"}
    given["RUN"].write_bytes((finished / "run.mcap").read_bytes())
    hex_file(given["IMAGE"], SAYS_C)
    return lambda name, place: [*(given.get(word, word) for word in COMMANDS[name]), place]


@pytest.mark.parametrize("name", WITH_FORCE)
def test_a_file_that_is_there_is_replaced_by_force_only(mirotwin, line, tmp_path, name):
    mine = tmp_path / "mine"
    mine.write_text("years of work")
    said = mirotwin.refuses(*line(name, mine))
    option = COMMANDS[name][-1]
    assert said.startswith(f"{mine}: is there already; choose another file with {option}, ")
    assert said.endswith("or replace it with --force")
    assert ("add to it with --append" in said) == (name == "fw coverage")
    assert mine.read_text() == "years of work"
    assert mirotwin(*line(name, mine), "--force")[0] == 0
    assert b"years of work" not in mine.read_bytes()


@pytest.mark.parametrize("name", COMMANDS)
def test_where_no_file_can_be_nothing_is_written_by_force_either(mirotwin, line, tmp_path, name):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    before = sorted(tmp_path.iterdir())
    for place, what in (
        ("folder", "is a folder"),
        ("gone/mine", "there is no folder"),
        ("pipe", "exists and is not a regular file"),
    ):
        for options in {(), forces(name)}:
            said = mirotwin.refuses(*line(name, tmp_path / place), *options)
            assert said.startswith(f"{tmp_path / place}: {what}")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", READING)
def test_the_file_that_is_read_is_never_replaced(mirotwin, line, tmp_path, name):
    (path,) = (word for word in line(name, "") if word in list(tmp_path.iterdir()))
    link, before = tmp_path / "link", path.read_bytes()
    link.symlink_to(path)
    for place in (path, link):
        said = mirotwin.refuses(*line(name, place), *forces(name))
        assert f"is the input itself; choose another file with {COMMANDS[name][-1]}" in said
    assert path.read_bytes() == before
