"""Records of a debug file or a map that cannot be are left out, at once, and those around them are read."""

import pytest

from miro_robot.image.symbol_files import parse_cdb, parse_map
from miro_robot.image.variables import parse_variables

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
