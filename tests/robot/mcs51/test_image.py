"""Reading images: what is accepted, and how every refusal names file, line, reason and remedy. A symbol file of another
image is refused; an unusual one of this image is not.
"""

import hashlib
import re
import shutil

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from intelhex import HexReaderError, IntelHex

from miro_robot.firmware import image_path
from miro_robot.image import ImageError, Symbol, load_hex
from miro_robot.image.evidence import check_cdb, check_map
from miro_robot.image.symbol_files import parse_cdb, parse_map
from tests import children
from tests.robot.mcs51.asm import hex_text

ROBOT = image_path()
MAP = ROBOT.with_suffix(".map").read_text()
CDB = ROBOT.with_suffix(".cdb").read_text()
IMAGE = load_hex(ROBOT)
LOADED = bytes(any(first <= address < end for first, end in IMAGE.used) for address in range(0x10000))
MOVED_FROM = 0x400
needs_sdcc = pytest.mark.skipif(shutil.which("sdcc") is None, reason="sdcc is not installed")
END = ":00000001FF"


def record(address, data, kind=0):
    body = bytes([len(data)]) + address.to_bytes(2, "big") + bytes([kind]) + bytes(data)
    return ":" + (body + bytes([-sum(body) & 0xFF])).hex().upper()


def written(tmp_path, *lines):
    path = tmp_path / "robot.ihx"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_an_image_that_an_editor_saved_in_another_encoding_is_read(tmp_path, encoding):
    path = tmp_path / "robot.hex"
    path.write_bytes(f"{record(0, [2, 0, 16])}\r\n{END}\r\n".encode(encoding))
    assert load_hex(path).used == ((0, 3),)


def test_bytes_ranges_size_and_hash_of_an_image(tmp_path):
    path = written(tmp_path, record(0, b"\x02\x00\x10"), record(0x10, b"\x80\xfe"), END)
    image = load_hex(path)
    assert image.code[:3] == b"\x02\x00\x10"
    assert image.code[3:0x10] == b"\xff" * 13
    assert len(image.code) == 0x10000
    assert image.used == ((0, 3), (0x10, 0x12))
    assert image.size == 5
    assert image.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert image.symbols.find("main") is None
    assert repr(image).startswith("Image('robot.ihx', 5 bytes")


def test_extended_address_and_start_records_are_understood(tmp_path):
    lines = [record(0, b"\x00\x00", 4), record(0, b"\x01", 0), record(0, b"\x00\x10", 2), record(1, b"\x02")]
    image = load_hex(written(tmp_path, *lines, record(0, bytes(4), 5), END))
    assert image.used == ((0, 1), (0x101, 0x102))


@pytest.mark.parametrize(
    ("lines", "line", "reason"),
    [
        ([":0300000002001"], 1, "bad record: not pairs of hex digits"),
        ([":03000000020010EB", ":zz"], 2, "bad record: not pairs of hex digits"),
        ([":03000000020010EC", END], 1, "bad checksum EC, expected EB"),
        ([":0300000002EB", END], 1, "bad record: 1 data bytes where 3 are declared"),
        (["hello"], 1, "is not Intel HEX: no line begins with ':'"),
        (["S1137AF00A0A0D0000000000000000000000000061"], 1, "is not Intel HEX: a record begins with ':'"),
        ([record(0, b"\x01")[1:], END], 1, "is not Intel HEX: a record begins with ':'"),
        (
            [record(0, b"\x01"), f";{record(1, b'x')[1:]}", END],
            2,
            "is not Intel HEX: a record begins with ':'",
        ),
        ([":00000009F7"], 1, "unknown record type 09"),
        ([record(0, b"\x01", 4), END], 1, "extended address record needs 2 bytes"),
        ([record(0, b"\x01")], 0, "truncated"),
        ([END], 0, "holds no bytes"),
        ([END, record(0, b"\x01")], 2, "has more records after its end record"),
        ([record(0, b"\x01\x02"), record(1, b"\x02"), END], 2, "0x0001 is loaded a second time"),
        ([record(0x1FFF, b"\x01\x02"), END], 1, "byte at 0x2000 does not fit 8192 bytes"),
        ([record(0, b"\x00\x01", 4), record(0, b"\x01"), END], 2, "byte at 0x10000 does not fit"),
        ([END, "", "some text", record(0, b"\x01")], 4, "has more records after its end record"),
        ([""], 0, "is empty"),
        (["\ufeff", "\x1a"], 0, "is empty"),
    ],
)
def test_a_damaged_image_is_refused_by_line(tmp_path, lines, line, reason):
    path = written(tmp_path, *lines)
    with pytest.raises(ImageError) as caught:
        load_hex(path)
    assert caught.value.place == line
    assert reason in caught.value.what
    assert caught.value.remedy
    assert str(caught.value).startswith(f"{path}:{line}: " if line else f"{path}: ")


