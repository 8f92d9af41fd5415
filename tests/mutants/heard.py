"""Inputs that show the mistakes of `for_fuzzing`, written by hand, and the run that all checks of firmware watch."""

from collections.abc import Sequence
from functools import cache

from miro_exact.clock import CONTROL_PERIOD_TICKS, HOST_CHARACTER_TICKS, ROBOT_BIT_TICKS, seconds
from miro_protocol import crc
from miro_protocol.actions import Reset, ScriptItem
from miro_protocol.frames import seal
from miro_protocol.table import TICKS_PER_MS, downlink
from miro_protocol.transmission import DOWN, Transmission
from miro_protocol.whitening import whiten
from miro_robot.lm629.options import DEFAULT_OPTIONS
from miro_sim.scenario.file import parse
from miro_sim.world.world import World
from mirotwin.verify.checks.monitors import Checks

FORMAT = downlink(3)
LEAD = len(FORMAT.lead)
READY_TICK = 40 * TICKS_PER_MS
_US = TICKS_PER_MS // 1000
_UART_SAMPLE_TICKS = ROBOT_BIT_TICKS // 16
_SILENT = """
name = "silent"
duration_s = {seconds}
stop_on_fault = false
lm629.busy_clocks = {busy_clocks}

[expect]
failsafe_stop_ms = true
motors_off_ms = true
moves_only_when_fresh = true
accepts_only_sent = true
acts_within_ms = true
answers_within_ms = true
answers_only_in_turn = true

[[network]]
host = "silent"
robots = 3
radio = {{ bit_error_rate = 0.0, carrier = "on" }}
robot = [{{ slot = 0, reference = {{ kind = "line" }} }}]
"""
Input = Sequence[ScriptItem]


class Host:
    """Sends to the robot in slot 0 of 3. `tick` is when the next character begins; `heard` is what was said."""

    def __init__(self):
        self.tick = READY_TICK
        self.heard: list[ScriptItem] = []

    def bytes(self, data):
        self.heard.append(Transmission(self.tick, DOWN, bytes(data)))
        self.tick += len(data) * HOST_CHARACTER_TICKS

    def frame(self, kind, seq, payload, lead=LEAD):
        """`lead`: characters of the preamble that are sent."""
        self.bytes(sealed(kind, seq, payload)[LEAD - lead :])

    def team(self, seq, left, right, ask=False, lead=LEAD):
        self.frame(3 if ask else 0, seq, words(left, right), lead)

    def service(self, seq, opcode, rest):
        self.frame(1, seq, bytes([0, opcode]) + rest)

    def pause(self, ms):
        self.tick += round(ms * TICKS_PER_MS)

    def reset(self):
        self.heard += [Reset(self.tick, 0, 0, 1), Reset(self.tick + _US, 0, 0, 0)]
        self.pause(40)


def sealed(kind, seq, payload):
    return seal(FORMAT, bytes([kind << 6 | seq]) + payload.ljust(FORMAT.payload_size, b"\0"))


def words(left, right):
    """Velocities of the robot in slot 0, others stand."""
    return (left & 0xFFFF).to_bytes(2, "little") + (right & 0xFFFF).to_bytes(2, "little")


def verdicts(image, heard, busy_clocks=DEFAULT_OPTIONS.busy_clocks):
    """By the name of the check, 600 ms after the last thing."""
    text = _SILENT.format(seconds=_length_s(heard), busy_clocks=busy_clocks)
    scenario = parse(text, "silent")
    world = World(scenario, 0, image, heard)
    checks = Checks(world)
    while not world.finished:
        world.step()
    checks.finish()
    return {one.name: one.verdict for one in checks.verdicts()}


