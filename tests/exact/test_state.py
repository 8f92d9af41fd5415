"""State from tables: flat bytes, what is refused, and names of what differs."""

import struct
from collections import deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact import engine, fields, places, state
from miro_exact.state import FLAG, TICK, Flat, Items, Octets, Queue, Row, Rows
from miro_robot.mcs51.line import Line
from tests.states import difference, restore, snapshot


class Wheel:
    STATE = {"angle": ("d", -10.0, 10.0), "turns": "i"}

    def __init__(self):
        self.angle = 0.5
        self.turns = -1


class Cart:
    """A part with a field of every kind."""

    STATE = {
        "tick": TICK,
        "moving": FLAG,
        "levels": ("3B", 0, 9),
        "wheels": [Wheel],
        "spare": Wheel,
        "ticks": Queue("q", 4, "end", 0, 1000),
        "bytes": Queue("B", 4, "count"),
        "flaws": Queue("B", 4, "count"),
        "waiting": Rows(3, ("q", 0, 100), "s", ordered=True),
        "pose": Row("d", "d", split=lambda pose: pose, make=lambda cells: cells),
        "text": Octets(5),
        "edges": Items("q", 3, 0, 100, ordered=True),
    }

    def __init__(self):
        self.tick = 7
        self.moving = 1
        self.levels = [1, 2, 3]
        self.wheels = {"left": Wheel(), "right": Wheel()}
        self.spare = None
        self.ticks = [30, 40, 50, 60]
        self.end = 4
        self.bytes = bytearray(b"ab..")
        self.flaws = bytearray(4)
        self.count = 2
        self.waiting = deque([(1, b"xy"), (1, b"")])
        self.pose = (1.0, -0.0)
        self.text = b"hi"
        self.edges = [3, 5]
        self.settled = 0
        self.doubled = 14

    def before_save(self):
        self.settled += 1

    def after_load(self):
        if self.tick == 99:
            raise ValueError("tick 99 contradicts the rest")
        self.doubled = 2 * self.tick


LAYOUT = (
    struct.pack("<qi3B", 7, 1, 1, 2, 3)
    + struct.pack("<didi", 0.5, -1, 0.5, -1)
    + struct.pack("<I4q", 4, 30, 40, 50, 60)
    + struct.pack("<I2sI2s", 2, b"ab", 2, b"\0\0")
    + struct.pack("<IqI2sqI", 2, 1, 2, b"xy", 1, 0)
    + struct.pack("<dd", 1.0, -0.0)
    + struct.pack("<I2s", 2, b"hi")
    + struct.pack("<I2q", 2, 3, 5)
)


def test_fields_lie_in_the_order_of_the_tables_without_padding():
    assert Flat(Cart()).save() == LAYOUT


def test_what_runs_late_is_settled_before_saving():
    cart = Cart()
    Flat(cart).save()
    assert cart.settled == 1


def test_loading_puts_every_field_back_and_works_out_the_rest():
    cart = Cart()
    flat = Flat(cart)
    changed = LAYOUT.replace(struct.pack("<q", 7), struct.pack("<q", 21), 1).replace(b"hi", b"ho")
    cart.end, cart.waiting = 0, deque()
    cart.wheels["right"].turns = 5
    flat.load(changed)
    assert flat.save() == changed
    assert (cart.tick, cart.doubled, cart.text, cart.end) == (21, 42, b"ho", 4)
    assert list(cart.waiting) == [(1, b"xy"), (1, b"")]


@given(cut=st.integers(0, len(LAYOUT) - 1))
def test_bytes_that_end_early_are_refused_without_a_change(cut):
    cart = Cart()
    flat = Flat(cart)
    with pytest.raises(ValueError, match=r"ends .* early"):
        flat.load(LAYOUT[:cut])
    assert flat.save() == LAYOUT