ACCEPTED = {
    "a byte-order mark": "\ufeff{0}\n{1}\n",
    "lower case": "{lower}\n:00000001ff\n",
    "the end of a CP/M text": "{0}\n{1}\n\x1a",
    "padding with zeros": "{0}\n{1}\n\0\0\0",
    "comments before, between and behind": "; by make: 12:30\n// a\n{0}\n# b\n{1}\n* c\n",
    "text after the end record": "{0}\n{1}\nChecksum: 1234\n:not a record\n",
    "records without data after the end record": "{0}\n{1}\n{1}\n",
    "carriage returns and blanks": "\r\n {0} \r\n\t{1}\r\n",
    "all of it": "\ufeff; x\r\n{lower}\r\n{1}\r\nend\r\n\x1a",
}


@pytest.mark.parametrize("form", ACCEPTED.values(), ids=ACCEPTED)
def test_what_other_programs_read_beside_records_changes_nothing(tmp_path, form):
    """objcopy, s51 or both read each of these."""
    line = record(0x10, b"\x02\xab\x10")
    path = tmp_path / "robot.ihx"
    path.write_bytes(form.format(line, END, lower=line.lower()).encode())
    image = load_hex(path)
    assert (image.used, image.code[0x10:0x13]) == (((0x10, 0x13),), b"\x02\xab\x10")
    assert image.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


TEXTS = st.text(st.characters(codec="ascii", exclude_characters="\n\r:"), max_size=20)
LINES = st.one_of(
    st.builds(record, st.integers(0, 0x1FF0), st.binary(min_size=1, max_size=8)),
    st.builds(record, st.just(0), st.binary(min_size=2, max_size=2), st.sampled_from([2, 4])),
    st.just(END),
    TEXTS,
    st.from_regex(r":[0-9a-f]{4,12}", fullmatch=True),
)


@given(
    st.lists(LINES, max_size=8), st.booleans(), st.sampled_from(["\n", "\r\n"]), st.sampled_from(["", "\x1a"])
)
@example([record(0, b"\x01\x02"), END, "text"], True, "\n", "")
def test_an_image_that_intelhex_reads_has_the_same_bytes_here(tmp_path_factory, lines, lower, newline, end):
    """Where it has no comments, which intelhex refuses, and no bytes after its end record, which it does not see."""
    text = newline.join(line.lower() if lower else line for line in [*lines, END]) + newline + end
    path = tmp_path_factory.mktemp("hex") / "robot.ihx"
    path.write_text(text, newline="")
    try:
        wanted = IntelHex(f"{path}").todict()
    except HexReaderError:
        return
    wanted.pop("start_addr", None)
    try:
        image = load_hex(path, limit=0x10000)
    except ImageError as error:
        refused = error.what
    else:
        assert {address: image.code[address] for one in image.used for address in range(*one)} == wanted
        return
    reasons = "holds no bytes|after its end record|does not fit|is not Intel HEX: a record begins"
    assert re.search(reasons, refused)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(ImageError, match="there is no such file; build it, or give the path"):
        load_hex(tmp_path / "none.ihx")
    with pytest.raises(ImageError, match="is a folder; name a file in it"):
        load_hex(tmp_path)


