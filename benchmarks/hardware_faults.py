"""What the robot's firmware does under each hardware fault: the table of docs/howto/faults.md (`--write`).

A robot gets a team frame each 33.37 ms. At 400 ms hardware breaks, for good or for 100 ms. From 3.5 s on the frames
tell it to stand, from 3.7 s on to drive again, up to 5 s.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from miro_exact.clock import TICKS_PER_SECOND
from miro_host.wheels import Wheels
from miro_protocol.actions import Fault, ScriptItem
from miro_protocol.frames import TeamFrame, encode
from miro_protocol.transmission import DOWN, Transmission
from miro_robot.firmware import image_path
from miro_robot.image import Image, load_hex
from miro_robot.lm629.signals import EXCESSIVE_ERROR
from miro_sim.scenario.file import load
from miro_sim.world.world import World

PAGE = Path(__file__).parents[1] / "docs" / "howto" / "faults.md"
BEGIN, END = "<!-- table: python -m benchmarks.hardware_faults --write -->\n", "<!-- end of table -->\n"
MS = TICKS_PER_SECOND // 1000
BROKEN_MS, MENDED_MS, STAND_MS, AGAIN_MS, END_MS = 400, 500, 3500, 3700, 5000
FRAME_MS, FIRST_MS, FRAMES = 33.37, 60, 147
SPEEDS_M_S = (0.2, 1.46)
LASTING = (
    *("encoder left lost", "lm629 left busy", "lm629 left dead", "motor left open", "wheel left blocked"),
    *("pin P0.0 1", "pin P2.5 0", "rxd inverted", "rxd 1"),
)
AT_ONCE = ("power dip",)
MOST_RESETS = 8
STANDS_M_S, STANDS_RAD_S = 1e-3, 1e-2
DEGREES = 57.29577951308232


class Course(NamedTuple):
    """What came of a fault. Times from the fault on, None: it does not happen while frames tell it to drive.

    `off_ms`: neither motor is driven; `stood_ms`: it stands. `path_cm`, `turned_deg`, `fastest_m_s`: until it is told
    to stand. `lost`: an LM629 had a position error; `resets` of the left one; `heard`: frames went on to be fresh.
    """

    off_ms: int | None
    stood_ms: int | None
    fastest_m_s: float
    turned_deg: float
    path_cm: float
    lost: bool
    resets: int
    heard: bool
    ends_m_s: float


def script(speed_m_s: float, what: str, mended: bool) -> list[ScriptItem]:
    """What goes into a run."""
    items: list[ScriptItem] = [Fault(BROKEN_MS * MS, 0, 0, what)]
    if mended:
        items.append(Fault(MENDED_MS * MS, 0, 0, f"{what.rpartition(' ')[0]} ok"))
    for number in range(FRAMES):
        at_ms = FIRST_MS + FRAME_MS * number
        counts = 0 if STAND_MS <= at_ms < AGAIN_MS else Wheels().counts(speed_m_s)
        frame = encode(TeamFrame(0, number % 64, ((counts, counts),) * 3), 3)
        items.append(Transmission(round(at_ms * MS), DOWN, frame))
    return items


def course(image: Image, speed_m_s: float, what: str, mended: bool = False) -> Course:
    """One run, looked at each millisecond."""
    scenario = load("silent", [f"duration_s={END_MS / 1000}"]).scenario
    world = World(scenario, 0, image, script(speed_m_s, what, mended))
    world.run_to(BROKEN_MS * MS)
    robot = world.robot()
    chip, heard, heading_rad = robot.board.left, robot.counter(0) or 0, robot.drive.pose_at(world.tick)[2]
    off_ms = stood_ms = None
    fastest_m_s, path_m = 0.0, 0.0
    reset_ticks, lost = {chip.reset_tick}, False
    for ms in range(1, STAND_MS - BROKEN_MS + 1):
        world.run_to((BROKEN_MS + ms) * MS)
        v_m_s, w_rad_s = robot.drive.velocity_at(world.tick)
        path_m += abs(v_m_s) / 1000
        fastest_m_s = max(fastest_m_s, abs(v_m_s))
        reset_ticks.add(chip.reset_tick)
        lost = lost or bool((chip.signals.word | robot.board.right.signals.word) & EXCESSIVE_ERROR)
        if off_ms is None and not robot.board.left.pwm_magnitude and not robot.board.right.pwm_magnitude:
            off_ms = ms
        if stood_ms is None and abs(v_m_s) < STANDS_M_S and abs(w_rad_s) < STANDS_RAD_S:
            stood_ms = ms
    turned_deg = (robot.drive.pose_at(world.tick)[2] - heading_rad) * DEGREES
    hears = (
        not heard <= (robot.counter(0) or 0) <= heard + 1
    )  # one was on the air; a counter that began again is lower
    world.run_to((END_MS - 50) * MS)
    ends_m_s = robot.drive.velocity_at(world.tick)[0]
    ways = fastest_m_s, turned_deg, 100 * path_m
    return Course(off_ms, stood_ms, *ways, lost, len(reset_ticks) - 1, hears, ends_m_s)


def answer(what: str, found: Course) -> str:
    """What the firmware did about it."""
    begun = "begins again" if what in AT_ONCE else ""
    if found.lost:
        return ", then ".join([begun] * bool(begun) + ["position error"])
    if found.resets > 1:
        return f"{found.resets} LM629 resets, " + (
            "then held" if found.resets > MOST_RESETS else "set up again"
        )
    if begun:
        return begun
    if found.off_ms is None:
        return "goes on"
    if not found.heard:
        return "failsafe"
    return "failsafe, goes on" if found.ends_m_s > STANDS_M_S else "does not notice"


def rows(image: Image) -> Iterator[str]:
    """Lines of the table."""
    yield "|told, m/s|fault|for|off after, ms|stands after, ms|path, cm|turned, °|fastest, m/s|the firmware|then|"
    yield "|---" * 10 + "|"
    for speed_m_s in SPEEDS_M_S:
        for what in (*LASTING, *AT_ONCE):
            for mended in (False, True) if what in LASTING else (False,):
                found = course(image, speed_m_s, what, mended)
                lasts = "100 ms" if mended else "good" if what in LASTING else "once"
                off, stood = (str(ms) if ms else "-" for ms in (found.off_ms, found.stood_ms))
                way = f"{found.path_cm:.0f}", f"{abs(found.turned_deg):.0f}", f"{found.fastest_m_s:.2f}"
                again = "drives" if found.ends_m_s > 0.9 * speed_m_s else "stands"
                cells = (str(speed_m_s), f"`{what}`", lasts, off, stood, *way, answer(what, found), again)
                yield f"|{'|'.join(cells)}|"


def table() -> str:
    """The part of the page."""
    return "\n".join(rows(load_hex(image_path()))) + "\n"


def main() -> None:
    """Prints the table, or writes it into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="into docs/howto/faults.md")
    text = table()
    if not parser.parse_args().write:
        print(text, end="")
        return
    page = PAGE.read_text()
    head, _, rest = page.partition(BEGIN)
    PAGE.write_text(head + BEGIN + text + END + rest.partition(END)[2])


if __name__ == "__main__":
    main()
