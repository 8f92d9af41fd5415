"""Nets: drivers make levels, changes spread in waves, all parts of one tick act together."""

import hashlib
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.plugins import PluginError
from miro_robot.faults import FaultKind
from miro_robot.parts.keys import HIGH, LOW, RELEASED
from miro_robot.parts.nets import Nets, Observer
from tests import children
from tests.naive.nets import NaiveNets, Ring
from tests.robot.parts.scripted import (
    A,
    Answer,
    B,
    D,
    Q,
    R,
    Scripted,
    ScriptedPart,
    W,
    board_of,
    scripted,
    wired,
)
from tests.states import restore, snapshot

P0, P1, P2, P3 = range(4)
ON_P1 = {(P1, 2): "n"}
SAME, OPPOSITE = [Answer(A, Q)], [Answer(A, Q, inverted=1)]


def levels(board):
    return {name: board.nets.levels[board.nets.number(name)] for name in board.nets.names}


def one_net(*parts, pins, **more):
    """A board on which a pin of each part is on net `n`, with P1.2."""
    return board_of(netlist=wired(ON_P1, [{pin: "n"} for pin in pins], **more), parts=parts)


# Drivers and levels


@pytest.mark.parametrize(
    ("first", "second", "port", "down", "level"),
    [
        (RELEASED, RELEASED, 1, False, 1),
        (RELEASED, RELEASED, 1, True, 0),
        (HIGH, RELEASED, 1, True, 1),
        (LOW, RELEASED, 1, False, 0),
        (HIGH, LOW, 1, False, 0),
        (RELEASED, RELEASED, 0, False, 0),
        (HIGH, RELEASED, 0, False, 0),
    ],
)
def test_a_low_wins_over_a_high_over_a_resistor(first, second, port, down, level):
    parts = [scripted(name, [(5, Q, drive)]) for name, drive in (("a", first), ("b", second))]
    board = one_net(*parts, pins=[Q, Q], pull_downs=["n"] if down else [])
    board.port_written(P1, 0xFB | port << 2, 12)
    board.sync(12)
    assert levels(board) == {"n": level}


def test_a_pin_behind_an_inverter_sees_and_drives_the_other_level():
    one, other = scripted("a", [(5, Q, LOW)]), scripted("b", answers=[Answer(A, D)])
    board = board_of(netlist=wired(ON_P1, [{Q: "!n"}, {A: "!n"}]), parts=[one, other])
    assert other.level(A) == 0
    board.port_written(P1, 0xFB, 12)
    assert levels(board) == {"n": 0}
    assert other.level(A) == 1
    assert one.level(Q) == 1
    assert board.nets.drivers(0) == ["P1.2", "a.q"]


def test_a_part_can_see_the_level_without_its_own_drive():
    part = scripted("a", [(5, W, LOW), (7, W, HIGH)])
    board = one_net(part, pins=[W])
    board.sync(5)
    assert (part.level(W), part.others(W), part.is_driven(W)) == (0, 1, 0)
    board.port_written(P1, 0xFB, 12)
    assert (part.level(W), part.others(W), part.is_driven(W)) == (0, 0, 1)


def test_pins_that_nothing_is_wired_to_have_their_stated_level():
    part = scripted("a")
    board_of(netlist=wired({}, [{}]), parts=[part])
    assert [part.level(pin) for pin in range(6)] == [1] * 6


# Waves


def test_parts_of_one_tick_see_the_same_levels_and_act_together():
    one, other = scripted("a", [(5, Q, LOW)], SAME), scripted("b", [(5, Q, LOW)], SAME)
    netlist = wired({}, [{Q: "x", A: "y"}, {Q: "y", A: "x"}])
    board_of(netlist=netlist, parts=[one, other]).sync(5)
    assert [call[:4] for call in one.heard] == [
        (5, "due", 0, [1, 1, 1, 1, 1, 1]),
        (5, "changed", 1 << A | 1 << Q, [0, 1, 0, 1, 1, 1]),
    ]
    assert one.heard == other.heard


def test_a_part_is_called_once_a_wave_with_all_pins_that_have_changed():
    part = scripted("a")
    board = board_of(netlist=wired({(P2, 0): "x", (P2, 7): "y"}, [{A: "x", B: "y"}]), parts=[part])
    board.port_written(P2, 0x7E, 24)
    assert [call[:3] for call in part.heard] == [(24, "changed", 1 << A | 1 << B)]


