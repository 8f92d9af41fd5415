"""The board page's tables of the LM629: what they say is what the shipped firmware tells the chips."""

import re
from pathlib import Path

import pytest

from miro_robot.lm629.commands import BY_NAME, COMMANDS
from tests.robot.firmware.rig import Rig

PAGE = (Path(__file__).parents[3] / "robot_fw/README.md").read_text("utf-8")
RDSIGS = 0x0C


def rows(heading):
    """The cells of the text in columns below a heading: its head says where each column begins."""
    part = PAGE.split(f"### {heading}\n")[1].split("\n##")[0]
    head, *lines = part.split("```text\n")[1].split("```")[0].splitlines()
    starts = [match.start() for match in re.finditer(r"(?:^|(?<=  ))\S", head)]
    return [
        [line[start:end].strip() for start, end in zip(starts, [*starts[1:], None], strict=True)]
        for line in lines
    ]


def said(when):
    """What the page says a chip is told, as hex strings: the codes of its row, before a semicolon."""
    (row,) = [row for row in rows("LM629: what a robot says, byte by byte") if row[0].startswith(when)]
    return [code.replace(" ", "").lower() for code in row[2].partition(";")[0].split(", ")]


def told(rig):
    def text(command):
        return f"{command.opcode:02x}{command.data.hex()}"

    return [
        [text(command) for command in rig.told(chip) if command.opcode != RDSIGS]
        for chip in (rig.board.left, rig.board.right)
    ]


def test_the_set_up_on_the_page_is_the_firmwares():
    rig = Rig(boot=False)
    rig.run_ms(4)
    parts = (
        "after power-on",
        "no interrupts",
        "largest position error",
        "gains",
        "acceleration at the start",
    )
    wanted = [code for part in parts for code in said(part)]
    assert told(rig) == [wanted, wanted]


@pytest.mark.parametrize("velocity", [300, -300])
def test_the_velocities_on_the_page_are_the_firmwares(velocity):
    rig = Rig()
    rig.team(0, velocity, velocity)
    wanted = said(f"velocity {velocity:+d}") + said("then, for both")
    assert told(rig) == [wanted, wanted]


def test_stop_and_motors_off_on_the_page_are_the_firmwares():
    rig = Rig()
    rig.team(0, 300, 300)
    told(rig)
    rig.run_ms(600)
    wanted = said("smooth stop") + said("motors off")
    assert told(rig) == [wanted, wanted]


def test_each_opcode_and_its_words_stand_on_the_page():
    found = {}
    for names, opcodes, data, _ in rows("LM629: the commands"):
        for name, opcode in zip(names.split(", "), opcodes.split(", "), strict=True):
            found[name] = (int(opcode.rstrip("h"), 16), data)
    assert {name: opcode for name, (opcode, _) in found.items()} == {one.name: one.opcode for one in COMMANDS}
    for name, (_, data) in found.items():
        command = BY_NAME[name]
        words = int(data[0]) if data else 0
        assert words == max(command.words_in, command.words_out), name
        assert data.endswith("in") == (command.words_in > 0), name
