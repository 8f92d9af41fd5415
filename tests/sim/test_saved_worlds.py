"""A saved world is loaded as it was saved, or refused in one line; compiled code never trusts what it says."""

import hashlib
import struct

import pytest

from miro_sim.world.saved import opened, sealed
from tests.sim.mutated_worlds import (
    changed,
    changed_values,
    fresh,
    saved_worlds,
    with_bytes_changed,
    with_field,
)


@pytest.fixture(scope="module")
def saved():
    return saved_worlds()[2]


CPU = "lines[0].devices[0].board.cpu"


@pytest.mark.parametrize(
    ("path", "data"),
    [
        (f"{CPU}.pc", struct.pack("<i", 0x10000)),
        (f"{CPU}.sp", struct.pack("<i", 256)),
        (f"{CPU}.cycles", struct.pack("<q", 1 << 60)),
        (f"{CPU}.peripherals.uart.rx_period", struct.pack("<q", 0)),
        (f"{CPU}.peripherals.uart.tx_left", struct.pack("<i", 12)),
        (f"{CPU}.peripherals.shift.number", struct.pack("<i", 9)),
        (f"{CPU}.peripherals.ports.pending", struct.pack("<IqBB", 1, 1 << 30, 4, 0)),
        (f"{CPU}.peripherals.uart.rxd.ticks", struct.pack("<I", 1 << 23) + bytes(8)),
        ("lines[0].telemetry.decoder._data", struct.pack("<I", 4161) + bytes(4161)),
    ],
)
def test_what_compiled_code_takes_for_an_index_or_a_divisor_is_checked_by_name(saved, path, data):
    world = fresh()
    with pytest.raises(ValueError, match=path.replace("[", r"\[").replace("]", r"\]")):
        world.load(with_field(world, saved, path, data))


@pytest.mark.parametrize(
    ("path", "tick"),
    [
        ("tick", 1 << 40),
        (f"{CPU}.cycles", 5),
        ("lines[0].downlink.settled_tick", 1 << 41),
        ("lines[0].downlink.free_tick", 1 << 61),
        ("lines[0].uplink.now", 1 << 40),
        ("lines[0].devices[1].board.left.next_tick", 1),
        ("lines[0].devices[1].board.plant.tick", 1),
        (f"{CPU}.peripherals.uart.rxd.settled_tick", 1 << 61),
    ],
)
def test_a_part_that_does_not_stand_where_the_world_does_is_refused_without_a_change(saved, path, tick):
    world = fresh()
    before = world.state.save()
    with pytest.raises(ValueError, match=r"\d"):
        world.load(with_field(world, saved, path, struct.pack("<q", tick)))
    assert world.state.save() == before


def test_characters_that_wait_for_a_busy_transmitter_are_refused(saved):
    path, busy = "lines[0].downlink.free_tick", 1 << 40
    with pytest.raises(ValueError, match=f"characters wait, but the transmitter is busy until tick {busy}"):
        fresh().load(with_field(fresh(), saved, path, struct.pack("<q", busy)))


def test_a_world_that_was_cut_off_is_refused(saved):
    for size in (0, 1, 8, 144, len(saved) - 1):
        with pytest.raises(ValueError, match="saved world"):
            fresh().load(saved[:size])


def test_a_world_with_other_fields_is_refused_as_one_of_another_version(saved):
    world = fresh()
    other = sealed(world.identity()._replace(tables="00" * 32), opened(saved, world.identity()))
    with pytest.raises(ValueError, match="another version of this program saved it"):
        world.load(other)


def test_a_version_that_is_no_text_makes_no_second_line_and_moves_no_cursor(saved):
    content = saved[:8] + b"\x1b[2J\n\0\xd4" + saved[15:24] + bytes(32) + saved[56:-32]
    with pytest.raises(ValueError, match="another version of this program saved it") as caught:
        fresh().load(content + hashlib.sha256(content).digest())
    assert str(caught.value).isprintable()


def test_what_a_saved_world_belongs_to_is_told(saved):
    world = fresh()
    other = sealed(world.identity()._replace(seed=12), opened(saved, world.identity()))
    with pytest.raises(ValueError, match="saved world has seed 12, this world has 11"):
        world.load(other)


def test_worlds_with_bytes_changed_are_all_refused():
    assert changed(with_bytes_changed, 300, 1) == {"refused": 300}


@pytest.mark.slow
def test_worlds_with_values_changed_are_refused_or_run():
    found = changed_values(150, 1)
    assert set(found) == {"refused", "ran"}
    assert found["refused"] > 50
