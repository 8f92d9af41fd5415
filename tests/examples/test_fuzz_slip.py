"""The example of a foreign firmware: SLIP frames with a checksum, its format and its check as plug-ins."""

import shutil
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol.protocol import Damage, Frame
from miro_robot.image import load_hex
from tests import children
from tests.examples.rig import EXAMPLES, MIROTWIN, run
from tests.mutants.sdcc import needs_sdcc

EXAMPLE = EXAMPLES / "fuzz-slip"
CRYSTAL_HZ = 11_059_200
CHECK = f"{EXAMPLE / 'dimmer_check.py'}:LampsAsTold"
CASES = sorted((EXAMPLE / "cases").glob("*.stream"))


@pytest.fixture(scope="module", autouse=True)
def on_the_path():
    sys.path.insert(0, str(EXAMPLE))
    yield
    sys.path.remove(str(EXAMPLE))


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    """Both firmwares, built by the example's Makefile in a folder whose name has a space."""
    folder = shutil.copytree(
        EXAMPLE, tmp_path_factory.mktemp("slip") / "a dimmer", ignore=shutil.ignore_patterns("build")
    )
    children.run(["make", "-s", "-C", folder], check=True)
    return {name: load_hex(folder / "build" / f"{name}.ihx") for name in ("dimmer", "mended")}


def slip():
    from slip_protocol import Slip

    return Slip()


def target(image, kind="frames", check=False):
    from mirotwin.fuzz.board_target import BoardTarget
    from mirotwin.verify.expectations import checks_alone

    checks = checks_alone([CHECK]) if check else ()
    return BoardTarget(image, kind, slip(), checks, crystal_hz=CRYSTAL_HZ)


@given(st.lists(st.binary(min_size=1, max_size=40), max_size=4))
def test_frames_are_decoded_as_they_were_encoded(bodies):
    wires = [slip().encode(body) for body in bodies]
    found = slip().decode(b"".join(wires))
    assert [one.body for one in found if isinstance(one, Frame)] == bodies
    assert [one.end - one.start for one in found] == [len(wire) for wire in wires]


@given(st.binary(max_size=40), st.binary(max_size=20))
def test_any_bytes_are_repaired_and_garbage_costs_at_most_itself(body, garbage):
    wire = slip().repair(body)
    found = slip().decode(garbage + wire)
    assert found[-1] == Frame(body or b"\0", found[-1].start, len(garbage + wire))
    assert all(isinstance(one, Damage) or one.end <= len(garbage) for one in found[:-1])


@needs_sdcc
@pytest.mark.parametrize("name", ["dimmer", "mended"])
def test_the_firmware_answers_what_the_format_says(images, name):
    dimmer = target(images[name], check=True)
    for body, answer in (
        (b"\x01\x02\x64", b"\x01\x02\x64"),
        (b"\x02\x01", b"\x02\x01\x00"),
        (b"\x03lamp", b"\x03\x04"),
        (b"\x04", b"\x04"),
        (b"\x01\x02\x65", None),  # too bright
        (b"\x01\x03\x00", None),  # no such lamp
    ):
        assert dimmer.run(bytes([len(body) - 1]) + body) == 0
        sent = bytes(value for value, _ in dimmer.bus.sent)
        assert sent == (b"" if answer is None else slip().encode(answer))
    dimmer.run(b"\x02\x01\x02\x64")
    assert dimmer.subject.memory["level"] == [0, 0, 100]
    assert dimmer.subject.memory["level[2]"] == 100


@needs_sdcc
def test_its_mistake_is_found_among_the_escapes_and_the_mended_one_stands(images):
    for count, code in ((12, 0), (18, 3), (31, 1)):
        data = bytes([count, 3]) + b"\xc0" * count
        assert target(images["dimmer"], check=True).run(data) == code
        assert target(images["mended"], check=True).run(data) == 0


@needs_sdcc
@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_its_finds_fail_again_and_the_mended_one_cures_them(images, path):
    from mirotwin.runs.job import load_stream
    from mirotwin.verify.expectations import as_settings

    as_settings([CHECK])
    again = load_stream(f"{path}", f"{images['dimmer'].path}").judge_case()
    assert again.texts[0].startswith("fails as recorded: ")
    assert again.code == (3 if "no_fault" in path.stem else 1)
    cured = load_stream(f"{path}", f"{images['mended'].path}").judge_case()
    assert (cured.code, cured.texts[0].partition(":")[0]) == (0, "cured")


@pytest.mark.slow
@needs_sdcc
def test_the_command_of_its_page_finds_both_and_nothing_in_the_mended_one(images, tmp_path):
    """Its finds are given as seeds, so that a second is enough."""
    for name, code in (("dimmer", 1), ("mended", 0)):
        out = tmp_path / name
        options = ["--bare", "--crystal", CRYSTAL_HZ, "--expect", CHECK, "--expect-all", "--time", "1s"]
        options += ["--corpus", EXAMPLE / "cases", "--out", out]
        done = run(EXAMPLE, MIROTWIN, "fuzz", images[name].path, *options)
        assert done.returncode == code, done.stdout + done.stderr
        found = {path.name.partition("-")[0] for path in out.glob("crashes/*.stream")}
        assert found == ({"lamps_as_told", "no_fault"} if code else set())


def test_there_is_a_find_of_each_kind():
    assert {path.stem.partition("-")[0] for path in CASES} == {"no_fault", "lamps_as_told"}
