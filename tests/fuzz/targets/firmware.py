"""A firmware and what stands beside it: images, symbol and debug files, tracefiles."""

from pathlib import Path

from miro_exact.bad_input import BadInput
from miro_robot.board import Board
from miro_robot.image import load_hex
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.image.hex import ImageError, parse_hex
from miro_robot.image.variables import variables_of
from miro_robot.inspect.lcov import add, decode, encode
from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.values import read_value, write_value
from miro_robot.mcs51.opcodes import disassemble
from miro_robot.plant import Plant
from miro_robot.wiring import load_wiring
from tests.fuzz.target import Target, always, folder, refused, with_sums
from tests.mirotwin.mutated_files import ECHO, ECHO_CDB, ECHO_MAP, ECHO_RST, hex_records

_NAME = "fuzz.ihx"
_MOST_NAMES = 20
"""Variables of a file that are read and written."""


def _hex():
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


def _lcov(data):
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


_MAP_WORDS = b"C:   |00000000|0000000C|  _main  | bytes (REL,CON,CODE)| = |CSEG|A$".split(b"|")
_CDB_WORDS = (
    b"S:G$|L:G$|L:A$|L:C$|L:XG$|S:Fmain$|S:Lmain.main$|({1}SC:U),E,0,0|T:Fmain$|({0}S:S$|DA3d,|STpoint|SB0$3|SX|SF|"
    b"DF,SV|DG,|$0_0$0|M:"
).split(b"|")

TARGETS = {
    "hex": Target("Intel HEX, also with its sums put right", _hex, words=(b":00000001FF\n", b"\n:")),
    "map": Target("a linker's map beside an image", lambda: _beside(".map"), words=_MAP_WORDS),
    "cdb": Target(
        "a debug file beside an image; its variables are read and written",
        lambda: _beside(".cdb"),
        words=_CDB_WORDS,
    ),
    "rst": Target("a listing beside an image", lambda: _beside(".rst"), most_bytes=1024),
    "lcov": Target("tracefiles, written again", always(_lcov), words=b"SF: FNA: BRDA: DA: FNL:".split()),
}
