"""What somebody else's part does wrong is one error that names the part, and no crash: `make`, attributes, faults."""

import pytest

from miro_exact.plugins import PluginError
from miro_exact.state import FLAG
from miro_robot.board_spec import BoardSpec, PartSpec
from miro_robot.build import board_of
from miro_robot.parts.keys import IN, PartKeys, Pin
from miro_robot.parts.led import Led
from miro_robot.parts.part import Part
from tests.robot.mcs51.asm import image_of


class OwnPart(Part):
    STATE = {"lit": FLAG}

    def __init__(self, keys, place):
        super().__init__(keys, place)
        self.lit = 0

    def start(self, tick):
        self.next_tick = tick + 100


class Bare(Part):
    def __init__(self, keys, place):
        pass


class Own(PartKeys, frozen=True, kw_only=True, tag="own"):
    PINS = (Pin("a", IN), Pin("b", IN))

    def make(self, place):
        return MAKES[0](self, place)


MAKES = [OwnPart]


def board(make=OwnPart, parts=("p",)):
    MAKES[0] = make
    spec = BoardSpec(parts={name: PartSpec(keys=Own(), pins={"a": "P1.0", "b": "P1.1"}) for name in parts})
    return board_of(spec, image_of("SJMP $"))


def refused(make, **more):
    with pytest.raises(PluginError) as raised:
        board(make, **more)
    return f"{raised.value}"


@pytest.mark.parametrize("made", [None, 5, OwnPart])
def test_what_is_no_part_is_refused(made):
    assert refused(lambda keys, place: made).startswith(
        f"part 'p' (own): `make` returned {made!r:.40}; return a Part"
    )


@pytest.mark.parametrize("make", [lambda keys, place: Led().make(place), Bare])
def test_a_part_of_other_keys_is_refused(make):
    assert refused(make).startswith(
        "part 'p' (own): `make` returned a part of other keys, or of another place; "
    )


def test_one_part_for_two_places_is_refused():
    made = []

    def once(keys, place):
        made.append(OwnPart(keys, place))
        return made[0]

    assert refused(once, parts=("p", "q")).startswith("part 'q' (own): `make` returned a part of other keys")


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, "attribute 'lit' is neither in STATE nor in NOT_STATE"),
        ({"lit": FLAG, "dim": FLAG}, "STATE['dim'] = "),
        ({"lit": 5}, "STATE['lit'] = 5: "),
        ({"lit": ("zz", 0, 1)}, "STATE['lit'] = ('zz', 0, 1): "),
        ({"lit": float}, "STATE['lit'] = float, which has no STATE; of a number it is "),
        ({"lit": ("f", 0, 1)}, "STATE['lit'] = ('f', 0, 1); of a number it is "),
        (None, "TypeError: 'NoneType' object is not iterable"),
    ],
)
def test_a_table_that_is_not_as_the_part_is_refused(table, said):
    odd = type("Odd", (Part,), {"STATE": table})
    odd.__init__ = lambda part, keys, place: (Part.__init__(part, keys, place), setattr(part, "lit", 0))[0]
    text = refused(odd)
    assert text.startswith(f"part 'p' (own), tick 0: {said}")
    assert text.endswith("; mend its STATE or NOT_STATE, or what it sets")


@pytest.mark.parametrize("value", [0.5, "x", None, 5])
def test_a_value_that_no_file_can_hold_is_refused_before_it_is_saved(value):
    made = board()
    made.parts[0].lit = value
    with pytest.raises(PluginError, match=r"part 'p' \(own\), tick 0: attribute 'lit' is "):
        made.before_save()


def test_an_event_later_than_never_is_refused_before_it_is_saved():
    made = board()
    made.parts[0].next_tick = (1 << 63) - 1
    with pytest.raises(
        PluginError, match=r"attribute 'next_tick' is 9223372036854775807: is .*, not from 0 to"
    ):
        made.before_save()


def test_a_fault_of_no_kind_is_the_parts_error():
    class Finder(OwnPart):
        def due(self, tick):
            self.fault(999, "odd")

    made = board(Finder)
    with pytest.raises(
        PluginError, match=r"part 'p' \(own\), tick 100: ValueError: has found a fault of kind 999"
    ):
        made.sync(200)
