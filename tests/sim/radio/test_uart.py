"""Disturbances on the wire, as a UART that stores what it receives and the robot's firmware take them."""

import pytest

from miro_exact.rng import Stream
from miro_protocol.frames import TeamFrame, encode
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import Dropouts
from tests.robot.firmware.rig import BOOTED, MS, Rig
from tests.robot.mcs51.rig import cpu_with
from tests.robot.mcs51.test_uart import RECEIVER, TIMER2_9600
from tests.sim.radio.radios import ALWAYS, clean

SLOW = """
loop:
JNB RI,loop
MOV R7,#{tens}
wait:
MOV R6,#250
DJNZ R6,$
DJNZ R7,wait
MOV @R0,SBUF
INC R0
CLR RI
SJMP loop
"""


def receiver():
    """Stores pairs (SBUF, RB8) from 30h on."""
    return cpu_with("MOV R0,#30h\n" + TIMER2_9600 + RECEIVER.format(scon="50h"))


def slow_receiver(tens):
    """Stores SBUF from 30h on, about tens * 500 machine cycles (a character has 2080) after RI."""
    return cpu_with("MOV R0,#30h\n" + TIMER2_9600 + "MOV SCON,#50h\n" + SLOW.format(tens=tens))


def hears(cpu, radio, seed, sent, until):
    """The CPU after listening to these transmissions up to a tick; stream names begin with net/robot0."""
    downlink = Downlink(radio, seed, "net")
    downlink.listen(0, cpu.rxd)
    for one in sent:
        downlink.send(*one)
    downlink.settle(until + MS)
    cpu.run(until // 12)
    return cpu


def stored(cpu):
    """What the receiver has put into its memory."""
    return bytes(cpu.peek_iram(place) for place in range(0x30, cpu.peek_iram(0)))


def seed_where(radio, start, bits, wanted):
    """The first seed whose errors in a transmission of so many bits from tick `start` on are as wanted."""
    for seed in range(1_000_000):
        errors = Stream(seed, "net/robot0/errors")
        first = start // 2500
        if wanted([bit for bit in range(bits) if errors.below(first + bit, radio.error_threshold)]):
            return seed
    raise AssertionError("no seed among a million")


class RadioRig(Rig):
    """A robot whose RXD hangs on a downlink, `self.downlink`; send there, then `run_to`."""

    def __init__(self, radio, seed=0, n=3):
        super().__init__(n=n, boot=False)
        self.downlink = Downlink(radio, seed, "net")
        self.downlink.listen(0, self.cpu.rxd)
        self.run_to(BOOTED)

    def run_to(self, tick):
        while self.now < tick:
            until = min(tick, self.now + 50 * MS)
            self.downlink.settle(until + 120)
            self.board.run(until)
            self.now = until
        assert self.board.faults == [], self.board.faults


START = 100_000
QUIET = clean(squelch=True)
NOISY = clean(bit_error_rate=0.01, squelch=True)
PERIOD = 800_800
LEAD = 6  # characters before the sync


def pairs(cpu):
    found = stored(cpu)
    return list(zip(found[::2], found[1::2], strict=True))


def hears_text(text, *errors, seed_of=NOISY):
    """(SBUF, RB8) of a transmission whose wrong bits are exactly these."""
    seed = seed_where(seed_of, START, 10 * len(text), lambda found: found == [*errors])
    return pairs(hears(receiver(), seed_of, seed, [(START, text)], START + 25_000 * (len(text) + 3)))


@pytest.mark.parametrize(
    ("wrong", "heard"),
    [
        (29, [(0x55, 1), (0x56, 1), (0x57, 0)]),
        (19, [(0x55, 1), (0x56, 0), (0xF5, 1)]),  # 57h begins 1 1 1 0: its fourth bit is the first fall
        (13, [(0x55, 1), (0x56 ^ 4, 1), (0x57, 1)]),
    ],
    ids=["stop bit shows in RB8", "stop bit hides the next start bit", "data bit"],
)
def test_a_wrong_bit_is_heard_where_it_is(wrong, heard):
    assert hears_text(b"UVW", wrong) == heard


def test_a_wrong_start_bit_slips_to_the_next_fall_and_the_characters_come_out_of_step():
    """Without its start bit A9h begins at its first space: 0101 and its stop bit are taken for another byte."""
    heard = hears_text(b"\xa9\xa9\xff\x55", 0)
    assert heard[0][0] not in (0xA9, 0x55)
    assert heard[-1] == (0x55, 1)  # FFh has brought it into step again


def test_a_false_start_bit_on_an_idle_carrier_is_a_character_and_can_swallow_a_real_start():
    """A space of one bit time: the UART reads it as a start bit, and FFh out of the idle line behind."""
    always_idle = clean(carrier="on", false_starts_hz=800.0)
    heard = pairs(hears(receiver(), always_idle, 3, [], 30 * 25_000))
    assert len(heard) > 5
    assert all(good for _, good in heard[:1])
    quiet = clean(carrier="on")
    assert pairs(hears(receiver(), quiet, 3, [], 30 * 25_000)) == []
    text = b"\x55" * 10
    whole = pairs(hears(receiver(), quiet, 3, [(START, text)], 20 * 25_000))
    late = pairs(hears(receiver(), always_idle, 3, [(START, text)], 20 * 25_000))
    assert whole == [(0x55, 1)] * 10
    assert late != whole


def test_a_lost_character_leaves_a_gap_and_the_others_whole():
    losing = clean(lost_character_rate=0.3, squelch=True)
    heard = pairs(hears(receiver(), losing, 1, [(START, bytes(range(65, 85)))], 30 * 25_000))
    letters = [byte for byte, good in heard if good]
    assert len(letters) == len(heard) < 20
    assert letters == sorted(set(letters))
    assert set(letters) < set(range(65, 85))


@pytest.mark.parametrize(("tens", "whole"), [(1, True), (3, True), (6, False)])
def test_a_uart_that_is_not_read_in_time_loses_characters(tens, whole):
    """1500 cycles after RI are in time; after 3000 the next character has come, and RI still stands."""
    text = bytes(range(65, 85))
    heard = stored(hears(slow_receiver(tens), QUIET, 0, [(START, text)], 40 * 25_000))
    assert (heard == text) == whole
    assert set(heard) <= set(text)


@pytest.mark.parametrize(("baud", "whole"), [(0, True), (20_000, True), (-20_000, True), (50_000, False)])
def test_a_uart_follows_an_offset_of_two_percent_but_not_of_five(baud, whole):
    text = bytes([0x00, 0xFF, 0x55, 0x80, 0x01, 0x7F] * 3)
    radio = clean(baud_offset_ppm=baud, squelch=True)
    heard = pairs(hears(receiver(), radio, 0, [(START, text)], 25 * 25_000))
    assert (heard == [(byte, 1) for byte in text]) == whole


def frames(count, n=3):
    return [encode(TeamFrame(0, seq % 64, ((100 + seq, -100),) * n), n) for seq in range(count)]


def robot_after(radio, seed, count=1, n=3):
    """The counters of a robot that was sent so many frames, one a camera period, from 200 000 ticks on."""
    rig = RadioRig(radio, seed, n)
    for number, data in enumerate(frames(count, n)):
        start = 200_000 + number * PERIOD
        rig.downlink.send(start, data)
        rig.run_to(start + PERIOD - 100_000)
    return rig


@pytest.mark.parametrize(
    ("first", "last", "bits", "counters"),
    [
        (10 * LEAD, 230, [9], (0, 0, 0)),
        (80, 230, range(1, 9), (0, 1, 0)),
        (80, 230, [0], (0, 0, 0)),
        (0, 50, range(10), (1, 0, 0)),
    ],
    ids=["stop bit: no frame", "data bit: a bad CRC", "start bit: a slipped byte", "preamble: taken"],
)
def test_one_wrong_bit_of_a_frame_counts_as_what_it_is(first, last, bits, counters):
    seed = seed_where(
        NOISY,
        200_000,
        230,
        lambda found: len(found) == 1 and first <= found[0] < last and found[0] % 10 in bits,
    )
    rig = robot_after(NOISY, seed)
    assert rig.counters == counters
    assert rig.downlink.listeners[0].bit_errors == 1


def test_characters_sent_with_a_bad_stop_bit_are_received_with_it_and_the_next_ones_too():
    sent = [(START, b"UVWX", (1, 3))]
    heard = pairs(hears(receiver(), QUIET, 0, sent, START + 25_000 * 7))
    assert heard == [(0x55, 1), (0x56, 0), (0x57, 1), (0x58, 0)]


@pytest.mark.parametrize("place", [LEAD, 12, 22])
def test_a_frame_sent_with_a_bad_stop_bit_is_no_frame_and_the_next_one_is_taken(place):
    rig = RadioRig(QUIET, 0, 3)
    first, second = frames(2)
    rig.downlink.send(200_000, first, (place,))
    rig.downlink.send(200_000 + PERIOD, second)
    rig.run_to(200_000 + 2 * PERIOD)
    assert rig.counters == (1, 0, 0)


def test_lost_characters_cost_frames_and_the_numbers_step_over_them():
    rig = robot_after(clean(lost_character_rate=0.03, squelch=True), 2, 12)
    accepted, rejected, stale = rig.counters
    assert 2 < accepted < 12
    assert (rejected, stale) == (0, 0)
    assert rig.u8("_last_hdr") & 63 >= accepted


def test_a_robot_out_of_reach_for_a_while_comes_back_by_itself():
    """Dropped for good: nothing comes through, noise or not; never dropped: everything does."""
    gone = ALWAYS
    assert robot_after(clean(dropouts=gone), 4, 5).counters == (0, 0, 0)
    back = robot_after(clean(dropouts=Dropouts(every_s=0.15, length_s=0.05)), 4, 20)
    accepted, _, stale = back.counters
    assert 5 < accepted < 20
    assert stale == 0


def test_the_firmware_takes_frames_from_a_pc_whose_clock_is_one_percent_off():
    """The spacing rule allows 4.8 %."""
    for ppm in (10_000, -10_000):
        radio = clean(baud_offset_ppm=ppm, crystal_offset_ppm=-ppm // 100)
        assert robot_after(radio, 5, 6).counters == (6, 0, 0)
