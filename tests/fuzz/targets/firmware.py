"""A firmware and what stands beside it: images, symbol and debug files, tracefiles."""

from tests.fuzz.target import Target, folder, refused, with_sums
from tests.mirotwin.mutated_files import ECHO, ECHO_CDB, ECHO_MAP, ECHO_RST, hex_records

_NAME = "fuzz.ihx"
_MOST_NAMES = 20
"""Variables of a file that are read and written."""


def _hex():
    from pathlib import Path

    from miro_robot.image.hex import ImageError, parse_hex

    def parsed(data):
        try:
            image = parse_hex(data, Path(_NAME), 0x10000)
        except ImageError as error:
            return refused(error)
        records = [hex_at(first, image.code[first:end]) for first, end in image.used]
        again = parse_hex(b"".join([*records, b":00000001FF\n"]), Path(_NAME), 0x10000)
        assert (again.code, again.used, again.size) == (image.code, image.used, image.size)
        assert image.size == sum(end - first for first, end in image.used)
        return f"{min(len(image.used), 3)} ranges"

    def run(data):
        return f"{parsed(data)}; sums put right: {parsed(with_sums(data))}"

    return run


def hex_at(first, code):
    """Records of `code` from an address on, without the end record."""
    lines = []
    for place in range(0, len(code), 16):
        part = code[place : place + 16]
        record = bytes([len(part)]) + (first + place).to_bytes(2, "big") + b"\0" + part
        lines.append(f":{(record + bytes([-sum(record) & 0xFF])).hex()}\n")
    return "".join(lines).encode()


def _beside(suffix):
    """A symbol file of that suffix beside the image it belongs to; all that reads one."""
    from miro_exact.bad_input import BadInput
    from miro_robot.board import Board
    from miro_robot.image import load_hex
    from miro_robot.image.debug_info import DebugInfo, Sources
    from miro_robot.image.variables import variables_of
    from miro_robot.inspect.symbol_names import SymbolNames
    from miro_robot.inspect.values import read_value, write_value
    from miro_robot.mcs51.opcodes import disassemble
    from miro_robot.plant import Plant
    from miro_robot.wiring import load_wiring

    path = folder() / _NAME
    path.write_bytes(hex_records(ECHO))
    for other, text in _TEXTS.items():
        path.with_suffix(other).write_text(text)
    cpu = Board(load_wiring(), Plant(), 0, 3).cpu

    def run(data):
        path.with_suffix(suffix).write_bytes(data)
        image = load_hex(path)
        try:
            names = image.symbols.names
            debug = DebugInfo.of(image)
            variables = variables_of(image)
        except BadInput as error:
            return refused(error)
        shown, sources = SymbolNames(image), Sources([path.parent])
        for address in range(len(ECHO) + 8):
            line = debug.line_at(address)
            if line is not None:
                assert sources.text(line) is not None
            debug.function_at(address)
            debug.is_constant(address)
            assert disassemble(image.code, address, shown).isprintable() or names
        outcomes = set()
        for name in list(variables.by_name)[:_MOST_NAMES]:
            try:
                value = read_value(cpu, image, name)
                write_value(cpu, image, name, value)
                assert read_value(cpu, image, name) == value or value != value
                outcomes.add("a value")
            except BadInput as error:
                outcomes.add(refused(error))
        return f"{min(len(names), 3)} names, {min(len(debug.lines), 3)} lines, {sorted(outcomes)}"

    return run


