"""The pictures of docs/one-frame.md: the camera's frame, the wire with the firmware behind it, and the wheels.

White ground, so that they can be read on dark pages too.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib.style
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image

from benchmarks.one_frame import Way

COLOURS = ("#1f5fa8", "#c8452d", "#2e8b57", "#8a5bb0", "#b07d12")
LEFT, RIGHT, DARK = COLOURS[0], COLOURS[1], "#333333"
STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.edgecolor": "#777777",
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "legend.frameon": False,
}
AROUND_PX = 6
"""What is shown around the tracker's window."""
CHARACTER = 8
"""The one that is shown bit by bit: the first after the sync."""
LANES = {
    "interrupts": ("vector", "_uart", "_failsafe_interrupt"),
    "sync, CRC": ("_decode", "_take_body", "_wire_", "_crc", "_failsafe_look", "_read_clock"),
    "newer than the last?": ("_failsafe_fresh", "_look_back", "__mulint", "_restart"),
    "LM629": (
        "_motion",
        "_saturated",
        "_load",
        "_lm629",
        "_free",
        "_wait",
        "_read_cycle",
        "_write_cycle",
        "_start_both",
    ),
}


def draw(way: Way, folder: Path) -> None:
    """Writes the three files."""
    for name, height, make in (("picture", 3.6, _picture), ("wire", 6.4, _wire), ("wheels", 6.0, _wheels)):
        with matplotlib.style.context(STYLE, after_reset=True):
            figure = Figure(figsize=(9.6, height), dpi=100, layout="constrained")
            make(way, figure)
            drawn = io.BytesIO()
            FigureCanvasAgg(figure).print_png(drawn)  # type: ignore[no-untyped-call]
        image = Image.open(drawn).convert("RGB")
        if name != "picture":  # its pixels stay what they are
            image = image.quantize(128, dither=Image.Dither.NONE)
        image.save(folder / f"one-frame-{name}.png", optimize=True)


def _picture(way: Way, figure: Figure) -> None:
    image, window, pair = way.picture.image(), way.window, way.pair
    whole, part = figure.subplots(1, 2)
    for axes in (whole, part):
        axes.imshow(image, interpolation="nearest", extent=(0, image.width, image.height, 0))
        axes.grid(visible=False)
        corner = window.left, window.top
        axes.add_patch(Rectangle(corner, window.width, window.height, fill=False, edgecolor="white", lw=1.2))
    whole.set(title="the camera's frame, 320 x 240 pixels, and the tracker's window")
    part.set(title="the window: centroids of both patches, measured posture")
    part.set_xlim(window.left - AROUND_PX, window.left + window.width + AROUND_PX)
    part.set_ylim(window.top + window.height + AROUND_PX, window.top - AROUND_PX)
    tail, tip = way.arrow
    part.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": "white", "lw": 2.0})
    for u, v, up in ((pair.u, pair.v, 50), (pair.identity_u, pair.identity_v, -48)):
        part.plot(u, v, "+", color="white", markersize=16, markeredgewidth=4)
        part.plot(u, v, "+", color="black", markersize=14, markeredgewidth=1.5)
        text = f"{u:.2f}, {v:.2f}"
        part.annotate(
            text, (u, v), (0, up), textcoords="offset points", color="white", ha="center", va="center"
        )


def _level(way: Way, axes: Any, wire: str, first: int, last: int, low: float = 0.0, **look: Any) -> None:
    """A wire between two ticks, as steps from `low` to `low` + 1; the time in ms."""
    edges = way.edges[wire]
    begin = max(index for index, (tick, _) in enumerate(edges) if tick <= first)
    shown = [edge for edge in edges[begin:] if edge[0] < last]
    ticks = [max(tick, first) for tick, _ in shown] + [last]
    levels = [low + 0.8 * level for _, level in shown]
    axes.step([way.us(tick) / 1000 for tick in ticks], [*levels, levels[-1]], where="post", **look)


def _wire(way: Way, figure: Figure) -> None:
    frame, bits, after = figure.subplots(3, 1, height_ratios=(1.0, 1.0, 1.9))
    _frame(way, frame)
    _bits(way, bits)
    _after(way, after)
    for axes in (frame, bits):
        axes.set(yticks=(0, 0.8), yticklabels=("0", "1"), ylim=(-0.15, 1.35))
        axes.grid(visible=False)
    after.set_xlabel("ms since the exposure")


