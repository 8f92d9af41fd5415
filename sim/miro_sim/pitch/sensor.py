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


def _normals() -> list[int]:
    """4096 quantiles of a standard normal, in the middle of as many equal shares, times 65536."""
    found = []
    for step in range(_DRAWS // 2):
        magnitude = (2 * step + 1) << 51
        cell = bisect_right(rng.HALF_NORMAL, magnitude) - 1
        low, high = rng.HALF_NORMAL[cell], rng.HALF_NORMAL[cell + 1]
        fraction = float(magnitude - low) / float(high - low)
        middle = (float(cell) + 0.5) * 0.0625
        place = fraction - 0.03125 * middle * fraction * (1.0 - fraction)
        found.append(math.floor((float(cell) + place) * 4096.0 + 0.5))
    return found + [0 - value for value in found]


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
    luma = [math.floor(normal * luma_noise / 4096.0 + 0.5) for normal in normals]
    return shown, luma, [math.floor(normal * chroma_noise / 4096.0 + 0.5) for normal in normals]


class Sensor:
    """Sensor, cable and grabber of one camera. `stream` is the source of its noise. Holds one line; no state."""

    NOT_STATE = (
        *("settings", "stream", "frame", "scale", "offset", "reach", "side", "taps", "kept", "half"),
        *("jitter", "gamma", "luma_noise", "chroma_noise", "y", "cb", "cr", "soft_cb", "soft_cr"),
        *("noise_y", "noise_cb", "noise_cr", "words"),
    )

    def __init__(self, settings: PictureSettings, stream: Stream) -> None:
        self.settings = settings
        self.stream = stream
        self.frame = 0
        self.scale = 0
        self.offset = math.floor(settings.offset * 4095.0 + 0.5)
        taps = _taps(settings.chroma_bandwidth_hz)
        self.reach = len(taps) - 1
        self.taps = [0] * 72  # each for 8 pixels
        for place in range(8, 8 * len(taps)):
            self.taps[place] = taps[place // 8]
        self.jitter = math.floor(settings.line_jitter_px * 256.0 + 0.5)
        self.side = self.reach + (1 if self.jitter else 0)
        lost = 8 - settings.bits
        self.kept = 256 - (1 << lost)
        self.half = (1 << lost) >> 1
        self.gamma = [0] * 4096
        self.luma_noise = [0] * 4096
        self.chroma_noise = [0] * 4096
        shown, luma, chroma = _tables(settings.gamma, settings.luma_noise, settings.chroma_noise)
        for value in range(4096):
            self.gamma[value] = shown[value]
            self.luma_noise[value] = luma[value]
            self.chroma_noise[value] = chroma[value]
        self.y = [0] * 352
        self.cb = [0] * 352
        self.cr = [0] * 352
        self.soft_cb = [0] * 352
        self.soft_cr = [0] * 352
        self.noise_y = [0] * 352
        self.noise_cb = [0] * 352
        self.noise_cr = [0] * 352
        self.words = [0] * 448

    def __repr__(self) -> str:
        return f"Sensor({self.settings!r}, {self.stream!r}, frame={self.frame})"

    def begin(self, frame: int, tick: int, samples: int) -> None:
        """A new frame, whose exposure has its middle at `tick`; a pixel is a sum of so many samples."""
        self.frame = frame
        light = self.settings.gain * self._lamps(tick) / samples
        self.scale = math.floor(light * 16777216.0 + 0.5)

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
        return self.gamma[0 if value < 0 else (value if value < _FULL else _FULL)]

    def write(self, row: int, left: int, width: int, out: bytearray, at: int) -> None:
        """The bytes of the line's pixels from `left` on into `out` from `at` on; `side` more were put on each side."""
        if self.jitter:
            self._shake(row, left, width)
        self._soften(self.cb, self.soft_cb, left, width)
        self._soften(self.cr, self.soft_cr, left, width)
        first = self.frame * _FRAME_BLOCKS + row * _LINE_BLOCKS + left // 3
        self._draw_noise(first, left - left % 3, (left % 3 + width + 2) // 3)
        self._quantise(self.y, self.noise_y, left, width, out, at)
        self._quantise(self.soft_cb, self.noise_cb, left, width, out, at + 1)
        self._quantise(self.soft_cr, self.noise_cr, left, width, out, at + 2)

    def _draw_noise(self, first: int, column: int, blocks: int) -> None:
        """The noise of pixels from `column` on, three a block: 12 bits of a word for each of Y, Cb, Cr."""
        self.stream.blocks(first, blocks, self.words)
        for block in range(blocks):
            last = self.words[336 + block]
            for part in range(3):
                word = self.words[112 * part + block]
                at = column + _PAD + 3 * block + part
                self.noise_y[at] = self.luma_noise[word & 4095]
                self.noise_cb[at] = self.chroma_noise[word >> 12 & 4095]
                self.noise_cr[at] = self.chroma_noise[word >> 24 | (last >> 4 * part & 15) << 8]

    def _quantise(
        self, values: list[int], noise: list[int], left: int, width: int, out: bytearray, at: int
    ) -> None:
        """Values with four fraction bits as each third byte from `at` on: rounded, limited, then the bits there are."""
        kept, half = self.kept, self.half
        found = [0] * 16
        for first in range(0, width, 16):  # as many pixels together
            column = left + _PAD + first
            for lane in range(16):
                found[lane] = values[column + lane] + noise[column + lane] + 8
            for lane in range(16):
                value = found[lane] >> 4
                value = 0 if value < 0 else value
                value = 255 if value > 255 else value
                found[lane] = (value & kept) + half
            for lane in range(min(16, width - first)):
                out[at] = found[lane]
                at += 3

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
        first, last = first + _PAD, last + _PAD
        if by >= 0:
            for column in range(first, last + 1):
                after = values[column + 1 if column + 1 < _PAD + _WIDTH else column]
                values[column] += (after - values[column]) * by >> 8
        else:
            for column in range(last, first - 1, -1):
                before = values[column - 1 if column > _PAD else column]
                values[column] += (before - values[column]) * (0 - by) >> 8