def test_the_limit_can_be_lifted_to_64_kb(tmp_path):
    path = written(tmp_path, record(0xFFFF, b"\x01"), END)
    assert load_hex(path, limit=0x10000).used == ((0xFFFF, 0x10000),)


SMALL_MAP = """
Area                                    Addr        Size        Decimal Bytes (Attributes)
--------------------------------        ----        ----        ------- ----- ------------
.  .ABS.                            00000000    00000000 =           0. bytes (ABS,CON)
     00000098  _SCON                              a
Area                                    Addr        Size        Decimal Bytes (Attributes)
DSEG                                00000000    0000006C =         108. bytes (REL,CON)
     00000008  _frames_accepted                   a
XSEG                                00000001    00000004 =           4. bytes (REL,CON,XDATA)
D:   00000001  _buffer                            a
CSEG                                00000062    00000067 =         103. bytes (REL,CON,CODE)
C:   00000062  _step                              a
C:   00000080  A$a$100                            a
C:   0000009E  _main                              a
"""
SMALL_CDB = """
S:G$RI$0_0$0({1}SX:U),J,0,0
S:Fa$local$0_0$0({2}DF,SV:S),C,0,0
L:G$RI$0_0$0:98
L:Fa$local$0$0:9B
"""


def test_symbols_come_from_the_map_and_the_debug_file_beside_the_image(tmp_path):
    path = written(tmp_path, *(record(at, bytes(16)) for at in range(0, 0x210, 16)), END)
    path.with_suffix(".map").write_text(SMALL_MAP)
    path.with_suffix(".cdb").write_text(SMALL_CDB)
    symbols = load_hex(path).symbols
    assert symbols.find("_frames_accepted") == symbols.find("frames_accepted") == Symbol(8, "iram")
    assert symbols.find("buffer") == Symbol(1, "xram")
    assert symbols.find("SCON") == Symbol(0x98, "sfr")
    assert symbols.find("RI") == Symbol(0x98, "bit")
    assert [symbols.name_at(address) for address in (0x10, 0x62, 0x9A, 0x9B, 0x200)] == [
        "",
        "_step",
        "_step",
        "_local",
        "_main",
    ]


def test_without_files_beside_it_an_image_has_no_symbols(tmp_path):
    symbols = load_hex(written(tmp_path, record(0, bytes(4)), END)).symbols
    assert symbols.name_at(0) == ""
    assert repr(symbols) == "Symbols(0 names, 0 in code)"


# ------------------------------------------------------------------------------- files of another image


def refusal(path):
    with pytest.raises(ImageError) as caught:
        _ = load_hex(path).symbols.names
    assert caught.value.remedy == "it belongs to another image: rebuild both together, or take it away"
    assert str(caught.value).startswith(f"{caught.value.path}:{caught.value.place}: ")
    return caught.value


def test_the_map_of_the_robot_beside_a_small_program_is_refused(tmp_path):
    path = tmp_path / "blink.ihx"
    path.write_text(hex_text(b"\x80\xfe"))
    path.with_suffix(".map").write_text(MAP)
    error = refusal(path)
    assert error.path.name == "blink.map"
    assert "C:   00000026  __sdcc_program_startup" in MAP.splitlines()[error.place - 1]
    assert error.what == (
        "the image has no bytes for 44 of 44 code symbols, the first is __sdcc_program_startup (0x0026)"
    )


def test_a_map_in_which_main_moved_is_refused(tmp_path):
    path = tmp_path / "robot.ihx"
    shutil.copy(ROBOT, path)
    path.with_suffix(".map").write_text(MAP.replace("000000E7  _main", "000000E8  _main"))
    error = refusal(path)
    assert (
        "000000E8  _main" in MAP.replace("000000E7  _main", "000000E8  _main").splitlines()[error.place - 1]
    )
    assert error.what == "_main is at 0x00e8 here, and the image's start-up code jumps to 0x00e7"


