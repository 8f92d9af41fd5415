"""A saved world is loaded as it was saved, or refused in one line; compiled code never trusts what it says."""

import msgspec
import pytest
from tests.sim.mutated_worlds import changed_bytes, changed_values, fresh, saved_worlds

from miro_robot.mcs51.line import Line
from miro_sim.world.world import SAVE_BEGIN, sealed


@pytest.fixture(scope="module")
def saved():
    return saved_worlds()[2]


def content_of(saved):
    return msgspec.msgpack.decode(saved[len(SAVE_BEGIN) + 32 :])


def robot_of(content):
    return content["state"]["networks"][0]["robots"][0]


def refusal(content) -> str:
    with pytest.raises(ValueError, match=r"^not a saved world: ") as error:
        fresh().load(sealed(msgspec.msgpack.encode(content)))
    assert "\n" not in str(error.value)
    return str(error.value)


def test_more_edges_than_a_new_line_holds_do_not_leave_it():
    """Of 4096 places once; whatever was behind them was written over."""
    line = Line()
    line.restore({"settled_tick": 0, "before": 1, "ticks": list(range(200_000))})
    assert line.level_at(199_999) == 1
    assert len(line.edges()) == 200_000


@pytest.mark.parametrize("ticks", [[5, 5], [6, 5], [-1], [1 << 63], [0.5], [None], "ab", None, [1, [2]]])
def test_edges_that_are_not_in_order_are_refused(ticks):
    with pytest.raises(ValueError, match="ticks"):
        Line().restore({"settled_tick": 0, "before": 1, "ticks": ticks})


def test_any_byte_that_changes_is_noticed(saved):
    world = fresh()
    for place in range(0, len(saved), 101):
        with pytest.raises(ValueError, match=r"^not a saved world: "):
            world.load(saved[:place] + bytes([saved[place] ^ 1]) + saved[place + 1 :])


def test_a_world_of_the_format_before_is_refused_in_words(saved):
    with pytest.raises(ValueError, match="does not begin like one; save it again with this version"):
        fresh().load(saved[len(SAVE_BEGIN) + 32 :])


def test_a_world_that_was_cut_off_is_refused(saved):
    for size in (0, 1, len(SAVE_BEGIN), len(SAVE_BEGIN) + 32, len(saved) - 1):
        with pytest.raises(ValueError, match=r"^not a saved world: "):
            fresh().load(saved[:size])


def test_a_missing_key_is_named(saved):
    content = content_of(saved)
    del robot_of(content)["board"]["cpu"]["chip"]["uart"]["rx_period"]
    assert refusal(content) == "not a saved world: KeyError('rx_period')"


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        ((), "pc", 0x10000),
        ((), "sp", 256),
        ((), "bank", 0x20),
        ((), "iram", bytes(255)),
        ((), "cycles", 1 << 60),
        (("chip", "ports"), "pending", [[1 << 30, 4, 0]]),
        (("chip", "ports"), "latches", [255, 255, 255]),
        (("chip", "interrupts"), "since", [0] * 5),
        (("chip", "timers"), "tl", []),
        (("chip", "uart"), "rx_period", 0),
        (("chip", "uart"), "tx_left", 12),
        (("chip", "shift"), "number", 9),
    ],
)
def test_what_compiled_code_takes_for_an_index_or_a_divisor_is_checked(saved, part, name, value):
    content = content_of(saved)
    state = robot_of(content)["board"]["cpu"]
    for key in part:
        state = state[key]
    assert name in state
    state[name] = value
    refusal(content)


def test_characters_beyond_the_decoders_places_are_refused(saved):
    content = content_of(saved)
    telemetry = content["state"]["networks"][0]["telemetry"]
    telemetry["_data"], telemetry["_flaws"] = bytes(200_000), bytes(200_000)
    telemetry["_ticks"] = [0] * 200_000
    assert "200000 values for the characters kept" in refusal(content)


def test_worlds_with_bytes_changed_are_all_refused():
    assert changed_bytes(500, 1, lambda number: None) == {"refused": 500}


def test_worlds_with_values_changed_are_refused_or_run():
    found = changed_values(150, 1, lambda number: None)
    assert set(found) == {"refused", "ran"}
    assert found["refused"] > 75
