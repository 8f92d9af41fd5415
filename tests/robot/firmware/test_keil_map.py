"""Maps of Keil's linkers: found beside the image, in whatever case and folder, and used as SDCC's files are."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_robot.image import ImageError, Symbol, load_hex
from miro_robot.image.debug_info import DebugInfo, debug_files
from miro_robot.image.keil_map import is_keil, keil_map_path, parse_keil_map
from tests.robot.mcs51.asm import assemble, hex_text

CODE = assemble(
    """
    LJMP 0014h
    wait:
    DJNZ R7,wait
    RET
    main:
    MOV R7,#20
    LCALL wait
    CPL 90h
    INC 9
    SJMP main
    """
)
CODE += b"\x01\x02\x03" + assemble("MOV SP,#20h\nLJMP 0006h")
BL51 = """\
BL51 BANKED LINKER/LOCATER V6.22                                          01/02/2024  10:00:00  PAGE 1


BL51 BANKED LINKER/LOCATER V6.22, INVOKED BY:
C:\\KEIL\\C51\\BIN\\BL51.EXE .\\Objects\\blink.obj TO .\\Objects\\blink PRINT (.\\Listings\\blink.m51)

MEMORY MODEL: SMALL

INPUT MODULES INCLUDED:
  .\\Objects\\blink.obj (BLINK)
  C:\\KEIL\\C51\\LIB\\C51S.LIB (?C_STARTUP)

LINK MAP OF MODULE:  .\\Objects\\blink (BLINK)

            TYPE    BASE      LENGTH    RELOCATION   SEGMENT NAME
            -----------------------------------------------------

            * * * * * * *   D A T A   M E M O R Y   * * * * * * *
            REG     0000H     0008H     ABSOLUTE     "REG BANK 0"
            DATA    0008H     0001H     UNIT         _DATA_GROUP_
            DATA    0009H     0001H     UNIT         ?DT?BLINK
                    000AH     0016H                  *** GAP ***
            BIT     0020H.0   0000H.1   UNIT         ?BI?BLINK
            IDATA   0021H     0001H     UNIT         ?STACK

            * * * * * * *   C O D E   M E M O R Y   * * * * * * *
            CODE    0000H     0003H     ABSOLUTE
            CODE    0003H     0003H     UNIT         ?PR?_WAIT?BLINK
            CODE    0006H     000BH     UNIT         ?PR?MAIN?BLINK
            CODE    0011H     0003H     UNIT         ?CO?BLINK
            CODE    0014H     0006H     UNIT         ?C_C51STARTUP

SYMBOL TABLE OF MODULE:  .\\Objects\\blink (BLINK)

  VALUE           TYPE          NAME
  ----------------------------------

  -------         MODULE        BLINK
  C:0000H         SYMBOL        _ICE_DUMMY_
  D:0090H         PUBLIC        P1
  B:0090H.0       PUBLIC        LED
BL51 BANKED LINKER/LOCATER V6.22                                          01/02/2024  10:00:00  PAGE 2

  B:0020H.3       PUBLIC        lit
  C:0006H         PUBLIC        main
  C:0003H         SYMBOL        _wait
  D:0009H         PUBLIC        count
  X:1234H         PUBLIC        log
  N:0040H         SYMBOL        LIMIT
  -------         PROC          _WAIT
  D:0007H         SYMBOL        n
  C:0003H         LINE#         7
  C:0005H         LINE#         8
  -------         ENDPROC       _WAIT
  -------         PROC          MAIN
  -------         DO
  D:0008H         SYMBOL        count
  -------         ENDDO
  C:0006H         LINE#         12
  C:000BH         LINE#         13
  -------         ENDPROC       MAIN
  -------         ENDMOD        BLINK

  -------         MODULE        ?C_STARTUP
  C:0014H         SEGMENT       ?C_C51STARTUP
  C:0014H         SYMBOL        STARTUP1
  -------         ENDMOD        ?C_STARTUP
"""
LX51 = """\
LX51 LINKER/LOCATER V4.66                                                 01/02/2024  10:00:00  PAGE 1

INPUT MODULES INCLUDED:
  .\\Objects\\blink.obj (BLINK)

MEMORY MAP OF MODULE:  .\\Objects\\blink (BLINK)

START     STOP      LENGTH    ALIGN  RELOC    MEMORY CLASS   SEGMENT NAME
=========================================================================
000000H   000007H   000008H   ---    AT..     DATA           "REG BANK 0"
000021H   000021H   000001H   BYTE   UNIT     IDATA          ?STACK
000003H   000005H   000003H   BYTE   UNIT     CODE           ?PR?_WAIT?BLINK
000006H   000010H   00000BH   BYTE   UNIT     CODE           ?PR?MAIN?BLINK
000014H   000019H   000006H   BYTE   UNIT     CODE           ?C_C51STARTUP

SYMBOL TABLE OF MODULE:  .\\Objects\\blink (BLINK)

      VALUE       REP       CLASS    TYPE      SYMBOL NAME
      ====================================================
      ---         MODULE    ---      ---       BLINK
      01000003H   PUBLIC    CODE     ---       _wait
      01000006H   PUBLIC    CODE     ---       main
      00000020H.3 PUBLIC    BIT      BIT       lit
      00000009H   PUBLIC    DATA     BYTE      count
      02001234H   PUBLIC    XDATA    BYTE      log
      00000090H   SFRSYM    DATA     BYTE      P1
      00000090H.0 SFRSYM    DATA     BIT       LED
      01000006H   BLOCK     CODE     ---       LVL=0
      00000008H   SYMBOL    DATA     BYTE      count
      01000006H   LINE      CODE     ---       #12
      0100000BH   LINE      ---      ---       #13
      ---         BLOCKEND  ---      ---       LVL=0