@pytest.mark.parametrize("by", [-7, -2, -1, 1, 2, 3, 30])
def test_a_map_in_which_functions_behind_main_moved_is_refused(by):
    moved = moved_map(by)
    found = check_map(parse_map("\n".join(moved)), IMAGE.code, LOADED)
    assert found is not None
    assert " instructions are not in the image, " in found.reason
    assert abs(int(moved[found.line - 1][5:13], 16) - MOVED_FROM) < 0x40


@pytest.mark.parametrize("by", [-30, -11, -5, -3, -2, 1, 3, 5, 30])
def test_the_same_without_debug_shows_by_functions_that_begin_nowhere(by):
    names_only = [line for line in moved_map(by) if "$" not in line]
    found = check_map(parse_map("\n".join(names_only)), IMAGE.code, LOADED)
    assert found is not None
    assert found.reason.startswith("no function of the image begins where ")
    assert int(names_only[found.line - 1][5:13], 16) >= MOVED_FROM + by


def moved_map(by):
    moved = []
    for line in MAP.splitlines():
        address = line[5:13] if line.startswith("C:") else ""
        if address and MOVED_FROM <= int(address, 16) < 0xFFF0:
            line = line.replace(address, f"{int(address, 16) + by:08X}")
        moved.append(line)
    return moved


def test_a_table_or_two_among_functions_and_functions_that_run_into_the_next_prove_nothing():
    code = bytearray(b"\x22" * 0x10000)
    code[0x10:0x30] = b"\x75" * 0x20  # of three bytes each
    area = "CSEG                                00000000    00000100 =         256. bytes (REL,CON,CODE)\n"
    tables = [f"C:   000000{n:02X}  _table{n}   a\n" for n in (0x11, 0x15, 0x19, 0x1D)]
    names = [f"C:   000000{n:02X}  _name{n}   a\n" for n in range(0x40, 0x4E)]
    text = area + "".join([*tables, *names])
    assert check_map(parse_map(text), bytes(code), b"\x01" * 0x10000) is None
    assert check_map(parse_map(text.replace(names[0], "")), bytes(code), b"\x01" * 0x10000) is not None
    code[0x80:0x83] = b"\x12\x00\x15"
    assert check_map(parse_map(text.replace(names[0], "")), bytes(code), b"\x01" * 0x10000) is None
    code[0x40:0x52] = b"\x04" * 18
    assert check_map(parse_map(area + "".join(names)), bytes(code), b"\x01" * 0x10000) is None


def test_a_debug_file_whose_instructions_stand_elsewhere_is_refused(tmp_path):
    path = tmp_path / "robot.ihx"
    path.write_text(hex_text(IMAGE.code[:0x200] + b"\x00" + IMAGE.code[0x200 : IMAGE.used[-1][1]]))
    path.with_suffix(".cdb").write_text(CDB)
    error = refusal(path)
    assert error.path.name == "robot.cdb"
    assert CDB.splitlines()[error.place - 1].startswith("L:A$")
    count = sum(line.startswith("L:A$") for line in CDB.splitlines())
    assert f" of its {count} instructions are not in the image, the first at 0x0" in error.what


def test_the_files_of_the_robot_belong_to_it():
    assert check_map(parse_map(MAP), IMAGE.code, LOADED) is None
    assert check_cdb(parse_cdb(CDB), IMAGE.code, LOADED) is None


@settings(max_examples=25)
@given(
    filler=st.none() | st.integers(0, 255),
    boot_loader=st.binary(max_size=3),
    cut=st.tuples(st.integers(0x300, 0xA00), st.integers(0, 0x60)),
)
def test_an_image_that_was_filled_merged_or_lost_a_little_keeps_its_symbols(filler, boot_loader, cut):
    code, loaded = bytearray(IMAGE.code), bytearray(LOADED)
    if filler is not None:
        for address in range(0x10000):
            code[address] = code[address] if loaded[address] else filler
        loaded = bytearray(b"\x01" * 0x10000)
    code[: len(boot_loader)] = boot_loader  # another reset vector
    for address in range(cut[0], cut[0] + cut[1]):
        code[address], loaded[address] = 0xFF, 0
    assert check_map(parse_map(MAP), bytes(code), bytes(loaded)) is None
    assert check_cdb(parse_cdb(CDB), bytes(code), bytes(loaded)) is None


