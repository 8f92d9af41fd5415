"""Who shares a net with whom follows from the words of a board, in whatever order they stand."""

import pytest

from miro_robot.board_spec import BoardSpec, BufferSpec, LatchSpec, PartSpec, StrapSpec
from miro_robot.build import board_of
from miro_robot.parts.button import Button
from miro_robot.parts.keys import IN, OPEN_DRAIN, STRONG, TWO_WAY, PartKeys, Pin
from miro_robot.parts.led import Led
from miro_robot.parts.netlist import PartPin
from miro_robot.parts.resolve import BoardError, resolve
from tests.robot.board.rig import image_of


class Gadget(PartKeys, frozen=True, kw_only=True, tag="gadget"):
    """A pin of each kind."""

    PINS = (
        Pin("input", IN),
        Pin("out", STRONG, optional=True),
        Pin("sda", OPEN_DRAIN, optional=True),
        Pin("data", TWO_WAY, optional=True),
    )


INPUT, OUT, SDA, DATA = range(4)


def gadget(**pins):
    return PartSpec(keys=Gadget(), pins=pins)


def on(netlist, net):
    """Port pins, then (part, pin, inverted) on a net."""
    number = netlist.names.index(net)
    ports = [f"P{pin >> 3}.{pin & 7}" for pin, there in enumerate(netlist.ports) if there == number]
    pins = [
        (part, pin, place.inverted)
        for part, places in enumerate(netlist.parts)
        for pin, place in enumerate(places)
        if place.net == number
    ]
    return ports, pins


def test_a_port_pin_and_its_name_are_one_net():
    parts = {"a": gadget(input="P1.0"), "b": gadget(input="START")}
    netlist = resolve(BoardSpec(parts=parts, nets={"START": ("P1.0", "P3.2")}))
    assert netlist.names == ("START",)
    assert on(netlist, "START") == (["P1.0", "P3.2"], [(0, INPUT, False), (1, INPUT, False)])


def test_a_pin_may_name_another_parts_pin_which_then_need_not_be_named_itself():
    netlist = resolve(BoardSpec(parts={"a": gadget(input="b.out"), "b": gadget(input="!a.input")}))
    assert netlist.names == ("b.out",)
    assert on(netlist, "b.out") == ([], [(0, INPUT, False), (1, INPUT, True), (1, OUT, False)])


def test_two_inverters_are_none():
    parts = {"a": gadget(input="!P1.0"), "b": gadget(input="!a.input"), "c": gadget(input="a.input")}
    assert on(resolve(BoardSpec(parts=parts)), "P1.0")[1] == [
        (0, INPUT, True),
        (1, INPUT, False),
        (2, INPUT, True),
    ]


def test_latches_buffers_straps_and_resistors_hang_on_nets():
    spec = BoardSpec(
        xram="none",
        parts={"a": gadget(input="CTRL.3", out="K", sda="P0.1")},
        latches={"CTRL": LatchSpec(address=0x8000, mask=0xC000)},
        buffers={
            "KEYS": BufferSpec(address=0x4000, mask=0xC000, pins=("K", *(f"P1.{bit}" for bit in range(1, 8))))
        },
        straps={"mode": StrapSpec(pin="P3.4", level=0)},
        pull_ups=("P0",),
        pull_downs=("P2.0",),
        allow_contention=("P0", "K"),
    )
    netlist = resolve(spec)
    number = netlist.names.index
    assert netlist.latches == ((-1, -1, -1, number("CTRL.3"), -1, -1, -1, -1),)
    assert netlist.buffers[0][:2] == (number("K"), number("P1.1"))
    assert (netlist.lows, netlist.highs) == ((number("P3.4"),), ())
    assert (netlist.pull_ups, netlist.pull_downs) == ((number("P0.1"),), (number("P2.0"),))
    assert netlist.allow_contention == (number("K"), number("P0.1"))


def test_constants_are_nets_of_their_own():
    netlist = resolve(BoardSpec(parts={"a": gadget(input="0"), "b": gadget(input="1", data="0")}))
    assert (netlist.names, netlist.lows, netlist.highs) == (("0", "1"), (0,), (1,))


def test_pins_that_are_not_connected_are_on_no_net():
    assert resolve(BoardSpec(parts={"a": gadget(input="P1.0")})).parts[0][OUT] == PartPin(-1, False)


