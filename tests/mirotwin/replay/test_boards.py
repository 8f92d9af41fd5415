"""Boards without a robot are compared as robots are: what they send, their states, the instruction."""

import json
from functools import partial

import pytest

from miro_protocol.transmission import DOWN, Transmission
from miro_robot.board_spec import BoardSpec
from miro_sim.scenario.board import BoardScenario
from mirotwin.recording.compare import CompareRule
from mirotwin.replay.difference import ComparedRun, compare_runs
from mirotwin.replay.lockstep.annotated_image import annotated_of
from mirotwin.replay.text import difference_lines
from mirotwin.runs.spec import RunSpec
from tests.mirotwin.conftest import hex_file
from tests.robot.mcs51.asm import assemble, image_of

CRYSTAL_HZ = 11_059_200
BIT_TICKS = CRYSTAL_HZ // 9600
ECHO = """
    MOV TMOD,#20h
    MOV TH1,#0FDh
    SETB TR1
    MOV SCON,#50h
wait:
    JNB RI,wait
    CLR RI
    MOV A,SBUF
    ADD A,#{}
    MOV SBUF,A
    SJMP wait
"""


def spec(image):
    scenario = BoardScenario(board=BoardSpec(crystal_hz=CRYSTAL_HZ), bit_ticks=BIT_TICKS)
    return RunSpec(scenario=scenario, image=image, script=[Transmission(50_000, DOWN, b"hello")])


def compared(kind, *images):
    runs = []
    for image in images:
        world = spec(image).world()
        runs.append(ComparedRun([world.step() for _ in range(3)], [spec(image)]))
    annotate = partial(annotated_of, images=(), sources=())
    return compare_runs(*runs, CompareRule(kind=kind), (annotate, annotate), ("A", "B"))


@pytest.mark.parametrize("kind", ["bits", "bytes"])
def test_two_boards_that_answer_alike_are_the_same(kind):
    assert compared(kind, image_of(ECHO.format(0)), image_of(ECHO.format(0))).differences == []


@pytest.mark.parametrize("kind", ["bits", "bytes"])
def test_another_answer_is_named_with_its_time_by_the_crystal_and_the_instruction(kind):
    found = compared(kind, image_of(ECHO.format(0)), image_of(ECHO.format(1)))
    first = found.differences[0]
    assert first.tick > 50_000 + 9 * BIT_TICKS
    assert first.recorded.startswith("68")
    assert first.replayed.startswith("69")
    assert found.state.tick < first.tick
    assert found.instruction.changed.one.text == "ADD A,#00h"
    assert found.as_json(False)["first"]["t_s"] == first.tick / CRYSTAL_HZ
    lines = [*difference_lines(found, "the images differ")]
    assert f"tick {first.tick} ({first.tick / CRYSTAL_HZ:.6f} s), /net0/wire: A 68" in lines[0]
    assert "the first changed instruction that is executed: A tick " in lines[2]
    place = found.instruction.changed.one
    assert f"({place.tick / CRYSTAL_HZ:.6f} s)" in lines[2]


@pytest.fixture
def images(tmp_path):
    return [hex_file(tmp_path / f"{name}.ihx", assemble(ECHO.format(name))) for name in (0, 1)]


@pytest.fixture
def stream(tmp_path):
    path = tmp_path / "hello.stream"
    header = f"#: [bare]\n#: crystal_hz = {CRYSTAL_HZ}\n#: bit_ticks = {BIT_TICKS}\n"
    path.write_text(f"# mirotwin stream 2\n{header}50000 > 68 65 6c 6c 6f\n")
    return path


def test_diff_takes_two_images_of_any_board_with_a_stream_for_it(mirotwin, images, stream):
    code, out, err = mirotwin("diff", *images, "--on", stream)
    assert code == 4
    assert "the images differ in control period 0, tick " in err
    assert "/net0/wire: A 68 65 6c 6c 6f at tick " in err
    assert "the first changed instruction that is executed: A tick " in err
    assert "firmware code, the first of 1 byte" in out
    assert "on" in mirotwin.succeeds("diff", images[0], images[0], "--on", stream, "-q")


def test_a_fault_of_one_of_two_boards_is_named(mirotwin, images, stream, tmp_path):
    faulty = hex_file(tmp_path / "faulty.ihx", assemble("SJMP far\nfar:\nDB 0A5h"))
    err = mirotwin.ends(4, "diff", images[0], faulty, "--on", stream, "-q")
    assert "B: firmware fault: firmware executed the undefined opcode A5" in err


@pytest.mark.parametrize("kind", ["commands", "wheels"])
def test_what_only_robots_have_is_not_compared_of_boards(mirotwin, images, stream, kind):
    err = mirotwin.refuses("diff", *images, "--on", stream, "--compare", kind)
    assert f"--compare {kind}: is for robots, and {stream} is for a board alone; compare bits or bytes" in err


def test_times_on_the_command_line_are_those_of_the_boards_crystal(mirotwin, images, stream):
    document = json.loads(mirotwin("diff", *images, "--on", stream, "--json", "--to", "100ms")[1])
    assert document["to_tick"] == CRYSTAL_HZ // 10
    assert (document["period"], document["periods"]) == (0, {"a": 1, "b": 1})
