"""Debug files that name files of somebody's machine: what they name is neither read nor shown."""

import os

import pytest

from miro_robot.image.debug_info import Sources, listings
from miro_robot.image.symbol_files import SourceLine

SECRET = "the password is 1234\n"


@pytest.fixture
def machine(tmp_path):
    """A folder with an image, and a secret beside it that links in the folder lead to."""
    (tmp_path / "secret.c").write_text(SECRET)
    (tmp_path / "secret.rst").write_text(SECRET)
    folder = tmp_path / "image"
    folder.mkdir()
    (folder / "main.c").write_text("int main;\n")
    (folder / "link.c").symlink_to(tmp_path / "secret.c")
    (folder / "up").symlink_to(tmp_path)
    (folder / "circle.c").symlink_to(folder / "circle.c")
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe.c")
    return folder


@pytest.mark.parametrize(
    "name",
    ["../secret.c", "{}/secret.c", "link.c", "up/secret.c", "circle.c", "pipe.c", "x\0y", "a" * 5000, ".", "..", "",
     "/proc/self/environ", "/dev/zero", "/proc/self/fd/0", "../image/../secret.c"],
)  # fmt: skip
def test_a_source_outside_of_the_folders_is_not_read(machine, name):
    line = SourceLine(name.format(machine.parent), 1)
    sources = Sources([machine])
    assert sources.path(line.file) is None
    assert sources.text(line) == ""


def test_a_source_of_elsewhere_is_found_by_its_name_in_the_folder(machine):
    assert Sources([machine]).text(SourceLine("/home/somebody/main.c", 1)) == "int main;"
    assert Sources([machine]).text(SourceLine("../image/main.c", 1)) == "int main;"


@pytest.mark.parametrize("name", ["../secret", "{}/secret", "up/secret"])
def test_a_listing_outside_of_the_folders_is_not_read(machine, name):
    module = name.format(machine.parent)
    assert list(listings(machine / "mine.ihx", f"{module}.rel   [ ]\n")) == []