def map_text(area, first, size, attributes, name_at):
    """A page of a map: one area, five names at one address."""
    head = f"{area:<36}{first:08X}    {size:08X} = {size:>11}. bytes ({attributes})\n"
    return head + "".join(f"C:   {name_at:08X}  _name{number}      a\n" for number in range(5))


@pytest.mark.parametrize(
    ("page", "refused"),
    [
        (("CSEG", 0x4000, 0x10, "REL,CON,CODE", 0x4000), True),
        ((".  .ABS.", 0, 0, "ABS,CON", 0x4000), False),
        (("CABS", 0x4000, 0x100, "ABS,CON,CODE", 0x4000), False),
        (("CONST", 0x4000, 0, "REL,CON,CODE", 0x4000), False),
        (("CSEG", 0, 0x10, "REL,CON,CODE", 0x10), False),
        (("XSEG", 0x4000, 0x10, "REL,CON,XDATA", 0x4000), False),
        (("BANK1", 0x18000, 0x10, "REL,CON,CODE", 0x18000), False),
    ],
)
def test_absolute_empty_banked_and_data_symbols_prove_nothing(page, refused):
    found = check_map(parse_map(map_text(*page)), bytes(0x10000), b"\x01" * 16 + bytes(0xFFF0))
    assert (found is not None) == refused


def test_files_of_another_linker_prove_nothing():
    for text in ("", "LINK MAP OF MODULE: demo (DEMO)\n  C:0003H  SYMBOL  TIMER\n"):
        assert check_map(parse_map(text), IMAGE.code, LOADED) is None
        assert check_cdb(parse_cdb(text), IMAGE.code, LOADED) is None


def test_start_up_code_of_ones_own_is_not_judged():
    code = bytearray(IMAGE.code)
    code[0x26:0x29] = b"\x00\x00\x00"  # runs on into main
    assert check_map(parse_map(MAP), bytes(code), LOADED) is None


def test_a_handful_of_names_or_line_records_proves_nothing():
    text = "".join(f"L:A$a$1{number}:{number}\n" for number in range(10, 29))
    assert check_cdb(parse_cdb(text), b"\x02" * 0x10000, b"\x01" * 0x10000) is None
    assert check_cdb(parse_cdb(text + "L:A$a$200:99\n"), b"\x02" * 0x10000, b"\x01" * 0x10000) is not None
    area = "CSEG                                00000000    00000100 =         256. bytes (REL,CON,CODE)\n"
    names = [f"C:   000000{number:02X}  _name{number}   a\n" for number in range(4)]
    assert check_map(parse_map(area + "".join(names[:3])), bytes(0x10000), bytes(0x10000)) is None
    assert check_map(parse_map(area + "".join(names)), bytes(0x10000), bytes(0x10000)) is not None


@settings(max_examples=100)
@given(st.text(alphabet="L:A$CSEG_mainbytes=()RELCODE 0123456789ABCDEF\n.,", max_size=300))
def test_no_text_whatever_breaks_the_reading(text):
    check_map(parse_map(text), IMAGE.code, LOADED)
    check_cdb(parse_cdb(text), IMAGE.code, LOADED)


PROGRAM = """
#include <stdio.h>
#include <8052.h>
__code __at(0x1F00) const char serial[] = "00042";
__code unsigned char eeprom_image[32];
const unsigned long powers[] = {1, 10, 100, 1000, 10000};
__xdata char buffer[64];
volatile unsigned char ticks;
void tick(void) __interrupt(1) { ticks++; }
int putchar(int c) { SBUF = c; while (!TI); TI = 0; return c; }
void table(void) __naked { __asm
    mov dptr,#0001$
    ret
0001$:
    .db 0x02, 0x02, 0x02, 0x12, 0x75
    .ds 4
__endasm; }
void main(void) { /* MORE */ unsigned char i; for (i = 0; i < 5; i++) printf("%lu %s", powers[i], serial); }
"""


