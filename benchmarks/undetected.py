"""Counts the wrong frames that are taken for right ones: `python -m benchmarks.undetected`.

Four experiments; the figures of protocol/README.md and `undetected.csv` come from them:

crc     bit errors in HDR..CRC, beside what weight enumeration says
line    bit errors anywhere on the line, slicer noise around the frame; with and without the spacing rule
bursts  every burst of up to 16 wire bits that begins in HDR..CRC
noise   an hour of slicer noise and no frame at all
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.interval import clopper_pearson
from benchmarks.line import Verdict, compare, decode_lines, flip, line_bits, random_frames, receive, rows
from benchmarks.weights import undetected_probability
from miro_protocol.decoder import Received, Scanner
from miro_protocol.table import BITS_PER_CHARACTER, DOWNLINK, HOST_BIT_TICKS, TELEMETRY, Format

RATES = (1e-2, 1e-3, 1e-4)
BATCH = 1 << 16
NOISE_BITS = 30  # of the slicer, before the carrier comes
KEYUP_BITS = 10
TAIL_BITS = 20
BURST = 16


def crc_only(form: Format, rate: float, count: int, rng: np.random.Generator) -> Verdict:
    """Contiguous frames whose HDR..CRC have bit errors."""
    frames = random_frames(rng, form, count)
    errors = np.zeros((count, form.body_size + 2, 8), np.uint8)
    flip(rng, errors, rate)
    wire = frames.wire
    wire[:, -errors.shape[1] :] ^= np.packbits(errors, axis=2, bitorder="little")[:, :, 0]
    events = Scanner(form).feed(wire.tobytes(), 0)
    step = form.air_ticks
    return compare(((one.last_tick // step, one) for one in events if type(one) is Received), frames.body)


def on_the_line(form: Format, rate: float, count: int, rng: np.random.Generator) -> tuple[Verdict, Verdict]:
    """One frame a line, in noise: verdicts with and without the rules about stop bits and spacing."""
    frames = random_frames(rng, form, count)
    bits = np.concatenate(
        [
            rng.integers(0, 2, (NOISE_BITS, count), np.uint8),
            np.ones((KEYUP_BITS, count), np.uint8),
            line_bits(frames.wire),
            rng.integers(0, 2, (TAIL_BITS, count), np.uint8),
        ]
    )
    flip(rng, bits[NOISE_BITS:-TAIL_BITS], rate)
    symbols = receive(bits)
    strict = decode_lines(form, symbols, len(bits), frames.body)
    return strict, decode_lines(form, symbols, len(bits), frames.body, strict=False)


def bursts(form: Format, rng: np.random.Generator) -> Iterator[Verdict]:
    """For each wire bit of HDR..CRC: all bursts of up to 16 bits that begin there, one a line."""
    patterns = np.unpackbits(
        np.arange(1, 1 << BURST, 2, dtype="<u2").view(np.uint8).reshape(-1, 2), axis=1, bitorder="little"
    ).T
    first = BITS_PER_CHARACTER * (form.wire_size - form.body_size - 2)
    idle = np.ones((KEYUP_BITS, patterns.shape[1]), np.uint8)
    for start in range(first, BITS_PER_CHARACTER * form.wire_size):
        frames = random_frames(rng, form, patterns.shape[1])
        bits = np.concatenate([idle, line_bits(frames.wire), idle, idle])
        bits[KEYUP_BITS + start : KEYUP_BITS + start + BURST] ^= patterns
        yield decode_lines(form, receive(bits), len(bits), frames.body)


def noise(form: Format, seconds: int, rng: np.random.Generator) -> tuple[int, int]:
    """Characters heard and frames taken in so much noise, on 4096 lines at once."""
    lines = 4096
    length = seconds * 24_000_000 // HOST_BIT_TICKS // lines
    symbols = receive(rng.integers(0, 2, (length, lines), np.uint8))
    ticks = (symbols.line * (length + 100) + symbols.place) * HOST_BIT_TICKS
    scanner = Scanner(form)
    scanner.feed_symbols(rows(symbols.data, symbols.bad_stop, ticks))
    return len(symbols.data), scanner.valid


def batches(count: int) -> Iterator[int]:
    for start in range(0, count, BATCH):
        yield min(BATCH, count - start)


def total(verdicts: Iterator[Verdict]) -> Verdict:
    found = list(verdicts)
    return Verdict(sum(one.right for one in found), sum(one.wrong for one in found))


def with_interval(wrong: int, count: int) -> str:
    low, high = clopper_pearson(wrong, count)
    return f"{wrong} wrong of {count}, 95 % interval {low:.1e}..{high:.1e}"


def show_crc(count: int, rng: np.random.Generator) -> None:
    for form in (*DOWNLINK.values(), TELEMETRY):
        for rate in RATES:
            verdict = total(crc_only(form, rate, size, rng) for size in batches(count))
            expected = undetected_probability(form, rate)
            text = with_interval(verdict.wrong, count)
            print(f"crc    {form.name:18} {rate:.0e}: {text}, calculated {expected:.1e}", flush=True)


def show_line(count: int, rng: np.random.Generator) -> None:
    for form in DOWNLINK.values():
        for rate in RATES:
            found = [on_the_line(form, rate, size, rng) for size in batches(count)]
            lost = 1 - sum(strict.right for strict, _ in found) / count
            clean = (1 - rate) ** (BITS_PER_CHARACTER * form.size)
            print(f"line   {form.name:18} {rate:.0e}: lost {lost:.4%}, sync..CRC hit {1 - clean:.4%}")
            for kind, verdicts in zip(("all rules", "CRC alone"), zip(*found, strict=True), strict=True):
                wrong = sum(one.wrong for one in verdicts)
                print(f"       {kind}: {with_interval(wrong, count)}", flush=True)


def show_bursts(_: int, rng: np.random.Generator) -> None:
    for form in (*DOWNLINK.values(), TELEMETRY):
        verdict = total(bursts(form, rng))
        starts = BITS_PER_CHARACTER * (form.body_size + 2)
        tried = starts << BURST - 1
        print(f"bursts {form.name:18} {tried} tried: {verdict.wrong} wrong, {verdict.right} taken as sent")


def show_noise(_: int, rng: np.random.Generator) -> None:
    for form in DOWNLINK.values():
        heard, taken = noise(form, 3600, rng)
        print(f"noise  {form.name:18} 3600 s: {heard} characters heard, {taken} frames taken", flush=True)


EXPERIMENTS = {"crc": show_crc, "line": show_line, "bursts": show_bursts, "noise": show_noise}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("experiment", nargs="*", choices=[*EXPERIMENTS, []], help="all, if none is named")
    parser.add_argument("--frames", type=int, default=10_000_000, help="for crc and line, each [%(default)s]")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for name in options.experiment or EXPERIMENTS:
        rng = np.random.Generator(np.random.Philox(options.seed))
        begin = time.perf_counter()
        EXPERIMENTS[name](options.frames, rng)
        print(f"{name}: {time.perf_counter() - begin:.0f} s, seed {options.seed}", flush=True)


if __name__ == "__main__":
    main()
