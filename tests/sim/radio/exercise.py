"""Busy networks, run for half a second, as a digest of everything heard: the same for both engines."""

import hashlib

from miro_exact.rng import Stream
from miro_exact.state import snapshot
from miro_robot.mcs51.line import Line
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import Bursts, Dropouts, SlicerParams
from miro_sim.radio.uplink import Uplink
from tests.naive.radio import wire_bits
from tests.sim.radio.radios import clean

ROBOTS = 3
PERIOD = 800_800


PLAIN = clean(latency_s=0.0001, bit_error_rate=1e-2)
EVERYTHING = clean(
    latency_s=0.0001,
    jitter_s=0.001,
    eb_n0_db=9.0,
    baud_offset_ppm=777,
    crystal_offset_ppm=-51,
    bursts=Bursts(good_to_bad=1e-3, bad_to_good=1e-2),
    dropouts=Dropouts(every_s=0.3, length_s=0.02),
    slicer=SlicerParams(settle_s=0.004, offset=-0.5),
    false_starts_hz=100.0,
    lost_character_rate=0.02,
    lost_frames=0.1,
)


def exercise(seed, radio):
    """Everything that three robots and their PC hear, with a neighbour on the frequency."""
    down, up = Downlink(radio, seed, "down"), Uplink(radio, seed, "up")
    neighbour = Downlink(EVERYTHING, seed, "neighbour")
    if radio is not PLAIN:
        down.overhear(neighbour)
    rxd, txd = [Line() for _ in range(ROBOTS)], [Line() for _ in range(ROBOTS)]
    for robot in range(ROBOTS):
        down.listen(robot, rxd[robot])
        up.listen(txd[robot])
    payload = Stream(seed, "payload")
    heard = hashlib.sha256()
    for period in range(15):
        begin = period * PERIOD
        data = bytes(payload.u32(period * 23 + i) & 255 for i in range(23))
        bad_stop = tuple(i for i in range(23) if period % 2 and data[i] % 4 == 0)
        down.send(begin + 96_000, data, bad_stop)
        neighbour.send(begin + 350_000, data[::-1], bad_stop)
        for i, level in enumerate(wire_bits(data[:19])):
            txd[period % ROBOTS].append(begin + 1000 + 2496 * i, level)
        for until in (begin + 123_456, begin + PERIOD):
            down.settle(until)
            for line in txd:
                line.settled_tick = until
            heard.update(repr(up.receive(until)).encode())
        for line in rxd:
            heard.update(repr(line.edges()).encode())
            line.forget(begin + PERIOD)
        heard.update(repr([snapshot(down), snapshot(up)]).encode())
    return heard.hexdigest()