def _frame(way: Way, axes: Any) -> None:
    first, last = way.key_up_tick - 24_000, way.received[-1].tick + 24_000
    _level(way, axes, "rxd", first, last, color=DARK, lw=0.7)
    for index, value in enumerate(way.sent.data):
        middle = way.us(way.sent.tick + 25_000 * index + 12_500) / 1000
        colour = LEFT if 9 <= index < 11 else RIGHT if 11 <= index < 13 else DARK
        axes.text(middle, 0.95, f"{value:02x}", ha="center", color=colour, family="DejaVu Sans Mono")
    carrier, data = way.us(way.key_up_tick) / 1000, way.us(way.sent.tick) / 1000
    axes.axvspan(way.us(first) / 1000, carrier, color="#f0e2c8", lw=0)
    axes.axvspan(carrier, data, color="#dbe8d8", lw=0)
    axes.set_xlim(way.us(first) / 1000, way.us(last) / 1000)
    axes.set_title(
        "RXD: noise, carrier, 23 characters, noise; velocities of the left (blue) and right wheel (red)"
    )


def _bits(way: Way, axes: Any) -> None:
    begin = way.sent.tick + 25_000 * CHARACTER
    first, last = begin - 4000, begin + 29_000
    _level(way, axes, "rxd", first, last, color=DARK)
    value = way.sent.data[CHARACTER]
    names = ["start", *(f"bit {bit}: {value >> bit & 1}" for bit in range(8)), "stop"]
    for index, name in enumerate(names):
        axes.text(way.us(begin + 2500 * index + 1250) / 1000, 1.0, name, ha="center")
        axes.axvline(way.us(begin + 2500 * index) / 1000, color="#cccccc", lw=0.6, zorder=0)
    axes.axvline(way.us(way.received[CHARACTER].tick) / 1000, ymax=0.6, color=RIGHT, lw=1.2)
    axes.text(way.us(way.received[CHARACTER].tick + 150) / 1000, 0.35, "RI", color=RIGHT)
    axes.set_xlim(way.us(first) / 1000, way.us(last) / 1000)
    axes.set_title(f"RXD: character {CHARACTER + 1}, {value:02x}h, low bit first")


def _after(way: Way, axes: Any) -> None:
    first, last = way.received[-1].tick - 3000, way.start_command.tick + 4000
    names = list(LANES)
    for span in way.on_the_way:
        for lane, name in enumerate(names):
            if span.name.startswith(LANES[name]):
                length = (span.end_tick - span.start_tick) / 24000
                axes.broken_barh(
                    [(way.us(span.start_tick) / 1000, length)], (5 - lane, 0.8), color=COLOURS[lane]
                )
    _level(way, axes, "left_wr_n", first, last, 1.0, color=DARK, lw=0.8)
    _level(way, axes, "left_busy", first, last, 0.0, color=LEFT, lw=0.8)
    for event, name in zip(way.commands, ("left loaded ", "right loaded ", " STT"), strict=True):
        axes.axvline(way.us(event.tick) / 1000, color="#999999", lw=0.8, zorder=0)
        axes.text(way.us(event.tick) / 1000, 6.0, name, ha="left" if name == " STT" else "right", va="bottom")
    labels = [*names, "/WR", "left LM629 busy"]
    axes.set(yticks=[5.4 - lane for lane in range(6)], yticklabels=labels, ylim=(-0.3, 6.7))
    axes.grid(visible=False)
    axes.set_xlim(way.us(first) / 1000, way.us(last) / 1000)
    axes.set_title("what the CPU does after the last character")


def _wheels(way: Way, figure: Figure) -> None:
    wanted, duty, pins = figure.subplots(3, 1, height_ratios=(1.2, 1.2, 1.0))
    start = way.start_command.tick
    shown = [one for one in way.samples if -8 * 24_000 < one.tick - start < 20 * 24_000]
    times = [way.us(one.tick) / 1000 for one in shown]
    for axes, at in ((wanted, 0), (duty, 2)):
        axes.step(times, [one.left[at] for one in shown], where="post", color=LEFT, label="left")
        axes.step(times, [one.right[at] for one in shown], where="post", color=RIGHT, label="right")
        axes.axvline(way.us(start) / 1000, color="#999999", lw=0.8)
        axes.set_xlim(times[0], times[-1])
    wanted.legend(loc="center left")
    wanted.set(title="wanted velocity, counts a sample; the line is STT")
    duty.set(title="PWM with sign, in 1/128")
    first, last = way.taken.tick - 2 * 8192, way.taken.tick + 6 * 8192
    for low, (wire, colour) in enumerate(
        (("right_a", RIGHT), ("right_pwm", RIGHT), ("left_a", LEFT), ("left_pwm", LEFT))
    ):
        _level(way, pins, wire, first, last, float(low), color=colour, lw=0.8)
    pins.axvline(way.us(start) / 1000, color="#999999", lw=0.8)
    pins.set(yticks=[0.4, 1.4, 2.4, 3.4], yticklabels=("right A", "right pulses", "left A", "left pulses"))
    pins.grid(visible=False)
    pins.set_xlim(way.us(first) / 1000, way.us(last) / 1000)
    pins.set(title="pulses to the L298 and channel A of the encoders", xlabel="ms since the exposure")
