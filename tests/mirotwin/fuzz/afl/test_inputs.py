"""Seeds and dictionaries."""

import ast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from miro_protocol.decoder import Decoder
from miro_protocol.events import Received
from miro_protocol.frames import ServiceFrame, TeamFrame, decode_fields
from miro_protocol.table import ROBOT_COUNTS, SYNC, downlink
from mirotwin.fuzz.afl.inputs import LONGEST_TOKEN, message_tokens, wire_tokens, write_dictionary, write_seeds
from mirotwin.fuzz.afl.settings import LONGEST_BYTES


def read_back(path):
    """The strings of a dictionary, by Python's reader of byte strings."""
    lines = path.read_text(encoding="ascii").splitlines()
    return [ast.literal_eval("b" + line.split("=", 1)[1]) for line in lines]


@given(st.lists(st.binary(min_size=1, max_size=LONGEST_TOKEN)))
def test_each_string_of_a_dictionary_is_written_once(tmp_path_factory, tokens):
    path = tmp_path_factory.mktemp("dictionary") / "words"
    write_dictionary(path, {f'name "{number}"\n': token for number, token in enumerate(tokens)})
    assert sorted(read_back(path)) == sorted(set(tokens))


@pytest.mark.parametrize("token", [b"", bytes(129)])
def test_a_string_that_afl_would_refuse_is_refused(tmp_path, token):
    with pytest.raises(BadInput, match=f"words: long one: {len(token)} bytes; give 1 to 128"):
        write_dictionary(tmp_path / "words", {"long one": token})


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
def test_the_strings_of_the_wire_hold_sync_preamble_and_whole_frames(robots):
    tokens = wire_tokens(robots)
    assert tokens["sync"] == SYNC
    assert tokens["preamble"] == downlink(robots).lead
    frames = [token for token in tokens.values() if len(token) == downlink(robots).wire_size]
    received = [event for frame in frames for event in Decoder(robots).feed(frame)]
    messages = [decode_fields(event.body, robots) for event in received if isinstance(event, Received)]
    assert sum(isinstance(message, TeamFrame) for message in messages) == 2
    assert sum(isinstance(message, ServiceFrame) for message in messages) == 3


@pytest.mark.parametrize("robots", ROBOT_COUNTS)
def test_all_our_strings_fit_a_dictionary(tmp_path, robots):
    write_dictionary(tmp_path / "words", wire_tokens(robots) | message_tokens(robots))
    assert len(read_back(tmp_path / "words")) > 20


def test_seeds_are_written_once_each_without_empty_ones_and_cut(tmp_path):
    long = bytes(range(256)) * 17
    inputs = {"first": b"x", "empty": b"", "../second": b"x", "../long": long}
    assert write_seeds(tmp_path / "seeds", inputs) == 2
    assert {path.name: path.read_bytes() for path in (tmp_path / "seeds").iterdir()} == {
        "0000-first": b"x",
        "0001-___long": long[:LONGEST_BYTES],
    }
