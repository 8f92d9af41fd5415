"""Coverage says of each C line what its instructions did."""

import shutil

from miro_robot.bare.machine import BareMachine
from miro_robot.image import load_hex
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.inspect.counters import Counters
from miro_robot.inspect.coverage import (
    at_paths,
    by_line,
    by_listing,
    counts_of,
    instruction_share,
    instructions,
    line_share,
    merged,
    missed,
)
from miro_robot.inspect.lcov import FileRecord
from miro_robot.inspect.watcher import attach
from miro_robot.mcs51.opcodes import is_conditional
from tests.robot.inspect.programs import SWITCH, build, line_of


def counts_after(image, cycles):
    machine = BareMachine(image)
    counters = Counters()
    attach(machine.cpu, counters)
    machine.run(max_cycles=cycles)
    return counts_of(counters)


def test_lines_and_branches_of_a_c_program_are_counted_as_they_ran(program):
    """The table is A5h, 1, 2, 3, 12h: three values above 2, two not."""
    image = load_hex(program)
    record = by_line(image, DebugInfo.of(image), counts_after(image, 5000))["program.c"]
    assert record.lines[line_of("if (value > 2)")] == 5
    assert record.lines[line_of("total += value")] == 3
    assert record.lines[line_of("total++")] == 2
    assert record.lines[line_of("total = 0")] == 0
    assert record.functions["_add"] == (line_of("static void add"), 5)
    assert record.functions["_never"][1] == 0
    ways = [times for (line, _, _), times in record.branches.items() if line == line_of("if (value > 2)")]
    assert sorted(ways) == [2, 3]


def test_a_branch_that_was_never_come_to_is_not_one_that_never_jumped(program):
    image = load_hex(program)
    debug = DebugInfo.of(image)
    nothing = by_line(image, debug, {})["program.c"]
    assert set(nothing.branches.values()) == {None}
    assert line_share({"program.c": nothing}).hit == 0


def test_two_runs_merged_count_like_one_that_is_as_long(program):
    image = load_hex(program)
    one, other = counts_after(image, 40), counts_after(image, 5000)
    both = merged([one, other])
    for address in other:
        assert both[address] == tuple(
            a + b for a, b in zip(one.get(address, (0, 0)), other[address], strict=True)
        )


def test_an_image_without_debug_files_is_covered_by_its_listing(program, tmp_path):
    shutil.copy(program, tmp_path)
    image = load_hex(tmp_path / program.name)
    counts = counts_after(image, 5000)
    listing, record = by_listing(image, counts)
    lines = listing.splitlines()
    for number, count in record.lines.items():
        assert counts.get(int(lines[number - 1][:4], 16), (0, 0))[0] == count
    share = instruction_share(image, DebugInfo(), counts)
    assert (share.hit, share.total) == (record.lines_hit, len(record.lines))


def test_a_file_below_the_current_folder_is_named_relative_to_it(tmp_path):
    inside, outside = tmp_path / "here" / "src", tmp_path / "there"
    for folder, name in ((inside, "a.c"), (outside, "b.c")):
        folder.mkdir(parents=True)
        (folder / name).write_text("")
    found = at_paths(
        {name: FileRecord() for name in ("a.c", "b.c", "gone.c")},
        Sources([inside, outside]),
        (tmp_path / "here").resolve(),
    )
    assert set(found) == {"src/a.c", str((outside / "b.c").resolve()), "gone.c"}


def test_missed_lines_are_shown_as_ranges_that_lines_without_code_do_not_part():
    assert missed(FileRecord(lines={1: 0, 2: 0, 5: 0, 6: 3, 9: 0, 11: 1})) == "1-5, 9"
    assert missed(FileRecord(lines={1: 4})) == ""


def test_the_jump_table_of_a_switch_is_no_code(tmp_path):
    image = load_hex(build(tmp_path, SWITCH))
    counts = counts_after(image, 20_000)
    record = by_line(image, DebugInfo.of(image), counts)["program.c"]
    cases = [number for number, line in enumerate(SWITCH.splitlines(), 1) if "case " in line]
    assert [record.lines[number] for number in cases] == [1] * 20
    listed = {row.address for row in instructions(image, DebugInfo.of(image), {})}
    assert set(counts) <= listed


def test_a_table_in_a_bare_image_does_not_hide_what_ran(tmp_path):
    (tmp_path / "bare").mkdir()
    image = load_hex(shutil.copy(build(tmp_path, SWITCH), tmp_path / "bare"))
    counts = counts_after(image, 20_000)
    assert set(counts) <= {row.address for row in instructions(image, DebugInfo.of(image), counts)}


def test_a_comparison_that_jumps_nowhere_is_no_branch(tmp_path):
    """SDCC compares unsigned numbers by CJNE to the next instruction and JC."""
    text = "unsigned char a, b;\nvoid main(void)\n{\n    if (a < b)\n        b = 1;\n    for (;;)\n        ;\n}\n"
    image = load_hex(build(tmp_path, text))
    debug = DebugInfo.of(image)
    rows = [row for row in instructions(image, debug, {}) if is_conditional(row.data[0]) and not row.data[-1]]
    record = by_line(image, debug, counts_after(image, 2000)).get("program.c")
    assert record is not None
    assert len([branch for branch in record.branches if branch[0] == 4]) == 2
    assert all(
        debug.line_at(row.address) for row in rows if row.address >= image.symbols.find("_main").address
    )
