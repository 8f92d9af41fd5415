"""For the tests of replay and diff: a short scenario, its script, and worlds in which something is planted."""

from functools import cache
from pathlib import Path

from msgspec.structs import replace

from miro_exact.clock import CONTROL_PERIOD_TICKS
from miro_protocol.frames import encode
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.scenario.file import parse
from miro_sim.world.world import World
from tests.mirotwin.verify.checks.rig import built_in, own_image, team

TEXT = """
name = "pair"
duration_s = 0.4

[[network]]
radio = { bit_error_rate = 0.0 }

[[network.robot]]
slot = 1
reference.kind = "line"
"""
STOP_AT = own_image().code.index(b"\x74\x6e", own_image().symbols.names["_failsafe_tick"].address) + 1
"""The operand of `age == FAILSAFE_STOP_MS` in the robot's own image: MOV A,#110."""


@cache
def scenario():
    return parse(TEXT, "pair")


def script(frames=4):
    """Frames that make the robot drive and answer, and then nothing: the failsafe comes 110 ms later."""
    return [
        Transmission((seq + 1) * CONTROL_PERIOD_TICKS, DOWN, encode(team(seq, 900, 700, ask=True), 3))
        for seq in range(1, frames + 1)
    ]


def world(image=None, seed=3):
    return World(scenario(), seed, image or own_image(), script=script())


class Planted(World):
    """A world that somebody changes from outside at a tick, however it gets there."""

    def plant(self, tick, change):
        self.planted_tick = tick
        self.change = change
        return self

    def run_to(self, tick):
        if self.tick < self.planted_tick <= tick:
            super().run_to(self.planted_tick)
            self.change(self)
        super().run_to(tick)


def planted_world(tick, change):
    return Planted(scenario(), 3, own_image(), script=script()).plant(tick, change)


def periods(of):
    found = []
    while not of.finished:
        found.append(of.step())
    return found


def with_byte(image, address, value):
    """The image with another byte of code, its symbols, and no debug files."""
    code = bytearray(image.code)
    code[address] = value
    return replace(image, code=bytes(code), sha256="", path=Path("nowhere/patched.ihx"))


BUILDS = {
    "late": ("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 15)"),
    "late and moved": ("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 15 + (ticks & 0))"),
    "slower": (
        *("telemetry.c", "        return;\n    begin();"),
        '        return;\n    for (low = 130; low; --low) {\n        __asm__("nop");\n    }\n    begin();',
    ),
}  # fmt: skip


def built(folder, name):
    """The firmware with one of the changes above."""
    return built_in(folder, *BUILDS[name])
