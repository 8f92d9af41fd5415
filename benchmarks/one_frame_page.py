"""The tables of docs/one-frame.md; its words are in `one_frame.txt`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.one_frame import FRAME, SCENARIO, SEED, Way
from miro_exact.clock import CYCLE_TICKS, seconds
from miro_host.posture import Posture
from miro_protocol.frames import TeamFrame
from miro_robot.lm629.commands import BY_OPCODE
from miro_sim.periods import Control

Row = Sequence[object]
FUNCTIONS = {
    "_take_body": "takes the characters out of the ring",
    "_wire_whiten": "the next byte of the whitening sequence",
    "_crc_byte": "the CRC of a byte, bit by bit",
    "_load_velocity": "loads one LM629",
    "_lm629_word": "one word, two bytes",
    "_wait_for": "polls the busy bits",
}
PARTS = ((0, 6, "preamble"), (6, 8, "sync"), (8, 9, "type {0.type}, number {0.seq}"))
PARTS += ((9, 11, "left wheel {0.velocities[0][0]}"), (11, 13, "right wheel {0.velocities[0][1]}"))
PARTS += ((13, 21, "the other two robots"), (21, 23, "CRC"))


def page(way: Way) -> str:
    """The whole page."""
    words = Path(__file__).with_name("one_frame.txt").read_text("utf-8")
    tables = {make.__name__[1:]: make(way) for make in TABLES}
    return words.format(way=way, frame=FRAME, scenario=SCENARIO, seed=SEED, **_numbers(way), **tables)


def table(heads: Row, rows: Iterable[Row]) -> str:
    head, *lines = ("| " + " | ".join(str(cell) for cell in line) + " |" for line in (heads, *rows))
    return "\n".join([head, "|---" * len(heads) + "|", *lines])


def _numbers(way: Way) -> dict[str, object]:
    last, start = way.received[-1].tick, way.start_command.tick
    then, now = way.before.robots[0].truth, way.answer.robots[0].truth
    total_ms, camera_ms = way.us(way.taken.tick) / 1000, way.us(way.answer.tick) / 1000
    air_ms = len(way.sent.data) * 10 / 9.6
    return {
        "look_ms": 1000 * seconds(way.exposed_tick) + 0.1,
        "total_ms": total_ms,
        "camera_ms": camera_ms,
        "air_ms": air_ms,
        "rest_ms": total_ms - camera_ms - air_ms,
        "moved_mm": 1000 * math.hypot(now.x_m - then.x_m, now.y_m - then.y_m),
        "compute_ms": (way.key_up_tick - way.answer.tick) / 24000,
        "keyup_ms": (way.sent.tick - way.key_up_tick) / 24000,
        "size": len(way.sent.data),
        "body": len(way.decoded.body) + 2,
        "wheels": _control(way.answer.robots[0].control),
        "ri_us": (way.received[0].tick - way.sent.tick) / 24,
        "cycles": round((start - last) / CYCLE_TICKS),
        "cycles_us": (start - last) / 24,
        "interrupts": sum(span.name.startswith("vector") for span in way.on_the_way),
        "wait_us": (way.taken.tick - start) / 24,
        "key_up": way.key_up_tick,
        "last": last,
        "start": start,
        "taken": way.taken.tick,
    }


def _times(way: Way) -> str:
    sample = way.taken.tick
    steps = [
        (way.exposed_tick, "camera", "exposure"),
        (way.answer.tick, "PC", "the picture is tracked; the law begins"),
        (way.key_up_tick, "radio", "transmitter on"),
        (way.received[0].tick, "8051", "RI of the first character"),
        (way.received[-1].tick, "8051", "RI of the last character"),
        (way.first("_decode_valid").start_tick, "firmware", "sync found; the CRC begins"),
        (way.first("_motion_team").start_tick, "firmware", "frame valid and new; its velocities are taken"),
        (way.start_command.tick, "both LM629", "start (STT)"),
        (sample, "both LM629", "sample: the wanted velocity begins to change"),
        (way.after[0].tick, "camera", "exposure of the first frame that can show it"),
        (way.telemetry.tick, "PC", "the robot's answer is in"),
    ]
    return table(("us", "where", "what"), [(_us(way, tick), where, what) for tick, where, what in steps])


def _postures(way: Way) -> str:
    seen, truth = way.pair.sighting, way.before.robots[0].truth
    reference = way.answer.robots[0].reference
    rows = [("measured", *_posture(seen)), ("true", *_posture(truth)), ("reference", *_posture(reference))]
    return table(("", "x, cm", "y, cm", "heading, degrees"), rows)


def _posture(at: Posture) -> tuple[str, str, str]:
    return f"{100 * at.x_m:.2f}", f"{100 * at.y_m:.2f}", f"{math.degrees(at.theta_rad):.2f}"


def _law_output(way: Way) -> str:
    last, control = _control(way.before.robots[0].control), _control(way.answer.robots[0].control)
    s1, s2, u1, u2 = (control.inner[name] for name in ("s1", "s2", "u1", "u2"))
    rows = [
        ("sliding surfaces s1, s2", f"{s1:.4f} m/s", f"{s2:.4f} rad/s"),
        ("accelerations u1, u2", f"{u1:.4f} m/s^2", f"{u2:.4f} rad/s^2"),
        ("velocities before", f"{last.v_m_s:.4f} m/s", f"{last.w_rad_s:.4f} rad/s"),
        ("velocities now", f"{control.v_m_s:.4f} m/s", f"{control.w_rad_s:.4f} rad/s"),
    ]
    return table(("", "along the path", "turning"), rows)


def _control(control: Control | None) -> Control:
    assert control is not None
    return control


def _characters(way: Way) -> str:
    data, body = way.sent.data, way.decoded.body
    message = way.decoded.message(3)
    assert isinstance(message, TeamFrame)
    rows = []
    for first, end, what in PARTS:
        clear = body[first - 8 : end - 8] if 8 <= first < 21 else b""
        cells = [f"`{part.hex(' ')}`" if part else "" for part in (data[first:end], clear)]
        rows.append(
            (
                f"{first + 1} to {end}".removeprefix(f"{end} to "),
                *cells,
                what.format(message),
            )
        )
    return table(("characters", "on the wire", "in clear", "meaning"), rows)


def _functions(way: Way) -> str:
    rows = []
    for name, what in FUNCTIONS.items():
        spans = [span for span in way.on_the_way if span.name == name]
        cycles = [(span.end_tick - span.start_tick) // CYCLE_TICKS for span in spans]
        rows.append((f"`{name}`", f"{sum(cycles)}", what))
    return table(("function", "cycles", "what it does"), rows)


def _commands(way: Way) -> str:
    rows = []
    for event in way.commands:
        data = f"{event.opcode:02x} {event.data.hex(' ')}".strip()
        speed = f"{int.from_bytes(event.data[2:], 'big') / 65536:.4f}" if event.data else ""
        rows.append((_us(way, event.tick), event.side, BY_OPCODE[event.opcode].name, f"`{data}`", speed))
    return table(("last byte, us", "LM629", "command", "bytes", "counts a sample"), rows)


def _us(way: Way, tick: int) -> str:
    return f"{way.us(tick):.1f}"


TABLES = (_times, _postures, _law_output, _characters, _functions, _commands)
