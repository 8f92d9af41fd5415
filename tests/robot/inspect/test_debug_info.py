"""C lines and functions of an image: from the listing, from the .cdb, and without either."""

import re
import shutil

import pytest

from miro_robot.firmware import image_path
from miro_robot.image import ImageError, load_hex
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.image.symbol_files import SourceLine, parse_cdb, parse_map
from miro_robot.image.variables import parse_variables
from tests.robot.inspect.programs import PROGRAM, build, line_of


def copied(program, folder, *suffixes):
    """The image in a folder of its own, with only these files beside it."""
    for suffix in (".ihx", *suffixes):
        shutil.copy(program.with_suffix(suffix), folder)
    return load_hex(folder / program.name)


def test_every_line_with_code_is_found_in_the_listing_and_in_the_cdb_alike(program, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    listing = DebugInfo.of(copied(program, tmp_path / "a", ".rst", ".map"))
    cdb = DebugInfo.of(copied(program, tmp_path / "b", ".cdb", ".map"))
    expected = {
        line_of(text) for text in ("if (value > 2)", "total += value", "total++", "total = 0", "add(")
    }
    for debug in (listing, cdb):
        lines = {line for _, line in debug.lines}
        assert {SourceLine("program.c", number) for number in expected} <= lines
        assert {line.file for line in lines} == {"program.c"}


def test_functions_span_from_their_first_instruction_to_behind_their_return(program):
    debug = DebugInfo.of(load_hex(program))
    image = load_hex(program)
    names = [function.name for function in debug.functions]
    assert names == ["_add", "_never", "_main"]
    heads = ("static void add", "void never")
    for function, head in zip(debug.functions[:2], heads, strict=True):
        assert image.code[function.end - 1] == 0x22  # RET
        assert function.line == SourceLine("program.c", line_of(head))
        assert debug.function_at(function.first) is function
        assert debug.function_at(function.end) is not function


def test_code_of_the_library_belongs_to_no_line(program):
    debug = DebugInfo.of(load_hex(program))
    assert debug.line_at(0) is None
    assert debug.line_at(debug.functions[0].first - 1) is None
    assert debug.line_at(debug.functions[-1].end) is None


def test_tables_are_told_from_instructions(program):
    image = load_hex(program)
    table = image.symbols.find("table")
    debug = DebugInfo.of(image)
    assert all(debug.is_constant(table.address + number) for number in range(5))
    assert not debug.is_constant(debug.functions[0].first)


def test_an_image_alone_has_no_lines_and_no_functions(program, tmp_path):
    debug = DebugInfo.of(copied(program, tmp_path))
    assert (debug.lines, debug.functions, debug.constants) == ([], [], ())
    assert debug.line_at(0) is None
    assert debug.function_at(0) is None


def test_the_robots_image_has_the_lines_of_inlined_functions_too():
    """SDCC 4.2.0 leaves them out of the .cdb: the image comes with its listing for that."""
    debug = DebugInfo.of(load_hex(image_path()))
    byte = next(function for function in debug.functions if function.name == "_crc_byte")
    nibble = next(function for function in debug.functions if function.name == "_crc_nibble")
    inlined = {debug.line_at(address) for address in range(byte.first, byte.end)}
    assert inlined & {debug.line_at(address) for address in range(nibble.first, nibble.end)}


def test_sources_are_taken_from_the_first_folder_that_has_them(program, tmp_path):
    sources = Sources([tmp_path, program.parent])
    first_line = SourceLine("program.c", 1)
    assert sources.text(first_line) == PROGRAM.splitlines()[0]
    (tmp_path / "program.c").write_text("other\n")
    assert Sources([tmp_path, program.parent]).text(first_line) == "other"
    assert Sources([tmp_path]).text(SourceLine("program.c", 7)) == ""
    assert Sources([]).path("program.c") is None


def test_the_listing_of_another_image_is_refused_with_its_line(program, tmp_path):
    copied(program, tmp_path, ".rst", ".map", ".cdb")
    listing = tmp_path / "program.rst"
    text = re.sub(r"(?m)^( {6}[0-9A-F]{6}) 22 ", r"\1 32 ", listing.read_text(), count=1)
    listing.write_text(text)
    with pytest.raises(ImageError, match=r"program\.rst:\d+: is the listing of another image: 0x"):
        DebugInfo.of(load_hex(tmp_path / program.name))


def test_without_functions_a_line_ends_where_the_next_symbol_begins(tmp_path):
    """Built without --debug: only map and listing tell where library code begins."""
    image = load_hex(
        build(tmp_path, "long a, b, c;\nvoid main(void)\n{\n    c = a / b;\n}\n", "--opt-code-size")
    )
    debug = DebugInfo.of(image)
    assert not [function for function in debug.functions if function.name == "_main"]
    division = image.symbols.find("__divslong").address
    assert debug.line_at(image.symbols.find("_main").address).file == "program.c"
    assert debug.line_at(division) is None
    assert debug.line_at(division + 40) is None


def test_modules_without_a_listing_have_the_lines_of_the_cdb(program, tmp_path):
    image = copied(program, tmp_path, ".map", ".cdb")
    (tmp_path / "program.rst").write_text("nothing of use\n")
    assert {line.file for _, line in DebugInfo.of(image).lines} == {"program.c"}


DIGITS = "9" * 5000


@pytest.mark.parametrize(
    ("suffix", "line"),
    [
        (".rst", f"      1 ;\trobot.c:{DIGITS}: main();"),
        (".cdb", f"L:C$robot.c${DIGITS}$0$0:0"),
        (".cdb", f"L:C$robot.c$1$0$0:{DIGITS}"),
        (".cdb", f"L:G$main$0$0:{DIGITS}\nL:XG$main$0$0:{DIGITS}"),
        (".cdb", f"S:G$main$0_0$0({{2}}DF,SV:S),C,0,0\nL:G$main$0$0:{DIGITS}"),
    ],
)
def test_a_record_whose_number_has_digits_without_end_is_no_record(tmp_path, suffix, line):
    """Python converts no more than 4300 digits."""
    path = tmp_path / "robot.ihx"
    path.write_text(":0200000080FE80\n:00000001FF\n")
    path.with_suffix(suffix).write_text(line + "\n")
    image = load_hex(path)
    debug = DebugInfo.of(image)
    assert (debug.lines, debug.functions, image.symbols.names) == ([], [], {})


def test_no_file_has_a_line_0(tmp_path):
    (tmp_path / "program.c").write_text("first\nlast\n")
    assert Sources([tmp_path]).text(SourceLine("program.c", 0)) == ""


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b"])
def test_a_source_whose_name_no_file_can_have_is_not_found(tmp_path, name):
    assert Sources([tmp_path]).path(name) is None


# ----------------------------------------- records that cannot be are left out, those around them read

_POINT = "T:Fmain$point[({0}S:S$x$0_0$0({4}SF:S),Z,0,0)]"


@pytest.mark.parametrize(
    "damaged",
    [
        ["S:G$x$0_0$0({3}SF:S),E,0,0"],  # a float has 4 bytes
        ["S:G$x$0_0$0({1}SB0$0:S),E,0,0"],  # no bit
        ["S:G$x$0_0$0({1}SB5$4:S),E,0,0"],  # bits behind the end
        ["S:G$x$0_0$0({0}SI:S),E,0,0"],
        ["S:G$x$0_0$0({0}DA999999d,SC:S),E,0,0"],
        ["S:G$x$0_0$0({0}" + "DA999d," * 4 + "SC:S),E,0,0"],
        ["S:G$x$0_0$0({70000}DA70000d,SC:S),E,0,0"],
        ["S:G$x$0_0$0({1}" + "DA1d," * 2000 + "SC:S),E,0,0"],
        ["T:Fmain$self[({0}S:S$x$0_0$0({1}STself:S),Z,0,0)]", "S:G$x$0_0$0({1}STself:S),E,0,0"],
        [_POINT, "S:G$x$0_0$0({3}STpoint:S),E,0,0"],  # its member ends after it
        [
            *(
                f"T:Fmain$p{at}[" + f"({{0}}S:S$y$0_0$0({{1}}STp{at + 1}:S),Z,0,0)" * 9 + "]"
                for at in range(8)
            ),
            "S:G$x$0_0$0({1}STp0:S),E,0,0",
        ],  # 9 to the power of 8 numbers, all in one place
    ],
)
def test_a_variable_whose_type_cannot_be_is_left_out_at_once(damaged):
    good = [_POINT, "S:G$good$0_0$0({8}DA2d,STpoint:S),E,0,0", "L:G$good$0_0$0:10"]
    text = "\n".join(["M:main", *damaged, "L:G$x$0_0$0:8", *good])
    assert list(parse_variables(text).by_name) == ["good"]


def test_a_variable_beyond_any_memory_is_left_out():
    text = "S:G$x$0_0$0({1}SC:U),E,0,0\nL:G$x$0_0$0:{}\n"
    assert list(parse_variables(text.replace("{}", "FFFF")).by_name) == ["x"]
    for address in ("10000", "7FFFFFFF", "FFFFFFFF"):
        assert parse_variables(text.replace("{}", address)).by_name == {}


@pytest.mark.parametrize(("address", "found"), [("0000FFFF", True), ("00010000", False), ("FFFFFFFE", False)])
def test_a_name_or_a_line_beyond_any_memory_is_no_record(address, found):
    page = "CSEG  00000000  0000001A =  26. bytes (REL,CON,CODE)\n"
    assert bool(parse_map(f"{page}C:   {address}  _far   named\n").names) is found
    short = address.lstrip("0")
    cdb = parse_cdb(
        f"S:G$far$0_0$0({{2}}DF,SV:S),C,0,0\nL:G$far$0$0:{short}\nL:XG$far$0$0:{short}\nL:C$a.c$7$1$1:{short}\n"
    )
    assert [bool(part) for part in (cdb.names, cdb.begins, cdb.ends, cdb.lines)] == [found] * 4


def test_a_bit_is_no_byte_of_ram_whatever_its_area_says_of_itself():
    """Linkers write the area of bits with and without the word BIT."""
    for attributes in ("REL,CON", "REL,CON,BIT"):
        page = f"BSEG  00000000  00000003 =  3. bytes ({attributes})\n"
        assert (
            parse_map(f"{page}     00000000  _at_most_PARM_2   b\n").names["_at_most_PARM_2"].space == "bit"
        )
