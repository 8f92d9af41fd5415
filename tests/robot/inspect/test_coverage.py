"""lcov tracefiles: written, read back, added up, and read by lcov itself; and coverage, which says of each C line what
its instructions did.
"""

import os
import shutil
from contextlib import suppress
from copy import deepcopy

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
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
from miro_robot.inspect.lcov import FileRecord, add, decode, encode
from miro_robot.inspect.watcher import attach
from miro_robot.mcs51.opcodes import is_conditional
from tests import children
from tests.alone import Alone
from tests.robot.inspect.programs import SWITCH, build, line_of

COUNTS = st.integers(0, 10**12)
LINES = st.integers(1, 3) | st.integers(1, 9999)
NAMES = st.sampled_from(["_main", "_tick"])
PATHS = st.sampled_from(["a.c", "src/b.c"])
RECORDS = st.builds(
    FileRecord,
    lines=st.dictionaries(LINES, COUNTS, max_size=8),
    functions=st.dictionaries(NAMES, st.tuples(LINES, COUNTS)),
    branches=st.dictionaries(
        st.tuples(LINES, st.integers(0, 1), st.integers(0, 1)), st.none() | COUNTS, max_size=8
    ),
)
TRACEFILES = st.dictionaries(PATHS, RECORDS)


@settings(max_examples=40)
@given(TRACEFILES)
def test_what_is_written_is_read_back(tracefile):
    assert decode(encode(tracefile), "x.info") == tracefile


@pytest.mark.parametrize("name", ["0,1", "12,main", "3,4,5", "1,", "operator,"])
def test_a_name_that_begins_like_a_line_is_read_back_as_a_name(name):
    tracefile = {"a.c": FileRecord(functions={name: (7, 2)})}
    assert decode(encode(tracefile), "x.info") == tracefile


@settings(max_examples=40)
@given(TRACEFILES, TRACEFILES)
def test_adding_up_does_not_depend_on_the_order(one, other):
    forth, back = deepcopy(one), deepcopy(other)
    add(forth, other)
    add(back, one)
    for tracefile in (forth, back):  # a function keeps the line of the file that came first
        for record in tracefile.values():
            record.functions = {name: (0, count) for name, (_, count) in record.functions.items()}
    assert forth == back


@settings(max_examples=40)
@given(TRACEFILES)
def test_a_run_added_to_itself_has_every_count_twice_and_no_line_more(tracefile):
    total = deepcopy(tracefile)
    add(total, tracefile)
    for path, record in tracefile.items():
        assert total[path].lines == {line: 2 * count for line, count in record.lines.items()}
        assert total[path].branches == {
            branch: None if times is None else 2 * times for branch, times in record.branches.items()
        }


@settings(max_examples=40)
@given(TRACEFILES, TRACEFILES)
def test_tracefiles_put_one_behind_the_other_read_as_their_sum(one, other):
    total = deepcopy(one)
    add(total, other)
    assert decode(encode(one) + encode(other), "x.info") == total


LCOV_2 = """#written by lcov 2
TN:first
SF:a.cpp
VER:7
FNL:0,3,9
FNA:0,2,_Z1fIiE
FNA:0,0,_Z1fIcE
FNL:4,12
FNA:4,5,main
FNF:2
FNH:2
BRF:0
BRH:0
DA:3,2
DA:12,5,d41d8cd98f00b204e9800998ecf8427e
LF:2
LH:2
end_of_record
"""
NOT_KEPT = "not kept; add the files up with `lcov --add-tracefile`"


def test_functions_are_read_as_lcov_2_writes_them():
    functions = {"_Z1fIiE": (3, 2), "_Z1fIcE": (3, 0), "main": (12, 5)}
    assert decode(LCOV_2, "x.info") == {"a.cpp": FileRecord({3: 2, 12: 5}, functions)}


@pytest.mark.parametrize(
    ("record", "said"),
    [
        ("FNA:5,1,g", "names function 5, which no FNL record before it has; give a file"),
        ("FNL:5", "cannot be read as FNL record; give a file"),
        ("FNA:0,g", "cannot be read as FNA record; give a file"),
        ("MCDC:10,2,t,1,0,enable", f"MCDC records are {NOT_KEPT}"),
        ("BRDA:10,e0,1,4", f"branches that are marked or named are {NOT_KEPT}"),
        ("BRDA:10,0,!enable,0", f"branches that are marked or named are {NOT_KEPT}"),
        ("NEW:1,2", f"NEW records are {NOT_KEPT}"),
    ],
)
def test_nothing_is_lost_without_a_word(record, said):
    with pytest.raises(BadInput) as caught:
        decode(LCOV_2.replace("LF:2", record), "x.info")
    assert str(caught.value).startswith(f"x.info:16: {said}")


def test_functions_of_one_file_do_not_lend_their_lines_to_the_next():
    with pytest.raises(BadInput, match=r"x\.info:21: names function 0, which no FNL record"):
        decode(LCOV_2 + "TN:\nSF:b.cpp\nFNA:0,1,f\nend_of_record\n", "x.info")


@settings(max_examples=40)
@given(st.text(max_size=200))
def test_any_text_is_a_tracefile_or_is_refused(text):
    with suppress(BadInput):
        assert isinstance(decode(text, "x.info"), dict)


@pytest.mark.parametrize(
    ("text", "line"),
    [("DA:1,2\n", 1), ("SF:a.c\nDA:1\n", 2), ("SF:a.c\nend_of_record\nDA:1,2\n", 3), ("TN:\nhello\n", 2)],
)
def test_a_record_out_of_place_is_named(text, line):
    with pytest.raises(BadInput, match=rf"^x\.info:{line}: .*; give a file"):
        decode(text, "x.info")


@pytest.mark.skipif(shutil.which("lcov") is None and not os.environ.get("CI"), reason="needs lcov")
def test_lcov_counts_what_is_written(tmp_path):
    record = FileRecord(
        lines={3: 0, 5: 7}, functions={"_f": (3, 0), "_g": (5, 7)}, branches={(5, 0, 0): 7, (5, 0, 1): 0}
    )
    (tmp_path / "a.c").write_text("\n" * 9)
    (tmp_path / "a.info").write_text(encode({str(tmp_path / "a.c"): record}))
    command = ["lcov", "--summary", "a.info", "--rc", "lcov_branch_coverage=1"]
    shown = children.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    text = shown.stdout + shown.stderr
    assert "50.0% (1 of 2 lines)" in text
    assert "50.0% (1 of 2 functions)" in text
    assert "50.0% (1 of 2 branches)" in text


def test_a_long_word_is_no_kind_of_record_and_is_not_repeated():
    for word in ("X" * 20_000, "\x00" * 20_000 + "A", "A\udcff"):
        with pytest.raises(BadInput) as caught:
            decode(f"{word}:1\n", "x.info")
        assert (
            str(caught.value)
            == "x.info:1: is no record of a tracefile; give a file that was written as lcov tracefile"
        )


# ------------------------------------------------------------------------------- coverage


def counts_after(image, cycles):
    machine = Alone(image)
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