@cache
def _half_right():
    """A damaged team frame whose CRC leaves the low half of the residue as a good one does."""
    sent = sealed(0, 2, words(100, 100))
    for bits in range(1, 1 << 16):
        wrong = bytearray(sent)
        wrong[-6] ^= bits & 0xFF
        wrong[-5] ^= bits >> 8
        body = whiten(wrong[LEAD + len(FORMAT.sync) :])
        residue = crc.register(bytes([FORMAT.layout]) + body)
        if residue & 0xFF == crc.residue() & 0xFF and residue != crc.residue():
            return bytes(wrong)
    raise AssertionError("no damage leaves half of the residue right")


def _length_s(heard):
    last = max(one.end_tick if isinstance(one, Transmission) else one.tick for one in heard)
    return seconds(-(-(last + 600 * TICKS_PER_MS) // CONTROL_PERIOD_TICKS) * CONTROL_PERIOD_TICKS)


def _bad_crc(host):
    host.team(1, 2000, 2000)
    damaged = bytearray(sealed(0, 2, words(3000, 3000)))
    damaged[10] ^= 4
    host.bytes(damaged)


def _half_crc(host):
    host.team(1, 2000, 2000)
    host.bytes(_half_right())


def _long_run(host):
    host.bytes(bytes(240))
    host.team(1, 2000, 2000)


def _at_once(host):
    host.team(1, 2000, 2000)
    host.bytes(b"\0\0\0")
    host.pause(20)
    host.team(2, 1000, 1000)


def _in_the_window(host):
    host.team(1, 500, 500)
    host.tick += 136 * _UART_SAMPLE_TICKS
    host.bytes(b"\0")
    host.pause(20)
    host.team(4, 1000, 1000)


def _damaged_meanwhile(host):
    host.team(1, 2000, 2000)
    host.pause(20)
    damaged = bytearray(sealed(0, 2, words(3000, 3000)))
    damaged[10] ^= 4
    host.bytes(damaged)


def _nine_on(host):
    host.team(1, 2000, 2000)
    host.team(10, 1000, 1000)


def _old_number(host):
    host.team(30, 2000, 2000)
    host.reset()
    host.team(10, 1000, 1000)


def _full_speed_back(host):
    host.team(1, -16500, -16500)


def _gains(host):
    host.service(1, 1, bytes(8) + bytes([60]))
    host.team(2, 2000, 2000)


def _acceleration_in_motion(host):
    host.team(1, 2000, 2000)
    host.service(2, 2, (9000).to_bytes(4, "little"))


def _opcode(host):
    host.service(1, 0x80, b"")


def _deep(host):
    host.service(1, 0x2B, b"\xc8")


def _load(host):
    host.service(1, 0xB0, b"LOAD")


def _stop_while_answering(host):
    host.team(1, 50, 50)
    host.service(2, 2, (1 << 20).to_bytes(4, "little"))
    host.team(3, 0, 0, ask=True)


def _in_phase_with_the_answer(host):
    host.team(3, 2000, 2000, ask=True)
    host.tick += 137 * _UART_SAMPLE_TICKS
    host.team(4, 2000, 2000)


SLOW_CHIPS = {"does not poll while an answer goes out": 150}
"""Mistakes that only chips show which are busy for so many clocks: 25 us, the longest of the typical times (p. 12)."""
INPUTS = {
    "takes frames with a bad CRC": _bad_crc,
    "compares half of the CRC": _half_crc,
    "counts a run in 8 bits": _long_run,
    "writes back what waits": _at_once,
    "takes from the count of the interrupt": _in_the_window,
    "damaged frames feed the failsafe": _damaged_meanwhile,
    "takes a ninth step": _nine_on,
    "keeps its memory over a reset": _old_number,
    "cuts off by a difference": _full_speed_back,
    "takes one byte too many for gains": _gains,
    "waits for standstill": _acceleration_in_motion,
    "does not look at the opcode's range": _opcode,
    "calls itself as often as a frame says": _deep,
    "jumps into a loader that is not there": _load,
    "does not poll while an answer goes out": _stop_while_answering,
    "clears both flags of the serial port": _in_phase_with_the_answer,
}


def input_for(name):
    """What shows the mistake of this name."""
    host = Host()
    INPUTS[name](host)
    return host.heard