_TEXTS = {".map": ECHO_MAP, ".cdb": ECHO_CDB, ".rst": ECHO_RST}
_VARIABLES = """\
M:main
T:Fmain$point[({0}S:S$x$0_0$0({2}SI:S),Z,0,0)({2}S:S$bits$0_0$0({1}SB0$3:U),Z,0,0)({3}S:S$f$0_0$0({4}SF:S),Z,0,0)]
S:G$total$0_0$0({1}SC:U),E,0,0
S:G$flag$0_0$0({1}SX:U),H,0,0
S:Fmain$table$0_0$0({6}DA3d,SI:S),E,0,0
S:Fmain$place$0_0$0({7}STpoint:S),E,0,0
S:G$rate$0_0$0({4}SF:S),E,0,0
S:G$next$0_0$0({3}DG,SC:U),E,0,0
S:G$P1$0_0$0({1}SC:U),I,0,0
S:Lmain.main$count$1_0$1({2}SI:U),C,0,0
L:G$total$0$0:8
L:G$total$0_0$0:9
L:G$flag$0_0$0:2
L:Fmain$table$0_0$0:10
L:Fmain$place$0_0$0:20
L:G$rate$0_0$0:30
L:G$next$0_0$0:34
L:G$P1$0_0$0:90
L:Lmain.main$count$1_0$1:2
"""


def _lcov():
    from miro_exact.bad_input import BadInput
    from miro_robot.inspect.lcov import add, decode, encode

    def run(data):
        try:
            found = decode(data.decode("utf-8", "surrogateescape"), "fuzz.info")
        except BadInput as error:
            return refused(error)
        text = encode(found)
        again = decode(text, "again")
        assert encode(again) == text, "written and read again, the tracefile differs"
        assert again == found, "written and read again, the counts differ"
        add(again, found)
        return f"{min(len(found), 3)} files"

    return run


def _hex_seeds():
    linear = b":020000040000FA\n:0400000500000000F7\n:020000021000EC\n"
    return [hex_records(ECHO), linear + hex_at(0x8000, b"ab") + b":00000001FF\r\n"]


def _lcov_seeds():
    old = (
        b"TN:\nSF:main.c\nFN:3,main\nFN:9,12,go\nFNDA:2,main\nBRDA:4,0,0,1\nBRDA:4,0,1,-\nDA:3,2\nDA:4,0,x\n"
    )
    new = b"TN:t\nVER:1\nSF:a.c\nFNL:0,7,9\nFNA:0,3,main\nDA:7,3\nFNF:1\nLH:1\nend_of_record\n# said\n"
    return [old + b"LF:2\nend_of_record\n", new, old + b"end_of_record\n" + old]


_MAP_WORDS = (
    b"C:   ",
    b"00000000",
    b"0000000C",
    b"  _main  ",
    b" bytes (REL,CON,CODE)",
    b" = ",
    b"CSEG",
    b"A$",
)
_CDB_WORDS = (b"S:G$", b"L:G$", b"L:A$", b"L:C$", b"L:XG$", b"S:Fmain$", b"S:Lmain.main$", b"({1}SC:U),E,0,0")
_CDB_WORDS += (
    b"T:Fmain$",
    b"({0}S:S$",
    b"DA3d,",
    b"STpoint",
    b"SB0$3",
    b"SX",
    b"SF",
    b"DF,SV",
    b"DG,",
    b"$0_0$0",
    b"M:",
)

TARGETS = {
    "hex": Target(
        "Intel HEX, also with its sums put right", _hex, _hex_seeds, words=(b":00000001FF\n", b"\n:")
    ),
    "map": Target(
        "a linker's map beside an image",
        lambda: _beside(".map"),
        lambda: [ECHO_MAP.encode()],
        words=_MAP_WORDS,
    ),
    "cdb": Target(
        "a debug file beside an image; its variables are read and written",
        lambda: _beside(".cdb"),
        lambda: [ECHO_CDB.encode(), _VARIABLES.encode()],
        words=_CDB_WORDS,
    ),
    "rst": Target(
        "a listing beside an image", lambda: _beside(".rst"), lambda: [ECHO_RST.encode()], most_bytes=1024
    ),
    "lcov": Target(
        "tracefiles, written again", _lcov, _lcov_seeds, words=(b"SF:", b"FNA:", b"BRDA:", b"DA:", b"FNL:")
    ),
}
