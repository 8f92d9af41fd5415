"""From light to the grabber's bytes, a line at a time: brightness, gamma, composite video, noise, quantisation.

    sum of paints -> falloff, flicker, gain, offset -> gamma -> Y Cb Cr -> line jitter -> chroma low-pass
                  -> + noise of this pixel and frame -> quantised to `bits` -> Y, Cb, Cr bytes

Values between gamma and bytes have four fraction bits. Y Cb Cr: ITU-R BT.601, full range (JFIF). The low-pass is a
Gaussian whose gain at the bandwidth is -3 dB; the 320 pixels of a line take 52.66 us (the active line of NTSC).
Noise is added after it, white, one draw of 12 bits for each of Y, Cb, Cr: any pixel can be worked out alone.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import lru_cache

from miro_exact import rng
from miro_exact.dmath import exp, log, sincos
from miro_exact.rng import Stream
from miro_sim.pitch.picture_settings import PictureSettings

PIXELS_PER_SECOND = 320.0 / 52.66e-6
MOST_TAPS = 8
"""On either side of a pixel."""
_FULL = 4095
_BITS = 21
_MASK = (1 << 21) - 1
_FRAME_BLOCKS = 1 << 15
_LINE_BLOCKS = 107
_TICKS = 24_000_000  # in a second, which has whole periods
_DRAWS = 4096
_WIDTH = 320
_PAD = 8  # places of a line's array before its first pixel, for what the low-pass sees beyond the border
_GREY = 2048  # no colour, with four fraction bits
_ABOVE = 4096  # is added to noise, so that no sum with a value is negative


def _normals() -> list[int]:
    """4096 quantiles of a standard normal, in the middle of as many equal shares, times 65536."""
    normals = []
    for step in range(_DRAWS // 2):
        magnitude = (2 * step + 1) << 51
        cell = bisect_right(rng.HALF_NORMAL, magnitude) - 1
        low, high = rng.HALF_NORMAL[cell], rng.HALF_NORMAL[cell + 1]
        fraction = float(magnitude - low) / float(high - low)
        middle = (float(cell) + 0.5) * 0.0625
        place = fraction - 0.03125 * middle * fraction * (1.0 - fraction)
        normals.append(math.floor((float(cell) + place) * 4096.0 + 0.5))
    return normals + [0 - value for value in normals]


def _taps(bandwidth_hz: float) -> list[int]:
    """The low-pass from its middle outwards, in 1/65536; both sides and the middle add up to 65536."""
    if bandwidth_hz == 0.0:
        return [65536]
    share = bandwidth_hz / PIXELS_PER_SECOND
    variance = 0.34657359027997264 / (19.739208802178716 * share * share)  # ln 2 / 2, 2 pi^2
    reach = min(MOST_TAPS, math.floor(3.0 * math.sqrt(variance)) + 1)
    weights = [exp(0.0 - float(step * step) / (2.0 * variance)) for step in range(reach + 1)]
    total = weights[0]
    for weight in weights[1:]:
        total += 2.0 * weight
    taps = [math.floor(65536.0 * weight / total) for weight in weights]
    both_sides = 0
    for tap in taps[1:]:
        both_sides += 2 * tap
    return [65536 - both_sides, *taps[1:]]


@lru_cache(maxsize=8)
def _tables(gamma: float, luma_noise: float, chroma_noise: float) -> tuple[list[int], list[int], list[int]]:
    """By brightness what is shown, and by draw the noise of Y and of Cb and Cr; all with four fraction bits."""
    shown = [0] + [math.floor(4080.0 * exp(gamma * log(value / 4095.0)) + 0.5) for value in range(1, 4096)]
    normals = _normals()
    luma = [math.floor(normal * luma_noise / 4096.0 + 0.5) + _ABOVE for normal in normals]
    return shown, luma, [math.floor(normal * chroma_noise / 4096.0 + 0.5) + _ABOVE for normal in normals]


@lru_cache(maxsize=8)
def _levels(bits: int) -> bytes:
    """Bytes by value with four fraction bits, from -`_ABOVE` on: rounded, limited, then the bits there are."""
    kept = 256 - (1 << (8 - bits))
    half = (1 << (8 - bits)) >> 1
    return bytes((min(max(value + 8 >> 4, 0), 255) & kept) + half for value in range(-_ABOVE, 2 * _ABOVE))


class Sensor:
    """Sensor, cable and grabber of one camera. `stream` is the source of its noise. Holds one line; no state."""

    NOT_STATE = ("*",)

    def __init__(self, settings: PictureSettings, stream: Stream) -> None:
        self.settings = settings
        self.stream = stream
        self.frame = self.scale = 0
        self.offset = math.floor(settings.offset * 4095.0 + 0.5)
        taps = _taps(settings.chroma_bandwidth_hz)
        self.reach = len(taps) - 1
        self.taps = [tap for tap in [0, *taps[1:], *[0] * 8][:9] for _ in range(8)]  # each for 8 pixels
        self.jitter = math.floor(settings.line_jitter_px * 256.0 + 0.5)
        self.side = self.reach + (1 if self.jitter else 0)
        self.levels = _levels(settings.bits)
        shown, luma_noise, chroma_noise = _tables(settings.gamma, settings.luma_noise, settings.chroma_noise)
        self.gamma, self.luma_noise, self.chroma_noise = shown, luma_noise, chroma_noise
        self.y, self.cb, self.cr = [0] * 352, [0] * 352, [0] * 352
        self.soft_cb, self.soft_cr = [0] * 352, [0] * 352
        self.words = [0] * 448

    def __repr__(self) -> str:
        return f"Sensor({self.settings!r}, {self.stream!r}, frame={self.frame})"

    def begin(self, frame: int, tick: int, samples: int) -> None:
        """Begins a new frame with the middle of its exposure at `tick`; a pixel is a sum of `samples` samples."""
        self.frame = frame
        self.scale = math.floor(self.settings.gain * self._lamps(tick) / samples * 16777216.0 + 0.5)

    def _lamps(self, tick: int) -> float:
        """The mean light of the lamps during the exposure; 1 on average over time."""
        twice_hz = 2 * self.settings.mains_hz
        turns = self.settings.exposure_s * twice_hz
        phase = float(tick % _TICKS * twice_hz % _TICKS) / _TICKS
        sine_end, _ = sincos(6.283185307179586 * (phase + 0.5 * turns))
        sine_begin, cosine = sincos(6.283185307179586 * (phase - 0.5 * turns))
        mean = (sine_end - sine_begin) / (6.283185307179586 * turns) if turns > 1e-6 else cosine
        return 1.0 + self.settings.flicker * mean

    def put(self, column: int, total: int, light: int) -> None:
        """A pixel of the line: its paints added (packed), and the share of light that falls there, times 4096."""
        red = self._shown(total & _MASK, light)
        green = self._shown(total >> _BITS & _MASK, light)
        blue = self._shown(total >> 2 * _BITS, light)
        self.y[column + _PAD] = (77 * red + 150 * green + 29 * blue + 128) >> 8
        self.cb[column + _PAD] = _GREY + ((0 - 43 * red - 85 * green + 128 * blue + 128) >> 8)
        self.cr[column + _PAD] = _GREY + ((128 * red - 107 * green - 21 * blue + 128) >> 8)

    def _shown(self, total: int, light: int) -> int:
        value = ((total * light >> 12) * self.scale >> 24) + self.offset
        return self.gamma[min(value, _FULL)]

    def write(self, row: int, left: int, width: int, out: bytearray, at: int) -> None:
        """The bytes of the line's pixels from `left` on into `out` from `at` on; `side` more were put on each side."""
        if self.jitter:
            self._shake(row, left, width)
        self._soften(self.cb, self.soft_cb, left, width)
        self._soften(self.cr, self.soft_cr, left, width)
        first = self.frame * _FRAME_BLOCKS + row * _LINE_BLOCKS + left // 3
        blocks = (left % 3 + width + 2) // 3
        self.stream.blocks(first, blocks, self.words)
        self._quantise(left, left + width, blocks, out, at - 3 * left)

    def _quantise(self, first: int, end: int, blocks: int, out: bytearray, at: int) -> None:
        """The bytes of pixels into `out`, where column 0 would be `at`; there is a block of noise for three of them."""
        levels, words = self.levels, self.words
        for block in range(blocks):
            column = first - first % 3 + 3 * block
            last = words[336 + block]
            if first <= column and column + 3 <= end:
                self._write_pixel(levels, column, words[block], last, out, at)
                self._write_pixel(levels, column + 1, words[112 + block], last >> 4, out, at)
                self._write_pixel(levels, column + 2, words[224 + block], last >> 8, out, at)
            else:
                for part in range(max(first - column, 0), min(end - column, 3)):
                    word = words[112 * part + block]
                    self._write_pixel(levels, column + part, word, last >> 4 * part, out, at)

    def _write_pixel(self, levels: bytes, column: int, word: int, last: int, out: bytearray, at: int) -> None:
        """Y, Cb, Cr of a pixel with their noise: 12 random bits each, the highest four in `last`."""
        at += 3 * column
        column += _PAD
        y = levels[self.y[column] + self.luma_noise[word & 4095]]
        cb = levels[self.soft_cb[column] + self.chroma_noise[word >> 12 & 4095]]
        cr = levels[self.soft_cr[column] + self.chroma_noise[word >> 24 | (last & 15) << 8]]
        out[at], out[at + 1], out[at + 2] = y, cb, cr

    def _soften(self, values: list[int], soft: list[int], left: int, width: int) -> None:
        """Chroma after the low-pass, of a part of the line; beyond the picture it goes on as at its border.

        All taps add up to 1: what is seen beside a pixel counts by how it differs from what is seen there.
        """
        for step in range(self.reach):
            if left < self.reach:
                values[_PAD - 1 - step] = values[_PAD]
            if left + width + self.reach > _WIDTH:
                values[_PAD + _WIDTH + step] = values[_PAD + _WIDTH - 1]
        sums = [0] * 8
        for first in range(left + _PAD, left + width + _PAD, 8):  # as many pixels together
            for lane in range(8):
                sums[lane] = values[first + lane] << 16
            for step in range(1, self.reach + 1):
                for lane in range(8):
                    bend = (
                        values[first - step + lane] + values[first + step + lane] - 2 * values[first + lane]
                    )
                    sums[lane] += bend * self.taps[8 * step + lane]
            for lane in range(8):
                soft[first + lane] = sums[lane] >> 16

    def _shake(self, row: int, left: int, width: int) -> None:
        """Moves the line by its jitter, up to a pixel either way, between neighbouring pixels linearly."""
        first = self.frame * _FRAME_BLOCKS + 240 * _LINE_BLOCKS  # behind the blocks of the picture's pixels
        word = self.stream.u32(4 * first + row)
        by = ((word >> 16) * (2 * self.jitter + 1) >> 16) - self.jitter
        begin = left - self.reach if left > self.reach else 0
        last = min(left + width + self.reach, _WIDTH) - 1
        self._move(self.y, begin, last, by)
        self._move(self.cb, begin, last, by)
        self._move(self.cr, begin, last, by)

    def _move(self, values: list[int], first: int, last: int, by: int) -> None:
        """Each value becomes that `by`/256 pixels to its right; beyond the picture it is as at its border."""
        step = 1 if by >= 0 else -1
        column = _PAD + (first if by >= 0 else last)
        border = _PAD + (_WIDTH - 1 if by >= 0 else 0)
        for _ in range(first, last + 1):
            beside = values[column if column == border else column + step]
            values[column] += (beside - values[column]) * step * by >> 8
            column += step
