"""The tables of docs/one-frame.md; its words are in `one_frame.txt`.

What belongs here: from what became of a frame to numbers and tables. What does not: the run (`one_frame`), the pictures
(`one_frame_pictures`).
"""

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
    "_uart_interrupt": "stores the character, and that it follows the one before",
    "_decode_character": "has a frame's length of good characters, and finds the sync",
    "_failsafe_look": "notes when the characters came",
    "_decode_valid": "asks whether the CRC is good",
    "_take_body": "takes the characters out of the ring",
    "_wire_whiten": "the next byte of the whitening sequence",
    "_crc_byte": "the CRC of a byte, bit by bit",
    "_failsafe_fresh": "asks whether the frame is newer than the last one",
    "_motion_team": "takes the velocities of this robot's slot",
    "_load_velocity": "loads one LM629",
    "_lm629_command": "one command byte",
    "_lm629_word": "one word, two bytes",
    "_wait_for": "polls the busy bits",
    "_start_both": "starts both LM629",
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
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def _numbers(way: Way) -> dict[str, float | int | str]:
    last, start = way.received[-1].tick, way.start_command.tick
    then, now = way.before.robots[0].truth, way.answer.robots[0].truth
    total_ms, camera_ms = way.us(way.taken.tick) / 1000, way.us(way.answer.tick) / 1000
    air_ms = len(way.sent.data) * 10 / 9.6
    return {
        "exposed_ms": 1000 * seconds(way.exposed_tick),
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
        "ri_us": (way.received[0].tick - way.sent.tick) / 24,
        "cycles": round((start - last) / CYCLE_TICKS),
        "cycles_us": (start - last) / 24,
        "interrupts": _interrupts(way),
        "wait_us": (way.taken.tick - start) / 24,
        "key_up": way.key_up_tick,
        "last": last,
        "start": start,
        "taken": way.taken.tick,
    }


def _interrupts(way: Way) -> str:
    found = [span for span in way.on_the_way if span.name.startswith("vector")]
    return ", ".join(f"{span.name.removeprefix('vector ')} at {_us(way, span.start_tick)}" for span in found)


def _times(way: Way) -> str:
    sample = way.taken.tick
    steps = [
        (way.exposed_tick, "camera", "exposure"),
        (way.answer.tick, "PC", "the picture is tracked; the law begins"),
        (way.key_up_tick, "radio", "transmitter on"),
        (way.sent.tick, "radio", "first start bit"),
        (way.received[0].tick, "8051", "RI of the first character"),
        (way.received[-1].tick, "8051", "RI of the last character"),
        (way.first("_decode_valid").start_tick, "firmware", "sync found; the CRC begins"),
        (way.first("_motion_team").start_tick, "firmware", "frame valid and new; its velocities are taken"),
        (way.commands[0].tick, "left LM629", "velocity loaded"),
        (way.commands[1].tick, "right LM629", "velocity loaded"),
        (way.start_command.tick, "both LM629", "start (STT)"),
        (sample, "both LM629", "sample: the wanted velocity begins to change"),
        (way.next_edge("left_pwm", 0, sample), "L298", "end of the first pulse for the left motor"),
        (way.next_edge("left_a", 1, sample), "encoder", "next rising edge of the left wheel's A"),
        (way.after[0].tick, "camera", "exposure of the first frame that can show it"),
        (way.telemetry.tick, "PC", "the robot's answer is in"),
    ]
    before = [way.exposed_tick, *(tick for tick, _, _ in steps)]
    rows = [
        (_us(way, tick), f"{(tick - last) / 24:.1f}", where, what)
        for last, (tick, where, what) in zip(before, steps, strict=False)
    ]
    return table(("us", "since the line above", "where", "what"), rows)


def _postures(way: Way) -> str:
    seen, truth = way.pair.sighting, way.before.robots[0].truth
    rows = [("measured", *_posture(seen)), ("true", *_posture(truth)), ("error", *_posture(seen, truth))]
    return table(("", "x, cm", "y, cm", "heading, degrees"), rows)