def test_a_chain_without_delay_ends_on_its_tick():
    names = "abcdefgh"
    nets = [f"n{number}" for number in range(9)]
    parts = [scripted(name, answers=SAME) for name in names]
    netlist = wired(
        {(P0, 0): "n0", (P0, 1): "n8"}, [{A: nets[number], Q: nets[number + 1]} for number in range(8)]
    )
    board = board_of(netlist=netlist, parts=parts)
    board.port_written(P0, 0xFE, 36)
    assert [part.heard[0][0] for part in parts] == [36] * 8
    assert levels(board)["n8"] == 0
    assert board.nets.external[P0] == 0xFD


# Contention


def faults(board):
    return [(fault.tick, fault.detail) for fault in board.faults]


def test_two_outputs_of_different_level_are_a_fault_that_names_both():
    parts = [scripted("left", [(5, Q, HIGH), (50, Q, LOW), (90, Q, HIGH)]), scripted("right", [(9, R, LOW)])]
    board = board_of(netlist=wired({}, [{Q: "n"}, {R: "n"}]), parts=parts)
    board.sync(100)
    assert {fault.kind for fault in board.faults} == {FaultKind.NET_CONTENTION}
    assert faults(board) == [(9, "net n: left.q and right.r"), (90, "net n: left.q and right.r")]


def test_contention_that_is_allowed_on_a_net_is_no_fault_there_and_the_low_level_wins():
    parts = [
        scripted("left", [(5, Q, HIGH), (6, W, HIGH)]),
        scripted("right", [(9, R, LOW), (12, Q, LOW)]),
        scripted("third"),
    ]
    nets = [{Q: "n", W: "m"}, {R: "n", Q: "m"}, {A: "n"}]
    board = board_of(netlist=wired({}, nets, allow_contention=["n"]), parts=parts)
    board.sync(100)
    assert faults(board) == [(12, "net m: left.w and right.q")]
    assert levels(board)["n"] == 0


def test_a_port_that_pulls_low_against_an_output_is_one():
    board = one_net(scripted("a", [(5, Q, HIGH)]), pins=[Q])
    board.port_written(P1, 0xFB, 12)
    assert faults(board) == [(12, "net n: P1.2 and a.q")]


def test_drivers_that_change_on_one_tick_do_not_meet():
    parts = [scripted("a", [(5, Q, HIGH), (9, Q, LOW)]), scripted("b", [(5, Q, RELEASED), (9, Q, LOW)])]
    board = one_net(*parts, pins=[Q, Q])
    board.port_written(P1, 0xFB, 9)
    assert not board.faults


def test_a_part_that_answers_within_the_tick_prevents_it():
    parts = [scripted("a", [(5, Q, HIGH)], [Answer(B, Q, 2)]), scripted("b")]
    netlist = wired({(P1, 2): "n", (P1, 3): "other"}, [{Q: "n", B: "other"}, {}])
    board = board_of(netlist=netlist, parts=parts)
    board.port_written(P1, 0xF3, 12)
    assert not board.faults


def test_ground_and_vcc_are_drivers_too():
    board = one_net(scripted("a", [(5, Q, HIGH)]), pins=[Q], lows=["n"])
    board.sync(5)
    assert faults(board) == [(5, "net n: a.q and ground")]


def test_contention_from_power_on_is_found():
    class Early(ScriptedPart):
        def start(self, tick):
            self.drive(Q, HIGH)

    board = one_net(scripted("a", cls=Early), pins=[Q], lows=["n"])
    assert faults(board) == [(0, "net n: a.q and ground")]


# Guards


class Wrong(ScriptedPart):
    """Does at its event what the test says."""

    def due(self, tick):
        self.deed(tick)


def wrong(deed, **kwargs):
    part = scripted("bad", [(5, Q, LOW)], cls=type("Deed", (Wrong,), {"deed": deed}), **kwargs)
    board = board_of(netlist=wired(ON_P1, [{Q: "n", A: "in"}]), parts=[part])
    with pytest.raises(PluginError) as raised:
        board.sync(100)
    return str(raised.value)