@pytest.mark.parametrize(
    ("parts", "keys", "message"),
    [
        ({"a": gadget()}, {}, 'parts.a.pins: pin input is not connected; add input = ".."'),
        ({"a": gadget(inptu="P1.0")}, {}, "parts.a.pins.inptu: gadget has no such pin; did you mean input?"),
        ({"a": gadget(input="P4.0")}, {}, "parts.a.pins.input: there is no port pin P4.0; use P0.0 to P3.7"),
        ({"a": gadget(input="b.out")}, {}, "there is no part 'b'"),
        ({"a": gadget(input="a.oot")}, {}, "a (gadget) has no pin 'oot'; did you mean out?"),
        ({"a": gadget(input="X")}, {}, "net X has one pin only"),
        (
            {"a": gadget(input="a.sda", sda="a.input")},
            {},
            "a.input and a.sda name each other; leave one of them out",
        ),
        ({"a": gadget(input="P0.0")}, {}, "nothing can drive P0.0 high: P0 is open drain; add pull_ups"),
        ({"a": gadget(input="a.sda")}, {}, "nothing can drive a.sda high: it is open drain"),
        (
            {"a": gadget(input="P1.0", data="P0.0"), "b": gadget(input="P1.0", data="P0.0")},
            {},
            "P0 is open drain",
        ),
        (
            {"a": PartSpec(keys=Button(to="vcc"), pins={"pin": "P0.0"})},
            {},
            'parts.a.pins.pin: the processor reads P0.0 as high, closed or open; add pull_downs = ["P0.0"]',
        ),
        ({"a": gadget(input="P1.0", out="0")}, {}, 'an output cannot be tied to "0"'),
        (
            {"a": gadget(input="P1.0", sda="!P1.1")},
            {},
            "an inverter goes one way, this pin both; leave out the !",
        ),
        ({"a": gadget(input="!0")}, {}, """'!0' is a constant; write "1\""""),
        ({"a": gadget(input="C.8")}, {"latches": {"C": LatchSpec(address=1)}}, "latch C has no bit '8'"),
        ({"C": gadget(input="P1.0")}, {"latches": {"C": LatchSpec(address=1)}}, "parts.C has this name, too"),
        (
            {"a": gadget(input="b"), "b": gadget(input="P1.0")},
            {},
            "b is a part, not a net; name one of its pins",
        ),
        ({"a b": gadget(input="P1.0")}, {}, "'a b' is not a name"),
        ({"P1": gadget(input="P1.0")}, {}, "P1 is a port"),
        ({}, {"nets": {"A": ("P1.0",), "B": ("P1.0",)}}, "nets.B: P1.0 is net A, too"),
        ({}, {"straps": {"a": StrapSpec(pin="P1.0"), "b": StrapSpec(pin="P1.0")}}, "strap a is on P1.0, too"),
        ({}, {"pull_downs": ("X",)}, "pull_downs[0]: there is no net 'X'"),
        ({f"a{n}": gadget(input="P1.0") for n in range(65)}, {}, "65 parts, at most 64 fit"),
    ],
)
def test_what_cannot_be_built_is_one_line_with_place_and_remedy(parts, keys, message):
    with pytest.raises(BoardError) as raised:
        resolve(BoardSpec(parts=parts, **keys))
    assert message in f"{raised.value}"
    assert "\n" not in f"{raised.value}"


@pytest.mark.parametrize(
    ("parts", "keys"),
    [
        ({}, {"pull_downs": ("P1",)}),
        ({"b": gadget(input="P1.0", out="P1.0")}, {}),
        ({"a": gadget(input="P1.0")}, {}),
    ],
)
def test_a_contact_to_vcc_can_be_read_where_something_brings_its_net_low(parts, keys):
    key = PartSpec(keys=Button(to="vcc"), pins={"pin": "a.data" if "a" in parts else "P1.0"})
    assert resolve(BoardSpec(parts={"key": key, **parts}, **keys))


def test_the_order_of_tables_changes_nothing():
    parts = {name: gadget(input=f"P1.{number}", out=f"P2.{number}") for number, name in enumerate("dacb")}
    assert BoardSpec(parts=parts) == BoardSpec(parts=dict(reversed(parts.items())))
    assert list(BoardSpec(parts=parts).parts) == ["a", "b", "c", "d"]


def test_a_board_is_made_with_its_parts():
    spec = BoardSpec(parts={"lamp": PartSpec(keys=Led(), pins={"pin": "P1.0"})})
    board = board_of(spec, image_of("CLR P1.0\nSJMP $"))
    board.cpu.rxd.settled_tick = 1 << 60
    assert not board.value("lamp", "on")
    board.run(100)
    assert board.value("lamp", "on")


def test_parts_know_who_shares_their_nets():
    parts = {"b": PartSpec(keys=Led(), pins={"pin": "P1.0"}), "a": PartSpec(keys=Led(), pins={"pin": "P1.0"})}
    a, b = board_of(BoardSpec(parts=parts), image_of("SJMP $")).parts
    assert (a.place.peers, b.place.peers) == ({0: [(b, 0)]}, {0: [(a, 0)]})
    assert (a.place.connected, a.place.noise.name) == (frozenset({0}), "a")