def test_bytes_behind_the_end_are_refused():
    with pytest.raises(ValueError, match=rf"has {len(LAYOUT) + 1} bytes, not {len(LAYOUT)}"):
        Flat(Cart()).load(LAYOUT + b"\0")


def changed(place, form, *values):
    return LAYOUT[:place] + struct.pack(form, *values) + LAYOUT[place + struct.calcsize(form) :]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (changed(0, "<q", -1), "tick is -1, not from 0"),
        (changed(8, "<i", 2), "moving is 2, not from 0 to 1"),
        (changed(12, "<B", 10), "levels is 10, not from 0 to 9"),
        (changed(15, "<d", 11.0), r"wheels\[left\].angle is 11.0"),
        (changed(27, "<d", float("nan")), r"wheels\[right\].angle is NaN"),
        (changed(39, "<I", 5), "ticks has 5 items, not at most 4"),
        (changed(43, "<q", 1001), "ticks is 1001, not from 0 to 1000"),
        (changed(81, "<I", 1), "flaws has 1 items, not 2"),
        (changed(87, "<I", 4), "waiting has 4 rows, not at most 3"),
        (changed(91, "<q", 2), "waiting is not in order"),
        (changed(99, "<I", 1 << 30), "waiting has 1073741824 bytes"),
        (changed(len(LAYOUT) - 8, "<q", 3), "edges is not in order"),
        (changed(len(LAYOUT) - 20, "<I", 4), "edges has 4 items, not at most 3"),
        (changed(0, "<q", 99), "tick 99 contradicts the rest"),
    ],
)
def test_a_value_out_of_its_range_is_refused_by_name_and_changes_nothing(data, message):
    cart = Cart()
    flat = Flat(cart)
    with pytest.raises(ValueError, match=message):
        flat.load(data)
    assert flat.save() == LAYOUT
    assert cart.doubled == 14


@given(st.binary(max_size=2 * len(LAYOUT)), st.integers(0, len(LAYOUT)))
def test_any_bytes_are_loaded_or_refused_without_a_change(data, place):
    cart = Cart()
    flat = Flat(cart)
    data = LAYOUT[:place] + data
    try:
        flat.load(data)
    except ValueError:
        assert flat.save() == LAYOUT
    else:
        assert flat.save() == data


def test_nan_cannot_be_saved():
    cart = Cart()
    cart.wheels["left"].angle = float("nan")
    with pytest.raises(ValueError, match=r"wheels\[left\].angle is NaN"):
        Flat(cart).save()


ODD = st.one_of(
    st.integers(-(1 << 65), 1 << 65), st.floats(), st.booleans(), st.none(), st.binary(max_size=3)
)


def packed(pack):
    try:
        return pack()
    except Exception as error:
        return type(error), str(error)


@given(
    st.sampled_from(["tick", "moving", "levels", "waiting", "pose", "text", "edges"]),
    st.one_of(ODD, st.lists(ODD, max_size=5), st.lists(st.tuples(ODD, ODD), max_size=4), st.tuples(ODD, ODD)),
)
def test_fields_that_are_packed_together_give_the_bytes_or_the_error_of_each_alone(name, value):
    cart = Cart()
    flat = Flat(cart)
    setattr(cart, name, value)
    alone = packed(lambda: b"".join([block.pack() for block in flat._blocks]))
    assert packed(flat.save) == packed(flat.hashed) == alone


def test_a_state_that_holds_nan_can_be_left():
    cart = Cart()
    flat = Flat(cart)
    cart.wheels["left"].angle = float("nan")
    flat.load(LAYOUT)
    assert flat.save() == LAYOUT


def test_a_difference_is_told_by_the_name_of_the_field_and_both_values():
    cart = Cart()
    flat = Flat(cart)
    cart.wheels["right"].turns = 5
    assert difference(flat, LAYOUT, flat.save()) == ("wheels[right].turns", -1, 5)
    assert difference(flat, LAYOUT, LAYOUT) is None


