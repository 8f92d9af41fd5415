"""The listing shows every byte once, and assembles to the image it came from."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from miro_robot.image import Symbol, load_hex, parse_hex
from miro_robot.image.debug_info import DebugInfo, Sources
from miro_robot.inspect.listing import rows, text_lines
from miro_robot.inspect.symbol_names import SymbolNames, functions
from miro_robot.mcs51.opcodes import LENGTH
from tests.robot.inspect.programs import build_modules
from tests.robot.mcs51.asm import assemble, image_of


@given(
    st.binary(min_size=1, max_size=120),
    st.dictionaries(
        st.sampled_from(["_a", "_b", "_c"]), st.builds(Symbol, st.integers(0, 130), st.just("code"))
    ),
)
def test_every_loaded_byte_stands_in_exactly_one_row_and_names_begin_rows(code, symbols):
    image = image_of(code, symbols)
    names = SymbolNames(image)
    listed = list(rows(image, DebugInfo(), names))
    assert b"".join(row.data for row in listed) == code
    addresses = [row.address for row in listed]
    assert addresses == sorted(addresses)
    for first, _ in names.functions:
        assert first >= len(code) or first in addresses
    for row in listed:
        if row.cycles:
            assert len(row.data) == LENGTH[row.data[0]]


def test_operands_have_the_names_of_symbols_and_registers():
    code = assemble("MOV SCON,#50h\nMOV 30h,31h\nSETB TI\nLCALL 20h\nSJMP $\n").ljust(0x20, b"\0") + b"\x22"
    names = {
        "_speed": Symbol(0x30, "iram"),
        "_duty": Symbol(0x31, "iram"),
        "_stop": Symbol(0x20, "code"),
        "_P0": Symbol(0x80, "sfr"),
    }
    image = image_of(code, names)
    text = [row.text for row in rows(image, DebugInfo(), SymbolNames(image))]
    assert text[:4] == ["MOV SCON,#50h", "MOV _speed,_duty", "SETB TI", "LCALL _stop"]


def test_without_symbols_the_places_called_and_those_of_vectors_get_names():
    text = "LJMP 30h\nORG 0Bh\nLJMP 40h\nORG 30h\nLCALL 50h\nACALL 52h\nSJMP $\nORG 40h\nRETI\nORG 52h\nRET"
    found = {name for _, name in functions(image_of(assemble(text)))}
    assert {"reset", "vector timer 0", "0030h", "0040h", "0050h", "0052h"} <= found


def test_tables_of_a_c_program_are_data_and_lines_stand_above_their_code(program):
    image = load_hex(program)
    text = list(text_lines(image, DebugInfo.of(image), SymbolNames(image), Sources([program.parent])))
    assert "  DB A5h,01h,02h,03h,12h" in next(line for line in text if "DB A5h" in line)
    heading = next(line for line in text if "total += value" in line)
    assert heading.startswith("; program.c:")
    code = text[text.index(heading) + 1]
    assert "_total" in code or "R7" in code
    assert "_table:" in text


def test_a_listing_reads_back_to_the_image(program):
    image = load_hex(program)
    code = bytearray(b"\xff" * 0x10000)
    for line in text_lines(image, DebugInfo.of(image), SymbolNames(image), Sources([])):
        if line[4:6] == "  " and not line.startswith(";"):
            data = bytes.fromhex(line[6:29])
            code[int(line[:4], 16) : int(line[:4], 16) + len(data)] = data
    assert bytes(code) == image.code


def test_undefined_opcodes_are_data():
    image = parse_hex(b":02000000A500 59\n:00000001FF\n".replace(b" ", b""), Path("x.ihx"))
    assert [row.text for row in rows(image, DebugInfo(), SymbolNames(image))] == ["DB A5h", "NOP"]


def test_code_that_runs_through_the_places_of_vectors_has_no_vectors():
    image = image_of(b"\0" * 0x40 + assemble("SJMP $"))
    assert [name for _, name in functions(image)] == ["reset"]


def test_static_functions_of_one_name_are_two(tmp_path):
    for module, other in (("a", "b"), ("b", "c")):
        main = (
            "void bstep(void);\nvoid main(void)\n{\n    step();\n    bstep();\n}\n" if module == "a" else ""
        )
        own = "" if module == "a" else "void bstep(void)\n{\n    step();\n}\n"
        text = (
            f"volatile unsigned char {other}1;\nstatic void step(void)\n{{\n    {other}1++;\n}}\n{own}{main}"
        )
        (tmp_path / f"{module}.c").write_text(text)
    image = load_hex(build_modules(tmp_path, "a", "b"))
    assert [name for _, name in functions(image)].count("_step") == 2
