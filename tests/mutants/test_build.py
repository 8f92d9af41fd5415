"""Changed firmware is built as its Makefile builds it, each text once."""

import pytest

from miro_robot.firmware import image_path
from tests import children
from tests.mutants.build import SOURCE, build, shipped
from tests.mutants.draw import source_files
from tests.mutants.sdcc import needs_sdcc

pytestmark = needs_sdcc
SOURCES = source_files()


def changed(file, right, wrong):
    assert right in SOURCES[file]
    return {file: SOURCES[file].replace(right, wrong)}


def test_the_sources_as_they_are_make_the_shipped_image():
    assert shipped().image.read_bytes() == image_path().read_bytes()
    assert build(changed("main.c", "/* The robot's", "/* A robot's")).is_shipped


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        changed("failsafe.c", "age == FAILSAFE_STOP_MS", "age == 90"),
        changed("protocol.h", "110     /* smooth stop */", "90      /* smooth stop */"),
    ],
    ids=["a C file", "a header"],
)
def test_an_image_is_that_of_a_build_from_nothing(change, tmp_path):
    for name, text in (SOURCES | change).items():
        (tmp_path / name).write_text(text)
    for name in ("Makefile", "sdcc.version"):
        (tmp_path / name).write_text((SOURCE / name).read_text())
    make = ["make", "-s", "-C", tmp_path, f"OUT={tmp_path / 'out'}", f"BUILD={tmp_path / 'made'}"]
    children.run(list(map(str, make)), check=True)
    built = build(change, tmp_path / "cache")
    assert built.image.read_bytes() == (tmp_path / "out" / "miro.ihx").read_bytes()
    assert not built.is_shipped


@pytest.mark.slow
def test_a_text_is_built_once(tmp_path):
    change = changed("failsafe.c", "age == FAILSAFE_STOP_MS", "age == 90")
    first = build(change, tmp_path)
    time_ns = first.image.stat().st_mtime_ns
    assert build(change, tmp_path) == first
    assert first.image.stat().st_mtime_ns == time_ns
    assert build(change, tmp_path / "other").image.read_bytes() == first.image.read_bytes()


def test_what_does_not_compile_says_why_and_leaves_no_image(tmp_path):
    built = build(changed("main.c", "    EA = 1;", "    EB = 1;"), tmp_path)
    assert built.error == "main.c:45: error 20: Undefined identifier 'EB'"
    assert not built.image.exists()
    assert not built.is_shipped
    assert not list(tmp_path.glob("making-*"))


def test_a_file_that_the_firmware_does_not_have_is_refused():
    with pytest.raises(ValueError, match=r"^the firmware has no file mian\.c$"):
        build({"mian.c": ""})
