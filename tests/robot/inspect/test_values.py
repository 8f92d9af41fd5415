"""Variables are read by the names and types of the debug file: the shipped firmware's, and those of a program."""

import re
import shutil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.image.c_types import CType, bytes_of, type_named, type_of, value_of
from miro_robot.image.variables import parse_variables, variables_of
from miro_robot.inspect.values import read_value, write_value
from miro_robot.mcs51.bus import Bus
from miro_robot.mcs51.cpu import Cpu
from tests.robot.inspect.programs import build_modules

PROGRAM = """
#include <8052.h>
#include <stdbool.h>
struct point { int x; unsigned char y; long z; };
union word { unsigned int w; unsigned char b[2]; };
struct flags { unsigned a:1; unsigned b:3; unsigned c:9; signed int d:4; };
enum colour { RED, GREEN = 5 };
typedef struct { struct point p[2]; char *name; union word u; } thing;
signed char sc = -3; unsigned char uc = 200; char pc = 'A'; int i = -300; unsigned u = 65000;
long l = -100000L; unsigned long ul = 4000000000UL; float f = 1.5f; enum colour col = GREEN; long long ll = -5LL;
__bit bit1; bool boo; static __bit bit2;
__idata unsigned char arr[4] = {1, 2, 3, 4};
__idata int mat[2][3] = {{1, -2, 3}, {4, 5, -6}};
__idata struct point pt = {-5, 7, -70000L};
__idata struct flags fl;
__idata thing th;
__xdata int far;
char *gp; __code char *cp; __idata char *ip; int (*fp)(void);
__code const unsigned int table[3] = {1000, 2000, 60000};
static int twice = 44;
extern int other(void);
int foo(int q) { static int count = 9; count++; return count + q; }
void main(void) {
    bit1 = 1; boo = true; fl.a = 1; fl.b = 5; fl.c = 300; fl.d = -2;
    th.p[1].x = -9; th.name = &pc; th.u.w = 0x1234;
    gp = &pc; cp = (__code char *)table; ip = (__idata char *)&pt; fp = other;
    i += foo(3) + other() - 30; P1 = 0x5A; TR1 = 1; bit2 = 0; far = 1;
    for (;;) PCON = 1;
}
"""
OTHER = "static int twice = 7; int other(void) { return twice + 3; }\n"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    folder = tmp_path_factory.mktemp("typed")
    (folder / "typed.c").write_text(PROGRAM)
    (folder / "other.c").write_text(OTHER)
    return load_hex(build_modules(folder, "typed", "other", options=("--xram-size", "256", "--std-sdcc11")))


def at_rest(image):
    cpu = Cpu(Bus())
    cpu.load(image.code, image.used)
    cpu.run(100_000)
    return cpu


@pytest.fixture
def cpu(program):
    return at_rest(program)


VALUES = {
    "sc": -3,
    "uc": 200,
    "pc": 65,
    "i": -300 + 13 + 10 - 30,
    "u": 65000,
    "l": -100000,
    "ul": 4000000000,
    "ll": -5,
    "f": 1.5,
    "col": 5,
    "bit1": 1,
    "bit2": 0,
    "boo": True,
    "arr": [1, 2, 3, 4],
    "arr[2]": 3,
    "mat": [[1, -2, 3], [4, 5, -6]],
    "mat[1][2]": -6,
    "pt": {"x": -5, "y": 7, "z": -70000},
    "pt.z": -70000,
    "fl": {"a": 1, "b": 5, "c": 300, "d": -2},
    "fl.c": 300,
    "th.p[1].x": -9,
    "th.u": {"w": 0x1234, "b": [0x34, 0x12]},
    "table": [1000, 2000, 60000],
    "typed:twice": 44,
    "other.c:twice": 7,
    "foo:count": 10,
    "P1": 0x5A,
    "TR1": 1,
    "_uc": 200,
}


@pytest.mark.parametrize("name", VALUES)
def test_a_variable_has_the_value_that_the_program_gave_it(name, program, cpu):
    value = read_value(cpu, program, name)
    assert value == VALUES[name]
    assert type(value) is type(VALUES[name])


def test_a_pointer_is_an_int_the_address_below_the_mark_of_the_memory(program, cpu):
    places = {one.name: one.address for each in variables_of(program).by_name.values() for one in each}
    assert read_value(cpu, program, "gp") & 0xFFFF == places["pc"]
    assert read_value(cpu, program, "cp") == places["table"]
    assert read_value(cpu, program, "ip") == places["pt"]
    symbol = program.symbols.find("other")
    assert symbol is not None
    assert read_value(cpu, program, "fp") == symbol.address


WRITTEN = {
    "sc": -128,
    "u": 1,
    "l": -1,
    "f": -0.25,
    "bit1": 0,
    "boo": False,
    "arr": [9, 8, 7, 6],
    "arr[0]": 255,
    "mat[0]": [7, 8, 9],
    "pt": {"x": 1, "y": 2, "z": 3},
    "fl.b": 2,
    "fl.d": 7,
    "th.u.b": [1, 2],
}