def built(folder, more, *options):
    folder.mkdir()
    (folder / "prog.c").write_text(PROGRAM.replace("/* MORE */", more))
    children.run(["sdcc", "-mmcs51", *options, "prog.c"], cwd=folder, check=True, capture_output=True)
    return folder / "prog.ihx"


@needs_sdcc
@pytest.mark.parametrize("options", [("--debug",), ("--debug", "--model-large"), ("--opt-code-size",)])
def test_what_sdcc_builds_belongs_together(tmp_path, options):
    image = load_hex(built(tmp_path / "a", "", *options))
    assert image.symbols.find("main") is not None


@needs_sdcc
def test_the_symbols_of_yesterday_are_refused_today(tmp_path):
    yesterday = built(tmp_path / "a", "", "--debug")
    today = built(tmp_path / "b", "P1 = 1;", "--debug")
    for suffix in (".map", ".cdb"):
        mixed = tmp_path / suffix[1:] / "prog.ihx"
        mixed.parent.mkdir()
        shutil.copy(today, mixed)
        shutil.copy(yesterday.with_suffix(suffix), mixed.with_suffix(suffix))
        error = refusal(mixed)
        assert error.path.suffix == suffix
        assert " instructions are not in the image, the first at 0x" in error.what


def test_an_image_is_loaded_without_a_look_at_the_files_beside_it(tmp_path):
    path = tmp_path / "robot.ihx"
    shutil.copy(ROBOT, path)
    path.with_suffix(".map").mkdir()
    image = load_hex(path)
    path.with_suffix(".map").rmdir()
    path.with_suffix(".map").write_text(MAP)
    assert image.symbols.find("main").address == 0xE7


def test_symbols_of_another_image_leave_places_without_a_name_and_say_why(tmp_path):
    path = tmp_path / "blink.ihx"
    path.write_text(hex_text(b"\x80\xfe"))
    path.with_suffix(".map").write_text(MAP)
    symbols = load_hex(path).symbols
    assert symbols.name_at(0) == ""
    assert symbols.problem is not None
    assert symbols.problem.path.name == "blink.map"
    with pytest.raises(ImageError):
        symbols.find("main")
    assert load_hex(ROBOT).symbols.problem is None


def test_files_with_a_content_that_was_read_before_are_not_parsed_again(tmp_path):
    load_hex(ROBOT).symbols.find("main")
    parsed = [parse.cache_info().misses for parse in (parse_map, parse_cdb)]
    for suffix in (".ihx", ".map", ".cdb"):
        shutil.copy(ROBOT.with_suffix(suffix), tmp_path / f"copy{suffix}")
    copy = load_hex(tmp_path / "copy.ihx")
    assert copy.symbols.names == load_hex(ROBOT).symbols.names
    assert copy.code is load_hex(ROBOT).code
    assert [parse.cache_info().misses for parse in (parse_map, parse_cdb)] == parsed


def test_a_file_that_was_changed_is_read_again(tmp_path):
    path = tmp_path / "robot.ihx"
    shutil.copy(ROBOT, path)
    path.with_suffix(".map").write_text(MAP)
    assert load_hex(path).symbols.find("renamed") is None
    path.with_suffix(".map").write_text(MAP.replace("  _main ", "  _renamed "))
    assert load_hex(path).symbols.find("renamed").address == 0xE7
    path.write_text(hex_text(b"\x80\xfe"))
    assert load_hex(path).size == 2


def test_an_image_is_judged_by_its_own_limit_however_often_it_was_loaded(tmp_path):
    path = tmp_path / "big.ihx"
    path.write_text(hex_text(b"\x00" * 4, at=0x3000))
    for _ in range(2):
        assert load_hex(path, limit=0x10000).size == 4
        with pytest.raises(ImageError, match="does not fit 8192 bytes"):
            load_hex(path)
