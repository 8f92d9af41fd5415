"""Frames lost against Eb/N0, beside the formula: `python -m benchmarks.frame_loss [--picture FILE.png]`.

Every frame goes over the simulation's own radio: keyed carrier, slicer noise in between, non-coherent FSK. Three
receivers listen:

decoder   a UART that samples the middle of each bit, and the decoder of `miro_protocol`
firmware  the robot: its chip's UART, bit by bit, and its C; fewer frames, because it is slower
slicer    as decoder, behind a slicer of 4 ms with carriers half a deviation apart (profile `slicer`)

A frame counts as lost unless it comes out valid and as it was sent (firmware: valid). Bars are 95 % intervals
(Wilson). The formula: the F characters from sync to CRC must be right to the last of their 10 F bits, and so must
the stop bit before them, whose fall into the first start bit the UART waits for.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from math import exp
from pathlib import Path
from typing import NamedTuple

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_exact.rng import Stream
from miro_protocol.decoder import Decoder, Received
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.table import BITS_PER_CHARACTER, DOWNLINK
from miro_robot.board import Board
from miro_robot.firmware import image_path
from miro_robot.image import load_hex
from miro_robot.mcs51.line import Line
from miro_robot.plant import IdealWheels
from miro_robot.wiring import load_wiring
from miro_sim.radio.downlink import Downlink
from miro_sim.radio.params import Radio, SlicerParams
from miro_sim.radio.uplink import Uplink
from mirotwin.campaign.chances import wilson

LEVELS_DB = (7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0)
FIRST_TICK = 240_000  # after the firmware's start
AHEAD_TICKS = 25_000  # the next frame's carrier comes up 24 000 ticks before it
MARGIN_TICKS = 120  # an instruction may overrun
DECODING_TICKS = 240_000
COUNTERS = ("_frames_accepted", "_frames_stale")
COLOURS = {3: "tab:blue", 5: "tab:orange"}
MARKERS = (("decoder", "o", 0.0), ("firmware", "x", 0.06), ("slicer", "^", 0.0))  # name, sign, dB to the side


class Point(NamedTuple):
    """What was measured: `sent` frames at `eb_n0_db`, `lost` of them not received, and `wrong` ones taken."""

    robots: int
    receiver: str
    eb_n0_db: float
    sent: int
    lost: int
    wrong: int = 0

    @property
    def share(self) -> float:
        return self.lost / self.sent


def critical_bits(robots: int) -> int:
    """Bits of a frame that must be right: sync to CRC, and the stop bit before."""
    return BITS_PER_CHARACTER * DOWNLINK[robots].size + 1


def formula(robots: int, eb_n0_db: float) -> float:
    """Chance that one of them is wrong."""
    rate = 0.5 * exp(-0.5 * 10 ** (eb_n0_db / 10))
    return 1 - (1 - rate) ** critical_bits(robots)


def frame(robots: int, number: int, draws: Stream) -> bytes:
    """Team frame with random velocities."""
    first = 2 * robots * number
    values = [draws.u32(first + place) % 65_535 - 32_767 for place in range(2 * robots)]
    return encode(TeamFrame(0, number % 64, tuple(zip(values[::2], values[1::2], strict=True))), robots)


def decoder(robots: int, eb_n0_db: float, frames: int, seed: int) -> Point:
    """The decoder in Python, behind a UART with the PC's bit time."""
    params = Radio(eb_n0_db=eb_n0_db)
    return Point(robots, "decoder", eb_n0_db, frames, *received(robots, params, frames, seed, eb_n0_db))


def slicer(robots: int, eb_n0_db: float, frames: int, seed: int) -> Point:
    """The same with the threshold of an AC-coupled slicer."""
    part = SlicerParams(settle_s=0.004, offset=-0.5)
    params = Radio(eb_n0_db=eb_n0_db, slicer=part)
    return Point(robots, "slicer", eb_n0_db, frames, *received(robots, params, frames, seed, eb_n0_db))


def received(robots: int, params: Radio, frames: int, seed: int, eb_n0_db: float) -> tuple[int, int]:
    """How many of so many frames do not come out of the decoder as they were sent; how many come out wrong."""
    line, draws = Line(), Stream(seed, "velocities")
    downlink = Downlink(params, seed, f"decoder{robots}/{eb_n0_db}")
    uart = Uplink(Radio(bit_error_rate=0.0), seed, "uart")
    downlink.listen(0, line)
    uart.band.add(0, line)
    scanner = Decoder(robots)
    size = DOWNLINK[robots].size
    right = wrong = 0
    for number in range(frames):
        start = FIRST_TICK + number * CONTROL_PERIOD_TICKS
        data = frame(robots, number, draws)
        downlink.send(start, data)
        downlink.settle(start + CONTROL_PERIOD_TICKS - AHEAD_TICKS)
        for event in scanner.feed_symbols(uart.receive(start + CONTROL_PERIOD_TICKS - AHEAD_TICKS)):
            if isinstance(event, Received):
                good = event.data[-size:] == data[-size:]
                right += good
                wrong += not good
    return frames - right, wrong