@pytest.mark.parametrize("name", WRITTEN)
def test_what_is_written_is_read_and_nothing_beside_it_changes(name, program, cpu):
    others = [
        other for other in VALUES if other.split(".")[0].split("[")[0] != name.split(".")[0].split("[")[0]
    ]
    before = {other: read_value(cpu, program, other) for other in others}
    write_value(cpu, program, name, WRITTEN[name])
    assert read_value(cpu, program, name) == WRITTEN[name]
    assert {other: read_value(cpu, program, other) for other in others} == before


def test_members_that_are_not_named_stay(program, cpu):
    write_value(cpu, program, "fl", {"b": 0})
    assert read_value(cpu, program, "fl") == {"a": 1, "b": 0, "c": 300, "d": -2}
    write_value(cpu, program, "pt", {"y": 255})
    assert read_value(cpu, program, "pt") == {"x": -5, "y": 255, "z": -70000}


REFUSED = {
    "unt": "there is no such variable",
    "pt.q": "struct point has no member q; it has x, y, z",
    "arr[4]": r"4 is after the end of uint8\[4\]; give 0 to 3",
    "uc[0]": "uint8 is no array",
    "main": "main: is code, no variable",
    "twice": "there are several of this name; give one of other:twice, typed:twice",
    "foo:counts": "there is no such variable; did you mean count",
    "far": "is in xram: the board has no such memory",
    "a b": "is no name of a variable",
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_name_that_cannot_be_read_is_refused_with_the_remedy(name, program, cpu):
    with pytest.raises(BadInput, match=REFUSED[name]):
        read_value(cpu, program, name)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("uc", 256, "256 does not fit uint8: it takes 0 to 255"),
        ("sc", -129, "it takes -128 to 127"),
        ("fl.b", 8, "8 does not fit bits: it takes 0 to 7"),
        ("arr", [1], r"\[1\] is no uint8\[4\]: give 4 values"),
        ("pt", {"q": 1}, "its members are x, y, z"),
        ("i", 1.5, "1.5 is no int16"),
        ("table", [1, 2, 3], "is in code, not in internal RAM"),
    ],
)
def test_a_value_that_does_not_fit_is_refused(name, value, said, program, cpu):
    with pytest.raises(BadInput, match=said):
        write_value(cpu, program, name, value)


def test_the_shipped_firmwares_variables_have_their_types():
    image = load_hex(image_path())
    cpu = at_rest(image)
    types = {one.name: str(one.type) for each in variables_of(image).by_name.values() for one in each}
    wanted = {"last_left": "int16", "frames_accepted": "uint16", "slot": "uint8", "body": "uint8[23]"}
    assert {name: types[name] for name in wanted} == wanted
    write_value(cpu, image, "last_left", -12345)
    assert read_value(cpu, image, "last_left") == -12345
    assert read_value(cpu, image, "last_left", "uint16") == 65536 - 12345
    assert len(read_value(cpu, image, "rx_character")) == 32
    assert read_value(cpu, image, "tx_busy") == 0
    write_value(cpu, image, "acceleration_waits", 1)
    assert (read_value(cpu, image, "acceleration_waits"), read_value(cpu, image, "tx_busy")) == (1, 0)


def test_without_a_debug_file_the_test_says_the_type(tmp_path):
    for suffix in (".ihx", ".map"):
        shutil.copy(image_path().with_suffix(suffix), tmp_path / f"bare{suffix}")
    image = load_hex(tmp_path / "bare.ihx")
    cpu = at_rest(image)
    with pytest.raises(
        BadInput, match=r"no \.cdb beside the image says its type; build with --debug, or give it"
    ):
        read_value(cpu, image, "last_left")
    write_value(cpu, image, "last_left", -7, "int16")
    assert read_value(cpu, image, "last_left", "int16") == -7
    assert read_value(cpu, image, "last_left", "uint8[2]") == [249, 255]
    with pytest.raises(BadInput, match="'word' is no type"):
        read_value(cpu, image, "last_left", "word")


@given(st.sampled_from(["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64"]), st.data())
def test_every_number_that_fits_survives(name, data):
    kind = type_named(name)
    assert kind is not None
    width = 8 * kind.size
    low = -(1 << width - 1) if kind.signed else 0
    value = data.draw(st.integers(low, low + (1 << width) - 1))
    assert value_of(kind, bytes_of(kind, value, b"", {}), {}) == value


@given(st.text(alphabet="DASCILTF{}$,0123456789", max_size=12), st.integers(0, 9999), st.booleans())
def test_a_damaged_type_is_a_type_or_none(chain, size, signed):
    assert isinstance(type_of(chain, size, signed), CType | None)


@given(st.integers(0, 4000), st.integers(0, 255))
def test_a_damaged_debug_file_is_read_as_far_as_it_goes(at, byte):
    text = image_path().with_suffix(".cdb").read_text()[:5000]
    damaged = text[:at] + chr(byte) + text[at + 1 :]
    found = parse_variables(damaged)
    assert all(re.fullmatch(r"\w+", name) for name in found.by_name)