def test_a_class_without_a_table_has_no_state():
    with pytest.raises(TypeError, match="object declares no state"):
        Flat(object())


# ---- compiled parts: memory.pyx writes what fields.py writes


edges = st.lists(st.integers(1, 50), max_size=40).map(
    lambda steps: [sum(steps[: k + 1]) for k in range(len(steps))]
)


@given(ticks=edges, forget=st.integers(0, 500), more=edges)
def test_a_wire_is_written_as_its_live_edges_whatever_engine_runs(ticks, forget, more):
    line, level = Line(), 1
    for tick in ticks:
        level ^= 1
        line.append(tick, level)
    line.forget(forget)
    last = max([0, *ticks])
    for tick in more:
        level ^= 1
        line.append(last + tick, level)
    kept = [tick for tick, _ in line.edges()]
    before = level ^ len(kept) & 1
    expected = struct.pack(f"<qiI{len(kept)}q", 0, before, len(kept), *kept)
    assert snapshot(line) == expected
    other = Line()
    restore(other, expected)
    assert other.edges() == line.edges()


@given(data=st.binary(max_size=60))
def test_a_wire_takes_any_bytes_or_refuses_them_without_a_change(data):
    line = Line()
    line.append(5, 0)
    before = snapshot(line)
    try:
        restore(line, data)
    except ValueError:
        assert snapshot(line) == before
    else:
        assert snapshot(line) == data


def test_a_wire_whose_edges_go_back_is_refused():
    line = Line()
    line.append(5, 0)
    with pytest.raises(ValueError, match="ticks is not in order"):
        restore(line, struct.pack("<qiI2q", 0, 1, 2, 4, 3))
    assert line.edges() == [(5, 0)]


@pytest.mark.skipif(engine.active() != "compiled", reason="nothing is compiled here")
def test_a_table_that_does_not_fit_the_c_layout_is_refused():
    held = {"a": (4096, "int", 4), "b": (4104, "long long", 48)}
    for name, kind in (("a", fields.Number("q")), ("a", fields.Number("2i")), ("b", fields.Number("5q"))):
        with pytest.raises(TypeError, match=f"Cart.{name}"):
            state._layout(Cart(), [(name, kind)], held)


def test_the_fields_of_a_layout_are_those_of_plain_c_types():
    layout = """
cdef class Line(Base):  # a wire
    cdef public long long settled_tick
    cdef bint unread
    cdef int _a, _b[2]
    cdef readonly object other

    cpdef int level_at(self, long long tick) noexcept
    @cython.locals(cursor='long long')
    cdef void _seek(self, long long tick) noexcept


cdef class Other:
    cdef u64_t k0
"""
    assert places.fields_of(layout) == {
        "Line": [
            ("settled_tick", "long long", False),
            ("unread", "bint", False),
            ("_a", "int", False),
            ("_b", "int", True),
        ],
        "Other": [("k0", "unsigned long long", False)],
    }


def test_every_c_type_of_a_layout_has_a_code():
    assert {*places.C_TYPES} == state.CODES.keys()


def test_what_sets_the_c_arrays_of_a_new_object_to_zero_is_not_compiled():
    """Not a list that is no C array, nor ones, nor what another method sets back."""
    source = """
class Line:
    def __init__(self, levels):
        self.ticks = [0] * 8  # none yet
        self.places = [0.0] * SIZE
        self.bytes = bytearray(4)
        self.waiting = [0] * 8
        self.weights = [1] * 8
        self.levels = levels

    def reset(self):
        self.ticks = [0] * 8
"""
    layout = """
cdef class Line:
    cdef int ticks[8]
    cdef double places[8], weights[8]
    cdef unsigned char bytes[4]
    cdef list waiting, levels
"""
    lines = places.without_zeros(source, layout).splitlines()
    assert lines[3:6] == ["        pass"] * 3
    assert lines[:3] + lines[6:] == source.splitlines()[:3] + source.splitlines()[6:]