"""


@pytest.fixture
def project(tmp_path):
    (tmp_path / "Objects").mkdir()
    (tmp_path / "Listings").mkdir()
    (tmp_path / "Objects" / "blink.hex").write_text(hex_text(CODE))
    return tmp_path


def blink(project, text=BL51, name="Listings/blink.m51", encoding="ascii"):
    (project / name).write_bytes(text.encode(encoding))
    return load_hex(project / "Objects" / "blink.hex")


@pytest.mark.parametrize("text", [BL51, LX51])
def test_names_have_the_spaces_that_the_map_gives_them(project, text):
    found = blink(project, text).symbols
    assert found.find("main") == Symbol(0x06, "code")
    assert found.find("wait") == Symbol(0x03, "code")
    assert found.find("count") == Symbol(0x09, "iram"), "and no local of that name"
    assert found.find("log") == Symbol(0x1234, "xram")
    assert found.find("P1") == Symbol(0x90, "sfr")
    assert found.find("LED") == Symbol(0x90, "bit")
    assert found.find("lit") == Symbol(0x03, "bit"), "20h.3 is bit 3"
    assert found.find("LIMIT") is found.find("n") is found.find("_ICE_DUMMY_") is None


@pytest.mark.parametrize("text", [BL51, LX51])
def test_the_stack_begins_at_its_segment(project, text):
    assert blink(project, text).symbols.stack == (0x21, 0xFF)


def test_a_stack_beyond_internal_ram_is_damage_and_the_start_up_code_says_where_it_is(project):
    symbols = blink(project, BL51.replace("IDATA   0021H", "IDATA   FFFFH")).symbols
    assert symbols.stack == (0x21, 0xFF)
    assert symbols.stack_source.startswith("MOV SP,#20h")


@pytest.mark.parametrize("text", [BL51, LX51])
def test_lines_belong_to_the_c_file_of_the_module(project, text):
    info = DebugInfo.of(blink(project, text))
    assert str(info.line_at(0x08)) == "blink.c:12"
    assert str(info.line_at(0x0D)) == "blink.c:13"
    assert info.line_at(0x14) is None, "the start-up code has no lines"
    assert [(one.name, one.first, one.end) for one in info.functions] == [
        ("_wait", 0x03, 0x06),
        ("main", 0x06, 0x11),
    ]


def test_code_without_a_name_of_its_own_has_that_of_its_segment(project):
    image = blink(project)
    assert image.symbols.name_at(0x12) == "?CO?BLINK"
    assert image.symbols.name_at(0x15) == "STARTUP1"
    assert DebugInfo.of(image).is_constant(0x12)


def test_a_function_without_debug_information_is_named_by_its_segment(project):
    text = "".join(row + "\n" for row in BL51.splitlines() if "main" not in row and "LINE#" not in row)
    info = DebugInfo.of(blink(project, text))
    assert [one.name for one in info.functions] == ["_wait", "MAIN"]


def test_labels_of_the_assembler_make_no_function(project):
    text = BL51.replace("PUBLIC        main", "PUBLIC        begin")
    info = DebugInfo.of(blink(project, text))
    assert [one.name for one in info.functions] == ["_wait"]


@pytest.mark.parametrize(
    "name", ["Listings/BLINK.M51", "Objects/Blink.m51", "blink.M51", "blink.map", "Listings/blink.MAP"]
)
def test_the_map_is_found_in_any_case_beside_the_image_and_in_the_folders_of_uvision(project, name):
    assert blink(project, name=name).symbols.find("main")
    assert keil_map_path(project / "Objects" / "blink.hex") == project / name
    assert debug_files(project / "Objects" / "blink.hex", "case") == {"case.m51": project / name}


def test_a_map_of_another_linker_is_not_read(project):
    assert blink(project, "Component: ARM Compiler 6.14 Tool: armlink\n", "blink.map").symbols.names == {}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "gbk", "cp1252"])
def test_the_map_is_read_in_the_encodings_of_windows(project, encoding):
    name = "z\xe4hler" if encoding == "cp1252" else "步进马达"
    text = BL51.replace("blink.obj (BLINK)", f"{name}.obj (BLINK)").replace("\n", "\r\n")
    info = DebugInfo.of(blink(project, text, encoding=encoding))
    assert str(info.line_at(0x08)) == f"{name}.c:12"


def test_a_map_whose_start_up_code_is_elsewhere_is_refused(project):
    text = BL51.replace("0014H     0006H", "0015H     0006H")
    with pytest.raises(
        ImageError, match="start-up code is at 0x0015 here, and the image's reset jumps to 0x0014"
    ):
        _ = blink(project, text).symbols.names


def test_the_files_of_sdcc_go_before(project):
    (project / "Objects" / "blink.cdb").write_text("S:G$count$0$0({1}SC:U),E,0,0\nL:G$count$0$0:30\n")
    assert blink(project).symbols.names == {"_count": Symbol(0x30, "iram")}


@given(st.data())
def test_a_damaged_map_is_read_as_far_as_it_can_be(data):
    rows = BL51.splitlines() + LX51.splitlines()
    picked = data.draw(st.lists(st.sampled_from(rows), max_size=60))
    cuts = data.draw(st.lists(st.integers(0, 60), min_size=len(picked), max_size=len(picked)))
    text = (
        BL51[:40]
        + "\n"
        + "\n".join(row[cut:] if cut % 3 == 0 else row for row, cut in zip(picked, cuts, strict=True))
    )
    assert is_keil(text)
    for symbol in parse_keil_map(text).map_file.names.values():
        assert 0 <= symbol.address <= 0xFFFF