def test_a_wake_in_the_past_names_part_and_tick():
    assert wrong(lambda part, tick: setattr(part, "next_tick", 4)) == (
        "part 'bad' (scripted), tick 5: wants its next event at tick 4, which is past; "
        "set next_tick beyond the tick of the call"
    )


def test_an_event_that_stays_due_is_one():
    assert "next event at tick 5, which is past" in wrong(lambda part, tick: None)


def test_a_part_that_raises_is_named_with_its_line():
    said = wrong(lambda part, tick: 1 // 0)
    assert said.startswith(
        "part 'bad' (scripted), tick 5: ZeroDivisionError: integer division or modulo by zero"
    )
    assert "test_nets.py:" in said
    assert said.endswith("; repair the part")


def test_a_part_that_leaves_the_program_is_named():
    def leave(part, tick):
        raise SystemExit(3)

    assert wrong(leave).startswith("part 'bad' (scripted), tick 5: SystemExit: 3")


@pytest.mark.parametrize(
    ("pin", "level", "said"),
    [
        (A, LOW, "drives its pin a low, which it cannot"),
        (D, HIGH, "drives its pin d high, which it cannot"),
        (31, LOW, "drives its pin 31 low, which it cannot"),
        (99, LOW, "drives pin 99 to level 0, which does not exist"),
        (-1, LOW, "drives pin -1 to level 0, which does not exist"),
        (Q, 7, "drives pin 2 to level 7, which does not exist"),
    ],
)
def test_a_pin_that_cannot_be_driven_so_is_refused(pin, level, said):
    assert said in wrong(lambda part, tick: part.drive(pin, level))


def test_a_part_that_raises_at_an_edge_is_named_with_the_pin():
    class Bad(ScriptedPart):
        def changed(self, pins, tick):
            raise ValueError("no")

    part = scripted("bad", cls=Bad)
    board = one_net(part, pins=[A])
    with pytest.raises(PluginError, match=r"part 'bad' \(scripted\), pin a, tick 12: ValueError: no"):
        board.port_written(P1, 0xFB, 12)


def test_a_ring_without_delay_names_its_parts_pins_and_tick():
    parts = [
        scripted("a", answers=OPPOSITE),
        scripted("b", answers=SAME),
        scripted("c", [(12, D, LOW), (13, D, 2)]),
    ]
    netlist = wired({}, [{A: "y", Q: "x"}, {A: "x", Q: "y"}, {D: "y"}])
    with pytest.raises(
        PluginError, match=r"^part 'b' \(scripted\), pin q, tick 13: a ring without delay: no end"
    ):
        board_of(netlist=netlist, parts=parts, stop_on_fault=False).sync(20)


def test_a_part_that_moves_a_pin_before_its_reach_tick_is_refused():
    class Sooner(ScriptedPart):
        def start(self, tick):
            ScriptedPart.start(self, tick)
            self.reach_tick = 50

    part = scripted("a", [(5, Q, LOW)], cls=Sooner)
    with pytest.raises(
        PluginError, match=r"part 'a' .*pin q, tick 5: drives its pin before its reach_tick 50"
    ):
        one_net(part, pins=[Q]).sync(5)


# Observers


def test_several_observers_get_the_edges_of_their_own_nets():
    board = one_net(scripted("a", [(5, Q, LOW), (9, Q, RELEASED)]), pins=[Q])
    nets = board.nets
    one, other = Observer([nets.number("n")]), Observer([nets.number("P1.2"), nets.number("P1.3")])
    nets.observe(one)
    nets.observe(other)
    board.port_written(P1, 0xF7, 12)
    assert one.edges == [(5, 0, 0), (9, 0, 1)]
    nets.ignore(one)
    board.port_written(P1, 0xFF, 24)
    assert one.take(9) == [(5, 0, 0)]
    assert one.take(99) == [(9, 0, 1)]
    assert other.edges == [(5, 0, 0), (9, 0, 1), (12, nets.number("P1.3"), 0), (24, nets.number("P1.3"), 1)]


def test_a_level_that_is_there_for_no_time_is_no_edge():
    part = scripted("a", answers=[Answer(A, Q, LOW)])
    board = board_of(netlist=wired({(P1, 2): "n", (P1, 3): "k"}, [{A: "k", Q: "n"}]), parts=[part])
    observer = Observer([board.nets.number("n")])
    board.port_written(P1, 0xFB, 12)
    board.nets.observe(observer)
    board.port_written(P1, 0xF7, 24)  # the port lets go, the part pulls
    assert observer.edges == []


def test_a_port_pin_with_nothing_on_it_is_observed_from_where_it_is():
    board = board_of()
    board.port_written(P3, 0x7F, 12)
    net = board.nets.number("P3.7")
    observer = Observer([net])
    board.nets.observe(observer)
    assert board.nets.levels[net] == 0
    board.port_written(P3, 0xFF, 24)
    board.port_written(P3, 0xFE, 36)
    assert observer.edges == [(24, net, 1)]


def test_a_net_that_does_not_exist_is_refused():
    with pytest.raises(ValueError, match=r"eyes\.echo is not a net"):
        board_of().nets.number("eyes.echo")


# The slow obvious twin


@st.composite
def cases(draw):
    return random.Random(draw(st.integers(0, 1 << 32)))


def random_case(chance):
    """Ports, pins, keys of parts and writes: everything that both sides are made from."""
    nets = [f"n{number}" for number in range(chance.randint(1, 5))]
    free = [(port, bit) for port in range(4) for bit in range(8)]
    ports = {chance.choice(free): chance.choice(nets) for _ in range(chance.randint(0, 4))}
    parts, wiring = [], []
    for _ in range(chance.randint(1, 4)):
        pins = {}
        for pin in range(6):
            if chance.random() < 0.5:
                mark = "!" if pin in (A, B, Q, R) and chance.random() < 0.2 else ""
                pins[pin] = mark + chance.choice(nets)
        events = sorted(
            (chance.randint(1, 60), output, chance.choice(drives_of(output)))
            for output in chance.choices([Q, R, D, W], k=chance.randint(0, 4))
        )
        answers = [
            Answer(
                chance.choice([A, B, D, W]),
                output,
                chance.choice([None, *drives_of(output)]),
                chance.randint(0, 1),
                chance.choice([0, 0, 1, 2, 7]),
            )
            for output in chance.choices([Q, R, D, W], k=chance.randint(0, 2))
        ]
        parts.append(Scripted(events=tuple(events), answers=tuple(answers)))
        wiring.append(pins)
    ticks = sorted(chance.sample(range(1, 60), chance.randint(0, 8)))
    writes = [(tick, chance.randint(0, 3), chance.choice([0, 255, chance.randint(0, 255)])) for tick in ticks]
    downs = [net for net in nets if chance.random() < 0.2]
    return nets, ports, wiring, parts, writes, downs


def drives_of(output):
    return [LOW, RELEASED] if output == D else [LOW, HIGH, RELEASED]


def made(case, order=None):
    """The board of a case, and its parts; `order`: in which they stand on the board."""
    nets, ports, wiring, keys, _, downs = case
    parts = [ScriptedPart(key, scripted(f"part{index}").place) for index, key in enumerate(keys)]
    order = range(len(parts)) if order is None else order
    netlist = wired(ports, [wiring[index] for index in order], pull_downs=downs, pull_ups=nets)
    return board_of(netlist=netlist, parts=[parts[index] for index in order], stop_on_fault=False), parts


def fast(case, order=None):
    """What parts heard, edges, faults, and the levels at the ports; or that it is a ring."""
    nets, writes = case[0], case[4]
    board, parts = made(case, order)
    observer = Observer(range(len(nets)))
    board.nets.observe(observer)
    try:
        for tick, port, latch in writes:
            board.port_written(port, latch, tick)
        board.sync(80)
    except PluginError as error:
        return "ring" if "a ring without delay" in str(error) else error
    names = board.nets.names
    edges = sorted((tick, names[net], level) for tick, net, level in observer.edges)
    found = [(fault.tick, fault.detail.split(":")[0].removeprefix("net ")) for fault in board.faults]
    return [part.heard for part in parts], edges, found, list(board.nets.external)


def slow(case):
    nets, ports, wiring, keys, writes, downs = case
    pins = {
        (index, pin): (net.lstrip("!"), int(net.startswith("!")))
        for index, there in enumerate(wiring)
        for pin, net in there.items()
    }
    twin = NaiveNets(nets, ports, pins, keys, downs)
    try:
        for tick in range(1, 81):
            twin.step(tick, [(port, latch) for at, port, latch in writes if at == tick])
    except Ring:
        return "ring"
    return [part.heard for part in twin.parts], sorted(twin.edges), twin.faults, twin.shown


@given(cases())
def test_nets_do_what_the_slow_obvious_twin_does(chance):
    case = random_case(chance)
    assert fast(case) == slow(case)


@given(cases())
def test_the_order_of_the_parts_changes_nothing(chance):
    case = random_case(chance)
    order = chance.sample(range(len(case[3])), len(case[3]))
    ours, theirs = fast(case), fast(case, order)
    assert ours == theirs or [*ours[:2], ours[3]] == [*theirs[:2], theirs[3]]


def histories():
    """A hash over many random boards, the same in both engines."""
    return hashlib.sha256(
        repr([fast(random_case(random.Random(seed))) for seed in range(60)]).encode()
    ).hexdigest()


def test_both_engines_do_the_same():
    assert children.same_uncompiled(histories)


def test_nets_start_from_a_saved_state_with_the_same_levels():
    for seed in range(30):
        case = random_case(random.Random(seed))
        (one, _), (other, _) = made(case), made(case)
        try:
            one.sync(30)
        except PluginError:
            continue
        restore(other, snapshot(one))
        assert snapshot(other) == snapshot(one)
        assert [*other.nets.levels] == [*one.nets.levels]
        assert [*other.nets.external] == [*one.nets.external]
        for old, new in zip(one.parts, other.parts, strict=True):
            assert (old.levels, old.outside, old.driven) == (new.levels, new.outside, new.driven)


def test_nets_have_no_state():
    assert Nets.NOT_STATE == ("*",)


# A port pin that is shorted


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("port", [0, 1])
@pytest.mark.parametrize("drive", [LOW, HIGH, RELEASED])
def test_a_short_wins_over_all_drivers_and_is_no_contention(drive, port, level):
    board = one_net(scripted("x", [(5, Q, drive)]), scripted("y"), pins=(Q, A), pull_downs=["n"])
    board.sync(5)
    board.port_written(P1, 0xFB | port << 2, 12)
    before, seen = dict(levels(board)), board.nets.external[P1]
    board.faults.clear()
    board.hold_pin(1, 2, level)
    assert levels(board) == {"n": level}
    assert board.parts[1].level(A) == level
    other = one_net(scripted("x", [(5, Q, drive)]), scripted("y"), pins=(Q, A), pull_downs=["n"])
    restore(other, snapshot(board))
    assert levels(other) == levels(board)
    board.port_written(P1, 0xFB | (1 - port) << 2, 24)
    board.port_written(P1, 0xFB | port << 2, 36)
    assert levels(board) == {"n": level}
    assert board.faults == []
    board.hold_pin(1, 2, -1)
    assert (levels(board), board.nets.external[P1]) == (before, seen)


def test_outputs_that_meet_while_a_pin_that_nothing_is_wired_to_is_shorted_are_a_fault():
    board = one_net(scripted("x", [(5, Q, LOW)]), scripted("y", [(7, Q, HIGH)]), pins=(Q, Q))
    board.hold_pin(1, 7, 0)
    board.sync(20)
    assert [fault.kind.name for fault in board.faults] == ["NET_CONTENTION"]


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("latched", [0, 1])
def test_a_short_of_a_pin_with_nothing_on_it_lasts_while_it_is_observed_and_ends(level, latched):
    board = board_of()
    board.port_written(P3, 0x7F | latched << 7, 12)
    net = board.nets.number("P3.7")
    board.hold_pin(3, 7, level)
    observer = Observer([net])
    board.nets.observe(observer)
    assert board.nets.levels[net] == level
    board.port_written(P3, 0x7F | (1 - latched) << 7, 24)
    assert board.nets.levels[net] == level
    board.hold_pin(3, 7, -1)
    assert board.nets.levels[net] == 1 - latched
    board.port_written(P3, 0x7F | latched << 7, 48)
    assert board.nets.levels[net] == latched