def firmware(robots: int, eb_n0_db: float, frames: int, seed: int) -> Point:
    """The robot, motors off their feet; a valid frame is one that it counts as fresh or as stale."""
    image = load_hex(image_path())
    board = Board(load_wiring(), IdealWheels(), 0, robots, None, True)
    board.cpu.load(image.code, image.used)
    addresses = [symbol.address for name in COUNTERS if (symbol := image.symbols.find(name))]
    draws = Stream(seed, "velocities")
    downlink = Downlink(Radio(eb_n0_db=eb_n0_db), seed, f"firmware{robots}/{eb_n0_db}")
    downlink.listen(0, board.cpu.rxd)
    for number in range(frames):
        start = FIRST_TICK + number * CONTROL_PERIOD_TICKS
        downlink.send(start, frame(robots, number, draws))
        downlink.settle(start + CONTROL_PERIOD_TICKS - AHEAD_TICKS + MARGIN_TICKS)
        board.run(start + CONTROL_PERIOD_TICKS - AHEAD_TICKS)
    end = downlink.settled_tick + DECODING_TICKS
    downlink.settle(end)
    board.run(end - MARGIN_TICKS)
    valid = sum(board.cpu.peek_iram(at) | board.cpu.peek_iram(at + 1) << 8 for at in addresses)
    return Point(robots, "firmware", eb_n0_db, frames, frames - valid)


def row(point: Point) -> str:
    low, high = wilson(point.lost, point.sent)
    expected = formula(point.robots, point.eb_n0_db)
    deviations = (point.lost - point.sent * expected) / (point.sent * expected * (1 - expected)) ** 0.5
    return (
        f"N={point.robots} {point.receiver:8} {point.eb_n0_db:4.1f} dB: lost {point.lost} of {point.sent},"
        f" {point.share:.5f} ({low:.5f}..{high:.5f}), formula {expected:.5f}, {deviations:+.1f} deviations"
        + (f", {point.wrong} taken wrong" if point.wrong else "")
    )


def draw(points: Sequence[Point], path: Path) -> None:
    """The picture: no date and no version inside, so that the same figures give the same file."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7.2, 4.6), dpi=100)
    levels = [LEVELS_DB[0] + step / 20 for step in range(int((LEVELS_DB[-1] - LEVELS_DB[0]) * 20) + 1)]
    for robots, colour in COLOURS.items():
        bits = critical_bits(robots)
        label = f"N = {robots}: 1 - (1 - p)$^{{{bits}}}$"
        axes.plot(levels, [formula(robots, level) for level in levels], color=colour, lw=1, label=label)
        for receiver, marker, shift in MARKERS:
            found = [one for one in points if (one.robots, one.receiver) == (robots, receiver) and one.lost]
            if found:
                spans = [wilson(one.lost, one.sent) for one in found]
                below = [max(one.share - low, 0.0) for one, (low, _) in zip(found, spans, strict=True)]
                above = [max(high - one.share, 0.0) for one, (_, high) in zip(found, spans, strict=True)]
                axes.errorbar(
                    [one.eb_n0_db + shift for one in found],
                    [one.share for one in found],
                    yerr=[below, above],
                    fmt=marker,
                    color=colour,
                    ms=5,
                    capsize=2,
                    lw=1,
                    label=f"N = {robots}: {receiver}",
                )
    axes.set_yscale("log")
    axes.set_ylim(1e-4, 1.2)
    axes.set_xlabel("Eb/N0 in dB")
    axes.set_ylabel("share of frames lost")
    axes.set_title("Frames lost on a 9600-baud FSK link, keyed carrier; p = 0.5 exp(-Eb/2N0)", fontsize=10)
    axes.grid(True, which="both", lw=0.3)
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, metadata={"Software": None})


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=50_000, help="for the decoder, a point [%(default)s]")
    parser.add_argument("--robot-frames", type=int, default=5000, help="for the firmware [%(default)s]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--picture", type=Path, help="where to write the picture (PNG); none, if not given")
    options = parser.parse_args()
    points = []
    begin = time.perf_counter()
    for robots in DOWNLINK:
        for measure, frames in (
            (decoder, options.frames),
            (firmware, options.robot_frames),
            (slicer, options.frames),
        ):
            for level in LEVELS_DB:
                points.append(measure(robots, level, frames, options.seed))
                print(row(points[-1]), flush=True)
    print(f"{time.perf_counter() - begin:.0f} s, seed {options.seed}", file=sys.stderr)
    if options.picture:
        draw(points, options.picture)


if __name__ == "__main__":
    main()
