"""The codec: what is sent comes back, what may not be sent is refused by name, sizes are as calculated by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol import frames, table
from miro_protocol.frames import ContentError, EncodeError, ServiceFrame, TeamFrame, TelemetryFrame, encode
from miro_protocol.hypothesis_frames import host_frames, robot_counts, telemetry_frames
from miro_protocol.whitening import whiten

STOPPED = ((0, 0),) * 3


def body_of(wire):
    return whiten(wire[wire.index(b"\x2d\xd4") + 2 :])[:-2]


@given(st.data(), robot_counts())
def test_every_message_comes_back_as_it_was_sent(data, n):
    message = data.draw(st.one_of(host_frames(n), telemetry_frames(n)))
    assert frames.decode_fields(body_of(encode(message, n)), n) == message


@pytest.mark.slow
@given(st.data(), robot_counts())
def test_all_host_frames_of_a_network_have_the_same_length(data, n):
    assert len(encode(data.draw(host_frames(n)), n)) == {3: 23, 5: 31}[n]


def test_frames_last_as_long_on_the_air_as_calculated_by_hand():
    air_ms = {name: form.air_ticks / table.TICKS_PER_MS for name, form in table.DOWNLINK.items()}
    assert air_ms[3] == pytest.approx(24.0, abs=0.05)
    assert air_ms[5] == pytest.approx(32.3, abs=0.05)
    assert table.TELEMETRY.wire_size == 19
    assert table.TELEMETRY.air_ticks / table.TICKS_PER_MS == pytest.approx(19.8, abs=0.05)


def test_the_longest_frame_with_key_up_fits_one_camera_frame():
    assert table.DOWNLINK[5].air_ticks + table.KEYUP_TICKS < 800_800


def test_a_frame_written_out_by_hand():
    wire = encode(TeamFrame(0, 3, ((1, -2), (300, -300), (32767, -32767))), 3)
    assert wire[:8] == bytes.fromhex("55 55 55 55 55 ff 2d d4")
    assert body_of(wire) == bytes.fromhex("03  01 00 fe ff  2c 01 d4 fe  ff 7f 01 80")


def test_a_service_payload_is_slot_opcode_data_and_zeros():
    wire = encode(ServiceFrame.filter(9, 2, 0x1234, 5, 6, 7), 3)
    assert body_of(wire) == bytes.fromhex("49  02 01  34 12  05 00  06 00  07 00  00 00")


def test_a_telemetry_payload_carries_slot_and_flags_in_its_first_byte():
    frame = TelemetryFrame(
        1, 2, int(table.Flags.STOPPED | table.Flags.MOTORS_OFF), 3, 4, 0x1234, 0x5678, 9, 10
    )
    assert body_of(encode(frame, 3)) == bytes.fromhex("81  1a 03 04  34 12  78 56  09 0a")


REFUSED = [
    (TeamFrame(0, 0, ((0, 0), (-32768, 0), (0, 0))), 3, r"slot 1 left = -32768: must be -32767\.\.32767"),
    (TeamFrame(0, 0, ((0, 0), (0, 0), (0, 32768))), 3, r"slot 2 right = 32768: must be -32767\.\.32767"),
    (TeamFrame(0, 64, STOPPED), 3, r"seq = 64: must be 0\.\.63"),
    (TeamFrame(0, -1, STOPPED), 3, r"seq = -1: must be 0\.\.63"),
    (TeamFrame(1, 0, STOPPED), 3, r"type = 1: a team frame has type 0 or 3"),
    (TeamFrame(0, 0, STOPPED), 5, r"velocities = .*: must be 5 pairs of \(left, right\), one a robot"),
    (TeamFrame(0, 0, STOPPED), 4, r"n = 4: a network has 3 or 5"),
    (TelemetryFrame(0, 0), 11, r"n = 11: a network has 3 or 5"),
    (ServiceFrame.ping(0, 3), 3, r"slot = 3: must be 0\.\.2"),
    (ServiceFrame(0, 0, 3), 3, r"opcode = 3: must be 0\.\.2"),
    (ServiceFrame.filter(0, 0, 0x8000, 0, 0, 0), 3, r"kp = 32768: must be 0\.\.32767"),
    (ServiceFrame.acceleration(0, 0, 0), 3, r"acceleration = 0: must be 1\.\.1073741823"),
    (ServiceFrame(0, 0, 0, (1,)), 3, r"ping values = \(1,\): must be 0 numbers"),
    (TelemetryFrame(0, 5), 5, r"slot = 5: must be 0\.\.4"),
    (TelemetryFrame(0, 0, flags=0x40), 3, r"flags = 0x40: only bits of 0x38"),
    (TelemetryFrame(0, 0, position_left=65536), 3, r"position_left = 65536: must be 0\.\.65535"),
]


@pytest.mark.parametrize(("message", "n", "complaint"), REFUSED)
def test_what_may_not_be_sent_is_refused_by_field_value_and_limits(message, n, complaint):
    with pytest.raises(EncodeError, match=complaint):
        encode(message, n)


MISSHAPEN = [
    (None, 3, "message = None: must be a TeamFrame, ServiceFrame or TelemetryFrame"),
    (b"\x55", 3, r"message = b'U': must be a TeamFrame"),
    (TeamFrame(0, 0, STOPPED), None, "n = None: a network has 3 or 5"),
    (TeamFrame(0, 0, STOPPED), 3.0, r"n = 3\.0: a network has 3 or 5"),
    (TeamFrame(0, True, STOPPED), 3, r"seq = True: must be a whole number 0\.\.63"),
    (TeamFrame(0, None, STOPPED), 3, r"seq = None: must be a whole number 0\.\.63"),
    (TeamFrame(0, 10**5000, STOPPED), 3, r"seq = an int of 16610 bits: must be 0\.\.63"),
    (TeamFrame(False, 0, STOPPED), 3, "type = False: must be a whole number 0 or 3"),
    (TeamFrame(np.array([0]), 0, STOPPED), 3, "type = array.*: must be a whole number 0 or 3"),
    (TeamFrame(0.0, 0, STOPPED), 3, r"type = 0\.0: must be a whole number 0 or 3"),
    (TeamFrame(0, 0, None), 3, r"velocities = None: must be 3 pairs of \(left, right\)"),
    (TeamFrame(0, 0, 7), 3, "velocities = 7: must be 3 pairs"),
    (TeamFrame(0, 0, {0: (0, 0), 1: (0, 0), 2: (0, 0)}), 3, r"velocities = \{.*\}: must be 3 pairs"),
    (TeamFrame(0, 0, (pair for pair in STOPPED)), 3, "velocities = <.*>: must be 3 pairs"),
    (TeamFrame(0, 0, ((0, 0), (1, 2, 3), (0, 0))), 3, r"slot 1 = \(1, 2, 3\): must be 2 numbers"),
    (TeamFrame(0, 0, ((0, 0), (1,), (0, 0))), 3, r"slot 1 = \(1,\): must be 2 numbers"),
    (TeamFrame(0, 0, (None, (0, 0), (0, 0))), 3, r"slot 0 = None: must be 2 numbers \(left, right\)"),
    (TeamFrame(0, 0, ((0, 0), (0, 0), {1, 2})), 3, r"slot 2 = \{1, 2\}: must be 2 numbers"),
    (
        TeamFrame(0, 0, ((0.5, 0), (0, 0), (0, 0))),
        3,
        r"slot 0 left = 0\.5: must be a whole number -32767\.\.",
    ),
    (TeamFrame(0, 0, ((0, 0), "ab", (0, 0))), 3, "slot 1 left = 'a': must be a whole number"),
    (ServiceFrame.ping(0, None), 3, r"slot = None: must be a whole number 0\.\.2"),
    (ServiceFrame(0, 0, "1"), 3, r"opcode = '1': must be a whole number 0\.\.2"),
    (ServiceFrame(0, 0, 0, None), 3, "ping values = None: must be 0 numbers"),
    (ServiceFrame(0, 0, 1, (1, 2)), 3, r"filter values = \(1, 2\): must be 4 numbers \(kp, ki, kd, il\)"),
    (TelemetryFrame(0, 0, flags=None), 3, "flags = None: must be a whole number"),
    (TelemetryFrame(0, 0, flags=False), 3, "flags = False: must be a whole number"),
    (TelemetryFrame(0, 0, flags=-8), 3, "flags = -0x8: only bits of 0x38"),
    (TelemetryFrame(0, 0, accepted="9"), 3, r"accepted = '9': must be a whole number 0\.\.255"),
]


@pytest.mark.parametrize(("message", "n", "complaint"), MISSHAPEN)
def test_what_has_the_wrong_shape_is_refused_by_field_value_and_what_is_allowed(message, n, complaint):
    with pytest.raises(EncodeError, match=complaint):
        encode(message, n)


_anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3) | st.binary(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=4) | st.tuples(inner, inner) | st.dictionaries(st.integers(), inner)
    ),
    max_leaves=8,
)


@pytest.mark.slow
@given(
    st.builds(TeamFrame, _anything, _anything, _anything | st.tuples(_anything, _anything, _anything))
    | st.builds(ServiceFrame, _anything, _anything, st.integers(0, 2) | _anything, _anything)
    | st.builds(TelemetryFrame, *[_anything] * 9)
    | _anything,
    st.sampled_from([3, 5]) | _anything,
)
def test_whatever_a_caller_puts_in_is_encoded_or_refused_as_an_encode_error(message, n):
    try:
        wire = encode(message, n)
    except EncodeError:
        return
    assert isinstance(wire, bytes)


@pytest.mark.parametrize("rows", [list, tuple, np.array])
def test_velocities_may_be_any_rows_of_whole_numbers(rows):
    velocities = ((1, -2), (300, -300), (32767, -32767))
    wire = encode(TeamFrame(0, 3, velocities), 3)
    assert encode(TeamFrame(0, 3, rows([rows(pair) for pair in velocities])), 3) == wire


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ("", "the body is empty"),
        ("00" + "0080" + "00" * 10, "left = -32768"),
        ("40" + "0003" + "00" * 10, "opcode 3"),
        ("40" + "0300" + "00" * 10, "slot = 3"),
        ("40" + "0000" + "00" * 9 + "01", "does not account for all"),
        ("80" + "00" * 12, "does not account for all"),
    ],
)
def test_a_body_that_no_rightful_host_sends_is_a_content_error(body, complaint):
    with pytest.raises(ContentError, match=complaint):
        frames.decode_fields(bytes.fromhex(body), 3)


@given(robot_counts(), st.data())
def test_any_body_at_all_is_a_message_or_a_content_error(n, data):
    size = table.DOWNLINK[n].body_size
    body = data.draw(st.binary(min_size=size, max_size=size) | st.binary(max_size=size + 2))
    try:
        message = frames.decode_fields(body, n)
    except ContentError:
        return
    assert body_of(encode(message, n)) == body


@pytest.mark.parametrize(
    ("message", "line"),
    [
        (TeamFrame(0, 3, STOPPED), "team seq=3"),
        (TeamFrame(3, 63, STOPPED), "team_ask seq=63"),
        (ServiceFrame.ping(1, 2), "ping seq=1 slot=2"),
        (ServiceFrame.filter(1, 0, 4, 5, 6, 7), "filter seq=1 slot=0 kp=4 ki=5 kd=6 il=7"),
        (ServiceFrame.acceleration(2, 1, 5973), "acceleration seq=2 slot=1 acceleration=5973"),
        (TelemetryFrame(9, 1, 0x18, accepted=4), "telemetry seq=9 slot=1 flags=18h accepted=4 rejected=0"),
    ],
)
def test_a_message_is_described_in_one_line(message, line):
    assert frames.describe(message) == line
