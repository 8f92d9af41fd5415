"""Reading images: what is accepted, and how every refusal names file, line, reason and remedy."""

import hashlib

import pytest

from miro_robot.image import ImageError, Symbol, load_hex

END = ":00000001FF"


def record(address, data, kind=0):
    body = bytes([len(data)]) + address.to_bytes(2, "big") + bytes([kind]) + bytes(data)
    return ":" + (body + bytes([-sum(body) & 0xFF])).hex().upper()


def written(tmp_path, *lines):
    path = tmp_path / "robot.ihx"
    path.write_text("\n".join(lines) + "\n")
    return path


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
        (["hello"], 1, "is not Intel HEX"),
        ([":00000009F7"], 1, "unknown record type 09"),
        ([record(0, b"\x01", 4), END], 1, "extended address record needs 2 bytes"),
        ([record(0, b"\x01")], 0, "truncated"),
        ([END], 0, "holds no bytes"),
        ([END, record(0, b"\x01")], 2, "has more records after its end record"),
        ([record(0, b"\x01\x02"), record(1, b"\x02"), END], 2, "0x0001 is loaded a second time"),
        ([record(0x1FFF, b"\x01\x02"), END], 1, "byte at 0x2000 does not fit 8192 bytes"),
        ([record(0, b"\x00\x01", 4), record(0, b"\x01"), END], 2, "byte at 0x10000 does not fit"),
        ([""], 0, "is empty"),
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


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(ImageError, match="there is no such file; build it, or give the path"):
        load_hex(tmp_path / "none.ihx")
    with pytest.raises(ImageError, match="is a folder; name a file in it"):
        load_hex(tmp_path)


def test_the_limit_can_be_lifted_to_64_kb(tmp_path):
    path = written(tmp_path, record(0xFFFF, b"\x01"), END)
    assert load_hex(path, limit=0x10000).used == ((0xFFFF, 0x10000),)


MAP = """
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
CDB = """
S:G$RI$0_0$0({1}SX:U),J,0,0
S:Fa$local$0_0$0({2}DF,SV:S),C,0,0
L:G$RI$0_0$0:98
L:Fa$local$0$0:9B
"""


def test_symbols_come_from_the_map_and_the_debug_file_beside_the_image(tmp_path):
    path = written(tmp_path, *(record(at, bytes(16)) for at in range(0, 0x210, 16)), END)
    path.with_suffix(".map").write_text(MAP)
    path.with_suffix(".cdb").write_text(CDB)
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