def _posture(at: Posture, zero: Posture | None = None) -> tuple[str, str, str]:
    zero = zero or Posture(0.0, 0.0, 0.0)
    heading = math.degrees(at.theta_rad - zero.theta_rad)
    return f"{100 * (at.x_m - zero.x_m):.2f}", f"{100 * (at.y_m - zero.y_m):.2f}", f"{heading:.2f}"


def _law_input(way: Way) -> str:
    seen, reference = way.pair.sighting, way.answer.robots[0].reference
    rows = [("posture c", *_posture(seen)), ("reference r", *_posture(reference))]
    rows.append(("error c - r", *_posture(seen, reference)))
    return table(("", "x, cm", "y, cm", "heading, degrees"), rows)


def _law_output(way: Way) -> str:
    last, control = _control(way.before.robots[0].control), _control(way.answer.robots[0].control)
    s1, s2, u1, u2 = (control.inner[name] for name in ("s1", "s2", "u1", "u2"))
    rows = [
        ("sliding surfaces s1, s2", f"{s1:.4f} m/s", f"{s2:.4f} rad/s"),
        ("accelerations u1, u2", f"{u1:.4f} m/s^2", f"{u2:.4f} rad/s^2"),
        ("velocities of the last frame", f"{last.v_m_s:.4f} m/s", f"{last.w_rad_s:.4f} rad/s"),
        ("velocities of this one", f"{control.v_m_s:.4f} m/s", f"{control.w_rad_s:.4f} rad/s"),
        ("wheels of the last frame", f"left {last.left}", f"right {last.right}"),
        ("wheels of this one", f"left {control.left}", f"right {control.right}"),
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
                _us(way, way.received[end - 1].tick),
            )
        )
    return table(("characters", "on the wire", "in clear", "meaning", "RI of the last, us"), rows)


def _functions(way: Way) -> str:
    rows = []
    for name, what in FUNCTIONS.items():
        spans = [span for span in way.on_the_way if span.name == name]
        cycles = [(span.end_tick - span.start_tick) // CYCLE_TICKS for span in spans]
        entered = _us(way, spans[0].start_tick)
        rows.append((f"`{name}`", f"{spans[0].address:04X}h", entered, f"{sum(cycles)}", what))
    return table(("function", "address", "entered first, us", "cycles", "what it does"), rows)


def _commands(way: Way) -> str:
    rows = []
    for event in way.commands:
        data = f"{event.opcode:02x} {event.data.hex(' ')}".strip()
        speed = f"{int.from_bytes(event.data[2:], 'big') / 65536:.4f}" if event.data else ""
        rows.append((_us(way, event.tick), event.side, BY_OPCODE[event.opcode].name, f"`{data}`", speed))
    return table(("last byte, us", "LM629", "command", "bytes", "counts a sample"), rows)


def _samples(way: Way) -> str:
    at = way.samples.index(way.taken)
    rows = [
        (
            _us(way, tick),
            *(cell for speed, count, pwm in chips for cell in (f"{speed:.4f}", count, f"{pwm:+d}/128")),
        )
        for tick, *chips in way.samples[at - 1 : at + 5]
    ]
    heads = (
        f"{side}: {what}"
        for side in ("left", "right")
        for what in ("wanted, counts a sample", "position", "PWM")
    )
    return table(("sample, us", *heads), rows)


def _motion(way: Way) -> str:
    robots = [(period.tick, period.robots[0]) for period in (way.before, way.answer, *way.after)]
    rows = [
        (_us(way, tick), *_posture(robot.truth), f"{robot.v_m_s:.4f}", f"{robot.w_rad_s:.4f}")
        + (robot.left.real_position, robot.right.real_position)
        for tick, robot in robots
    ]
    heads = ("x, cm", "y, cm", "heading, degrees", "v, m/s", "w, rad/s", "left, counts", "right, counts")
    return table(("exposure, us", *heads), rows)


def _us(way: Way, tick: int) -> str:
    return f"{way.us(tick):.1f}"


TABLES = (_times, _postures, _law_input, _law_output, _characters, _functions, _commands, _samples, _motion)
