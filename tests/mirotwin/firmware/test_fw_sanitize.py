"""`mirotwin fw sanitize`: what it prints, its exit codes, what is allowed, and that no bit changes."""

import json
import shutil
from pathlib import Path

import pytest

from miro_robot.inspect.sanitizer import Sanitizer
from miro_robot.inspect.sanitizer_layout import layout_of
from mirotwin.firmware.subject import SubjectOptions, open_run
from mirotwin.runs.inspected_run import watch
from tests.mirotwin import program
from tests.robot.inspect.programs import build
from tests.robot.sanitizer.planted import RACES, planted

EXAMPLES = Path(__file__).parents[3] / "examples" / "boards"
ONCE = """\
#include <8052.h>
volatile unsigned int stamp, copy;
void tick(void) __interrupt(1) { stamp++; }
void main(void)
{
    volatile unsigned char turns = 20;
    TMOD = 1;
    TR0 = 1;
    ET0 = 1;
    EA = 1;
    TF0 = 1;
    while (--turns)
        ;
    for (;;)
        copy = stamp;
}
"""
"""Its interrupt comes before the first turn of its loop, and again only after 65536 cycles."""


@pytest.fixture(scope="module")
def races(tmp_path_factory):
    return build(tmp_path_factory.mktemp("races"), RACES)


def test_findings_are_lines_with_the_command_that_stands_there(mirotwin, races):
    code, out, _ = mirotwin("fw", "sanitize", races, "--to", "20ms")
    lines = out.splitlines()
    assert code == 3
    assert len(lines) == 2 * len(planted(RACES))
    assert lines[0].startswith("did race  program.c:")
    debug = lines[1].split()
    assert debug[:3] == ["mirotwin", "debug", str(races)]
    place = lines[0].split()[2]
    code, out, _ = mirotwin(*debug[1:], "-x", "where")
    assert code == 0
    assert f"{place} in main" in out


def test_what_only_may_happen_is_a_failure(mirotwin, tmp_path):
    code, out, _ = mirotwin("fw", "sanitize", build(tmp_path, ONCE), "--to", "5ms", "--json")
    assert code == 1
    assert [one["did"] for one in json.loads(out)["findings"]] == [False]


def test_what_is_allowed_is_left_out_and_what_is_not_found_is_reported(mirotwin, races, tmp_path):
    allow = tmp_path / "allow.txt"
    allow.write_text(
        "".join(f"{one}  # a test\n" for one in sorted(planted(RACES))) + "race program.c:1 x # gone\n"
    )
    code, out, err = mirotwin("fw", "sanitize", races, "--to", "20ms", "--allow", allow)
    assert code == 0
    assert out == "nothing found\n"
    assert "race program.c:1 x was not found" in err


@pytest.mark.parametrize(
    ("line", "says"), [("race program.c:1 x", "says no reason"), ("rare program.c:1  # x", "is no kind")]
)
def test_a_line_that_allows_without_a_reason_is_refused(mirotwin, races, tmp_path, line, says):
    allow = tmp_path / "allow.txt"
    allow.write_text(line)
    code, _, err = mirotwin("fw", "sanitize", races, "--to", "1ms", "--allow", allow)
    assert code == 2
    assert says in err


def test_one_kind_can_be_wanted(mirotwin, races):
    code, out, _ = mirotwin("fw", "sanitize", races, "--to", "20ms", "--kind", "overlay")
    assert (code, out) == (0, "nothing found\n")


def test_the_robots_firmware_has_no_findings_and_its_digest_stays(mirotwin, short):
    code, out, _ = mirotwin("fw", "sanitize", short)
    assert (code, out) == (0, "nothing found\n")
    digests = []
    for sanitized in (False, True):
        run = open_run(SubjectOptions(subject=str(short)))
        watch(run, [Sanitizer(layout_of(run.image))] if sanitized else [])
        digests.append(run.world.digest)
    assert digests[0] == digests[1]


@pytest.mark.slow
def test_uncompiled_it_finds_the_same(mirotwin, races):
    _, compiled, _ = mirotwin("fw", "sanitize", races, "--to", "5ms", "--json")
    done = program.run("fw", "sanitize", races, "--to", "5ms", "--json", "--engine", "python")
    assert done.stdout == compiled


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["fig6", "fig8", "sine", "waypoints"])
def test_the_shipped_firmware_is_silent(mirotwin, scenario):
    assert mirotwin("fw", "sanitize", scenario)[:2] == (0, "nothing found\n")


@pytest.mark.slow
@pytest.mark.parametrize("board", sorted(path.name for path in EXAMPLES.iterdir() if path.is_dir()))
def test_the_firmware_of_the_boards_is_silent(mirotwin, board, tmp_path):
    """Built again with debug files, which the examples do not carry."""
    folder = tmp_path / board
    shutil.copytree(EXAMPLES / board, folder)
    for source in folder.glob("*.c"):
        (made := tmp_path / f"{source.stem}-built").mkdir()
        built = build(made, source.read_text(), "--debug")
        for path in built.parent.glob("program.*"):
            shutil.copy(path, folder / f"{source.stem}{path.suffix}")
    for scenario in folder.glob("*.scenario.toml"):
        code, out, _ = mirotwin("fw", "sanitize", scenario, "--to", "3s")
        assert (code, out) == (0, "nothing found\n"), scenario.name
